#include "ffd/binding.h"

#include <Eigen/LU>
#include <cmath>
#include <map>

#include "core/error.h"
#include "ffd/detail/tet_locator.h"

namespace limber::ffd {

namespace {

using detail::TetLocator;
using detail::Weights4;

// Extrapolated weights never go below this: then a vertex far from the cage moves at most a few times as far
// as it.
constexpr double min_weight = -1;

class SurfaceGraph {
 public:
  explicit SurfaceGraph(const SurfaceMesh& s)
      : triangles_(s.triangles), begin_(std::size_t(s.positions.rows() + 1)) {
    for (Eigen::Index i = 0; i < triangles_.size(); ++i) ++begin_[std::size_t(triangles_.data()[i]) + 1];
    for (std::size_t v = 1; v < begin_.size(); ++v) begin_[v] += begin_[v - 1];
    triangle_.resize(std::size_t(triangles_.size()));
    std::vector<int> next(begin_.begin(), begin_.end() - 1);
    for (Eigen::Index i = 0; i < triangles_.size(); ++i)
      triangle_[std::size_t(next[std::size_t(triangles_.data()[i])]++)] = int(i / 3);
  }

  int vertices() const { return int(begin_.size()) - 1; }

  // Calls visit(vertex, from) for every vertex reached from `start`, breadth first; `from` is reached
  // already.
  template <class Visit>
  void flood(int start, std::vector<char>& reached, std::vector<int>& queue, Visit&& visit) const {
    queue.assign(1, start);
    reached[std::size_t(start)] = 1;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const int from = queue[head];
      for (int i = begin_[std::size_t(from)]; i < begin_[std::size_t(from) + 1]; ++i)
        for (int k = 0; k < 3; ++k) {
          const int v = triangles_(triangle_[std::size_t(i)], k);
          if (reached[std::size_t(v)]) continue;
          reached[std::size_t(v)] = 1;
          queue.push_back(v);
          visit(v, from);
        }
    }
  }

 private:
  const Triangles& triangles_;
  std::vector<int> begin_;     // (V + 1) into triangle_
  std::vector<int> triangle_;  // round each vertex
};

class Binder {
 public:
  Binder(const SurfaceMesh& surface, const TetMesh& cage)
      : surface_(surface), locator_(cage), graph_(surface) {
    binding_.tet_from_vertex.resize(surface.positions.rows());
    binding_.weights.resize(surface.positions.rows(), 4);
  }

  Binding run() {
    std::vector<char> in_piece(std::size_t(graph_.vertices())), bound(in_piece.size());
    std::vector<int> piece, queue;
    for (int v = 0; v < graph_.vertices(); ++v) {
      if (in_piece[std::size_t(v)]) continue;
      graph_.flood(v, in_piece, piece, [](int, int) {});
      const int seed = clearest_of(piece);
      bind_anywhere(seed);
      graph_.flood(seed, bound, queue, [&](int next, int from) { bind_near(next, from); });
    }
    return std::move(binding_);
  }

 private:
  Vec3 position(int v) const { return surface_.positions.row(v); }

  // Where two limbs of the cage touch, a vertex on the common face could be either's: start at one that is
  // clearly inside a tet. A few dozen trials find one in all but wafer-thin pieces.
  int clearest_of(const std::vector<int>& piece) const {
    constexpr std::size_t trials = 32;
    const std::size_t stride = std::max<std::size_t>(1, piece.size() / trials);
    int clearest = piece.front();
    double depth = -1;
    for (std::size_t i = 0; i < piece.size() && depth < 0.01; i += stride) {
      const TetLocator::Nearest n = locator_.nearest(position(piece[i]));
      if (n.distance2 == 0 && n.weights.minCoeff() > depth) clearest = piece[i], depth = n.weights.minCoeff();
    }
    return clearest;
  }

  void bind_near(int v, int from) {
    const int tet = locator_.walk(binding_.tet_from_vertex[from], position(v));
    if (tet < 0) return bind_anywhere(v);
    set(v, tet, locator_.weights(tet, position(v)));
  }

  void bind_anywhere(int v) {
    const TetLocator::Nearest n = locator_.nearest(position(v));
    if (n.distance2 == 0) return set(v, n.tet, n.weights);
    bind_outside(v, n);
  }

