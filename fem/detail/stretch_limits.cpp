#include "fem/detail/stretch_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/detail/contact.h"
#include "fem/detail/penalty.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

// The force begins at this share of the way from rest to the limit, and has half of its stiffness at another
// such share beyond that.
constexpr double free_share = 0.6, half_stiff_share = 0.05;

// Eigenvectors of a symmetric matrix, as columns, by Jacobi's rotations; the matrix becomes diagonal. Only
// + − × ÷ √, always the same number of them.
void diagonalise(double m[3][3], double vectors[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) vectors[i][j] = i == j;
  constexpr int sweeps = 6;
  for (int rotation = 0; rotation < 3 * sweeps; ++rotation) {
    const int p = rotation % 3 == 2 ? 1 : 0, q = rotation % 3 == 0 ? 1 : 2;
    if (m[p][q] == 0) continue;
    const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
    const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
    const double c = 1 / std::sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < 3; ++k) {
      const double mkp = m[k][p], mkq = m[k][q], vkp = vectors[k][p], vkq = vectors[k][q];
      m[k][p] = c * mkp - s * mkq, m[k][q] = s * mkp + c * mkq;
      vectors[k][p] = c * vkp - s * vkq, vectors[k][q] = s * vkp + c * vkq;
    }
    for (int k = 0; k < 3; ++k) {
      const double mpk = m[p][k], mqk = m[q][k];
      m[p][k] = c * mpk - s * mqk, m[q][k] = s * mpk + c * mqk;
    }
  }
}

}  // namespace

template <class Real>
StretchLimits<Real>::StretchLimits(const World& world, const Kernels<Real>& kernels)
    : tables_(tables_of<Real>(world)), kernels_(kernels), step_(Real(world.contact_dt_s / world.substeps)) {
  std::vector<std::size_t> first;
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const fem::Body& body = world.bodies[b];
    if (!body.moving || body.kind != BodyKind::deformable || !std::isfinite(body.max_stretch)) continue;
    const double most = 1 + free_share * (body.max_stretch - 1);
    Body& limited = bodies_.emplace_back();
    limited.index = int(b), limited.least = Real(1 / most), limited.most = Real(most);
    limited.half_stiff = Real(half_stiff_share * (body.max_stretch - 1));
    first.push_back(nodes_.size() / 4);
    for (std::size_t t = 0; t < body.inverse_rest_edges.size(); ++t) {
      const int* node = world.topology.tets[std::size_t(body.first_tet) + t].node;
      nodes_.insert(nodes_.end(), node, node + 4);
      const Eigen::Matrix3d& inverse = body.inverse_rest_edges[t];
      for (int i = 0; i < 9; ++i) inverse_rest_.push_back(Real(inverse(i / 3, i % 3)));
      // Rows are the gradients of the weights of nodes 1 … 3; F changes by Σ movement × gradient.
      limited.reach.push_back(Real(inverse.rowwise().norm().sum() + inverse.colwise().sum().norm()));
    }
  }
  first.push_back(nodes_.size() / 4);
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& body = bodies_[k];
    const int count = int(first[k + 1] - first[k]);
    body.tets = {&nodes_[4 * first[k]], &inverse_rest_[9 * first[k]], count, body.least, body.most,
                 body.reach.data()};
    body.stretched.resize(std::size_t(count)), body.lanes.resize(std::size_t(count));
    body.asleep_until.resize(std::size_t(count * kernels.lanes + block_size));
  }
  for (int lane = 0; lane < kernels.lanes; ++lane) forget(lane);
  loads_.assign(std::size_t(world.nodes), 0);
}

template <class Real>
void StretchLimits<Real>::forget(int lane) {
  for (Body& body : bodies_)
    for (int t = 0; t < body.tets.count; ++t)
      body.asleep_until[std::size_t(t * kernels_.lanes + lane)] = std::numeric_limits<Real>::lowest();
}

template <class Real>
void StretchLimits<Real>::find(const Real* x, const Real* inner_travel, const std::vector<bool>& all_asleep) {
  for (Body& body : bodies_)
    body.found =
        all_asleep[std::size_t(body.index)]
            ? 0
            : kernels_.find_stretched(body.tets, x, inner_travel + body.index * kernels_.lanes,
                                      body.asleep_until.data(), body.stretched.data(), body.lanes.data());
}