  void bind_outside(int v, const TetLocator::Nearest& n) {
    ++binding_.outside;
    const double distance = std::sqrt(n.distance2);
    if (distance > binding_.max_outside_distance_m) {
      binding_.max_outside_distance_m = distance;
      binding_.farthest_outside_vertex = v;
    }
    // From the nearest point of the tet outwards, as far as the clamp allows.
    const Weights4 way = locator_.weights(n.tet, position(v)) - n.weights;
    double share = 1;
    for (int k = 0; k < 4; ++k)
      if (n.weights[k] + way[k] < min_weight) share = std::min(share, (min_weight - n.weights[k]) / way[k]);
    set(v, n.tet, n.weights + share * way);
  }

  void set(int v, int tet, const Weights4& w) {
    binding_.tet_from_vertex[v] = tet;
    binding_.weights.row(v) = w;
  }

  const SurfaceMesh& surface_;
  TetLocator locator_;
  SurfaceGraph graph_;
  Binding binding_;
};

using NodeCofactors = std::vector<Eigen::Matrix3d>;

// The cofactor of F = (b−a, c−a, d−a) deformed × the same at rest inverted, averaged at each node by rest
// volume. cof F = cof(deformed) cof(rest)⁻¹, and cof(rest)⁻¹ is restᵀ / det(rest).
NodeCofactors node_cofactors(const TetMesh& rest, const Points& positions) {
  NodeCofactors sums(std::size_t(positions.rows()), Eigen::Matrix3d::Zero());
  const auto edges = [](const Points& p, const auto& tet) {
    Eigen::Matrix3d e;
    for (int k = 0; k < 3; ++k) e.col(k) = p.row(tet[k + 1]) - p.row(tet[0]);
    return e;
  };
  const auto cofactor = [](const Eigen::Matrix3d& m) {
    Eigen::Matrix3d c;
    for (int k = 0; k < 3; ++k) c.col(k) = m.col((k + 1) % 3).cross(m.col((k + 2) % 3));
    return c;
  };
  for (Eigen::Index t = 0; t < rest.tets.rows(); ++t) {
    const auto tet = rest.tets.row(t);
    // Times det(rest), which is six volumes and so already the weight of the average.
    const Eigen::Matrix3d weighted = cofactor(edges(positions, tet)) * edges(rest.positions, tet).transpose();
    for (int k = 0; k < 4; ++k) sums[std::size_t(tet[k])] += weighted;
  }
  std::vector<double> volumes(sums.size(), 0.0);
  for (Eigen::Index t = 0; t < rest.tets.rows(); ++t) {
    const double volume6 = edges(rest.positions, rest.tets.row(t)).determinant();
    for (int k = 0; k < 4; ++k) volumes[std::size_t(rest.tets(t, k))] += volume6;
  }
  for (std::size_t n = 0; n < sums.size(); ++n)
    if (volumes[n] > 0) sums[n] /= volumes[n];
  return sums;
}

}  // namespace

Binding bind(const SurfaceMesh& surface, const TetMesh& cage) {
  validate(surface, "surface");
  validate(cage, "cage");
  return Binder(surface, cage).run();
}

void deform(const Binding& binding, const Tets& tets, const Points& cage_positions,
            Points& surface_positions) {
  const Eigen::Index vertices = binding.tet_from_vertex.size();
  LIMBER_CHECK(binding.weights.rows() == vertices, binding.weights.rows(), vertices);
  surface_positions.resize(vertices, 3);
  const double* const nodes = cage_positions.data();
  for (Eigen::Index v = 0; v < vertices; ++v) {
    const int* const tet = tets.data() + 4 * std::ptrdiff_t(binding.tet_from_vertex[v]);
    const double* const w = binding.weights.data() + 4 * v;
    const double *const a = nodes + 3 * std::ptrdiff_t(tet[0]), *const b = nodes + 3 * std::ptrdiff_t(tet[1]);
    const double *const c = nodes + 3 * std::ptrdiff_t(tet[2]), *const d = nodes + 3 * std::ptrdiff_t(tet[3]);
    double* const p = surface_positions.data() + 3 * v;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = w[0] * a[axis] + w[1] * b[axis] + w[2] * c[axis] + w[3] * d[axis];
  }
}