template <class Real>
void StretchLimits<Real>::add_forces(int lane, const LaneView<Real>& view) {
  for (const Body& body : bodies_) {
    if (view.sleeps(body.index)) continue;
    limits_.clear();
    for (int k = 0; k < body.found; ++k)
      if (body.lanes[std::size_t(k)] >> lane & 1) measure(view, body, body.stretched[std::size_t(k)]);
    // Stiffness is shared by loads, as between touches of surfaces (docs/contact.md).
    for (const Limit& limit : limits_)
      for (int i = 0; i < 4; ++i) loads_[limit.node[i]] += limit.depth * std::abs(limit.weight[i]);
    for (const Limit& limit : limits_) {
      Real relative[3] = {0, 0, 0}, inverse_mass = 0;
      for (int i = 0; i < 4; ++i) {
        const int node = limit.node[i];
        for (int c = 0; c < 3; ++c) relative[c] += limit.weight[i] * view.v[view.state.at(node, c)];
        inverse_mass += std::abs(limit.weight[i]) * (loads_[node] / limit.depth) * tables_.inverse_mass[node];
      }
      inverse_mass /= limit.stiffness;
      if (!(inverse_mass > 0)) continue;
      const Real push = penalty_push(Real(surface_beta), limit.depth, dot(relative, limit.direction),
                                     1 / inverse_mass, step_);
      if (!(push > 0)) continue;
      for (int i = 0; i < 4; ++i)
        if (tables_.inverse_mass[limit.node[i]] > 0)
          for (int c = 0; c < 3; ++c)
            view.f[view.force.at(limit.node[i], c)] += limit.weight[i] * (push * limit.direction[c]);
    }
    for (const Limit& limit : limits_)
      for (const int node : limit.node) loads_[node] = 0;
  }
}

// Singular values and vectors of F: those at rest of FᵀF, those now by F, the last one square to the other
// two, so that an inverted tet has a negative value.
template <class Real>
void StretchLimits<Real>::measure(const LaneView<Real>& view, const Body& body, int tet) {
  const int* node = body.tets.nodes + 4 * tet;
  const Real* rest = body.tets.inverse_rest + 9 * tet;
  double f[3][3], metric[3][3] = {}, v[3][3];
  for (int c = 0; c < 3; ++c)
    for (int j = 0; j < 3; ++j) {
      f[c][j] = 0;
      for (int i = 0; i < 3; ++i)
        f[c][j] +=
            (double(view.x[view.state.at(node[i + 1], c)]) - double(view.x[view.state.at(node[0], c)])) *
            double(rest[3 * i + j]);
    }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int c = 0; c < 3; ++c) metric[i][j] += f[c][i] * f[c][j];
  diagonalise(metric, v);
  int order[3] = {0, 1, 2};  // descending
  std::sort(order, order + 3, [&](int i, int j) {
    return metric[i][i] > metric[j][j] || (metric[i][i] == metric[j][j] && i < j);
  });
  double at_rest[3][3], now[3][3], value[3];
  for (int k = 0; k < 2; ++k) {
    for (int c = 0; c < 3; ++c) at_rest[k][c] = v[c][order[k]];
    for (int c = 0; c < 3; ++c) now[k][c] = dot(f[c], at_rest[k]);
    value[k] = std::sqrt(dot(now[k], now[k]));
    if (!(value[k] > 1e-6)) return;  // drawn to a line: there is no direction, and its neighbours decide
    for (double& c : now[k]) c /= value[k];
  }
  cross(at_rest[0], at_rest[1], at_rest[2]), cross(now[0], now[1], now[2]);
  double image[3];
  for (int c = 0; c < 3; ++c) image[c] = dot(f[c], at_rest[2]);
  value[2] = dot(now[2], image);
  for (int k = 0; k < 3; ++k) {
    const double beyond = value[k] - double(body.most), below = double(body.least) - value[k];
    if (!(beyond > 0 || below > 0)) continue;
    Limit limit;
    double weight[4], sum = 0;
    weight[0] = 0;
    for (int i = 0; i < 3; ++i) {
      weight[i + 1] = 0;
      for (int j = 0; j < 3; ++j) weight[i + 1] += double(rest[3 * i + j]) * at_rest[k][j];
      weight[0] -= weight[i + 1];
    }
    for (const double w : weight) sum += std::abs(w);
    for (int i = 0; i < 4; ++i) limit.node[i] = node[i], limit.weight[i] = Real(2 * weight[i] / sum);
    // Of a squeeze by as much as of its inverse, a draw.
    const double far = std::max(beyond, 1 / std::max(value[k], 0.1) - double(body.most));
    limit.stiffness = Real(far / (far + double(body.half_stiff)));
    limit.depth = Real(2 * (beyond > 0 ? beyond : below) / sum);
    for (int c = 0; c < 3; ++c) limit.direction[c] = Real(beyond > 0 ? -now[k][c] : now[k][c]);
    if (limit.depth > 0) limits_.push_back(limit);
  }
}

template class StretchLimits<float>;
template class StretchLimits<double>;

}  // namespace limber::fem::detail