Gradients node_deformation_gradients(const NodeGradients& gradients, const Points& cage_positions) {
  const Eigen::Index nodes = cage_positions.rows();
  LIMBER_CHECK(Eigen::Index(gradients.begin.size()) == nodes + 1, gradients.begin.size(), nodes);
  Gradients result(nodes, 9);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    double f[9] = {};
    for (int k = gradients.begin[std::size_t(i)]; k < gradients.begin[std::size_t(i) + 1]; ++k) {
      const double* const x = cage_positions.data() + 3 * std::ptrdiff_t(gradients.neighbour[std::size_t(k)]);
      const double* const g = gradients.gradient.data() + 3 * std::ptrdiff_t(k);
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) f[3 * row + column] += x[row] * g[column];
    }
    std::copy_n(f, 9, &result(i, 0));
  }
  return result;
}

void deform_phong(const Binding& binding, const TetMesh& rest_cage, const NodeGradients& gradients,
                  const Points& cage_positions, Points& surface_positions) {
  const Eigen::Index vertices = binding.tet_from_vertex.size(), nodes = rest_cage.positions.rows();
  LIMBER_CHECK(binding.weights.rows() == vertices, binding.weights.rows(), vertices);
  LIMBER_CHECK(cage_positions.rows() == nodes, cage_positions.rows(), nodes);
  const Gradients f = node_deformation_gradients(gradients, cage_positions);
  // A node's share of a vertex is w_i (x_i − ½ F_i X_i) + w_i ½ F_i X. Rows: X_i, x_i − ½ F_i X_i, ½ F_i, and
  // a number that makes a row whole cache lines.
  constexpr int numbers = 16;
  Eigen::Matrix<double, Eigen::Dynamic, numbers, Eigen::RowMajor> maps(nodes, numbers);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    const Eigen::Matrix3d half =
        0.5 * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&f(i, 0));
    const Vec3 rest = rest_cage.positions.row(i);
    maps.row(i) << rest.transpose(), cage_positions.row(i) - (half * rest).transpose(), 0.5 * f.row(i), 0;
  }
  surface_positions.resize(vertices, 3);
  for (Eigen::Index v = 0; v < vertices; ++v) {
    const int* const tet = rest_cage.tets.data() + 4 * std::ptrdiff_t(binding.tet_from_vertex[v]);
    const double* const w = binding.weights.data() + 4 * v;
    const double *const a = maps.data() + numbers * std::ptrdiff_t(tet[0]),
                        *const b = maps.data() + numbers * std::ptrdiff_t(tet[1]),
                        *const c = maps.data() + numbers * std::ptrdiff_t(tet[2]),
                        *const d = maps.data() + numbers * std::ptrdiff_t(tet[3]);
    double m[numbers];
    for (int k = 0; k < numbers; ++k) m[k] = w[0] * a[k] + w[1] * b[k] + w[2] * c[k] + w[3] * d[k];
    double* const p = surface_positions.data() + 3 * v;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = m[3 + axis] + (m[6 + 3 * axis] * m[0] + m[7 + 3 * axis] * m[1] + m[8 + 3 * axis] * m[2]);
  }
}

void deform_normals(const Binding& binding, const TetMesh& rest_cage, const Points& cage_positions,
                    const Points& rest_normals, Points& normals) {
  const Eigen::Index vertices = binding.tet_from_vertex.size();
  LIMBER_CHECK(rest_normals.rows() == vertices, rest_normals.rows(), vertices);
  LIMBER_CHECK(cage_positions.rows() == rest_cage.positions.rows(), cage_positions.rows(),
               rest_cage.positions.rows());
  const NodeCofactors cofactors = node_cofactors(rest_cage, cage_positions);
  normals.resize(vertices, 3);
  for (Eigen::Index v = 0; v < vertices; ++v) {
    const Vec3 at_rest = rest_normals.row(v);
    Vec3 normal = Vec3::Zero();
    for (int k = 0; k < 4; ++k)
      normal += binding.weights(v, k) *
                (cofactors[std::size_t(rest_cage.tets(binding.tet_from_vertex[v], k))] * at_rest);
    const double length = normal.norm();
    if (length > 0) normal /= length;
    normals.row(v) = length > 0 ? normal : at_rest;
  }
}

}  // namespace limber::ffd
