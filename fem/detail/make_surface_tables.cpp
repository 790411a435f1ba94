#include "fem/detail/make_surface_tables.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/node_gradients.h"
#include "fem/detail/surface_contact.h"

namespace limber::fem::detail {
namespace {

using Tables64 = SurfaceTables<double>;

// The part of a tet that its row of least weights leaves, moved out by a distance.
Tables64::Core core_of(const Points& x, const Tets& tets, int t, const Weights& least, double out_m) {
  Tables64::Core core{{}, 1};
  if (!(least.row(t).maxCoeff() <= 1)) return {{}, -1};
  const auto corner = [&](int i) -> Vec3 { return x.row(tets(t, i)); };
  const double volume6 = 6 * signed_volume(corner(0), corner(1), corner(2), corner(3));
  for (int i = 0; i < 4; ++i) {
    const Vec3 a = corner((i + 1) % 4), normal = (corner((i + 2) % 4) - a).cross(corner((i + 3) % 4) - a);
    core.least[i] = least(t, i) - out_m * normal.norm() / volume6;
    core.scale -= core.least[i];
  }
  constexpr double thinnest = 0.02;  // planes of what is thinner are not to be had in float32
  if (const double lack = thinnest - core.scale; lack > 0) {
    for (double& l : core.least) l -= lack / 4;
    core.scale = thinnest;
  }
  return core;
}

// The largest sum of weights without their signs over the cores' corners and the samples: how far these may
// move at most when nodes move by one.
double reach_factor(const Tables64::Core& core) {
  double sum = 0, most = 0;
  for (const double l : core.least) sum += std::abs(l);
  for (const double l : core.least) most = std::max(most, sum - std::abs(l) + std::abs(l + core.scale));
  return most;
}

// What Phong Deformation needs of all bodies.
void append_slopes(const World& world, Tables64& tables) {
  std::vector<std::vector<Tables64::Slope>> slopes(std::size_t(world.nodes));
  bool any = false;
  for (const Body& body : world.bodies) {
    if (!body.phong) continue;
    any = true;
    const NodeGradients gradients = node_gradients(body.cage);
    for (int n = 0; n < body.node_count(); ++n)
      for (int k = gradients.begin[std::size_t(n)]; k < gradients.begin[std::size_t(n) + 1]; ++k)
        slopes[std::size_t(body.first_node + n)].push_back(
            {body.first_node + gradients.neighbour[std::size_t(k)],
             {gradients.gradient(k, 0), gradients.gradient(k, 1), gradients.gradient(k, 2)}});
  }
  if (!any) return;
  for (const auto& of_node : slopes) {
    tables.first_slope.push_back(int(tables.slopes.size()));
    tables.slopes.insert(tables.slopes.end(), of_node.begin(), of_node.end());
  }
  tables.first_slope.push_back(int(tables.slopes.size()));
  tables.weight_gradients.resize(9 * world.topology.tets.size() + 1);
  for (const Body& body : world.bodies)
    for (std::size_t t = 0; t < body.inverse_rest_edges.size(); ++t)
      for (int i = 0; i < 9; ++i)
        tables.weight_gradients[9 * (std::size_t(body.first_tet) + t) + std::size_t(i)] =
            body.inverse_rest_edges[t](i / 3, i % 3);
}

double bulge_of(const Body& body, double skin_m) {
  if (!body.phong) return 0;
  constexpr double of_skin = 0.3, of_size = 0.02;
  return std::min(of_skin * skin_m, of_size * bounding_box(body.cage.positions).size().maxCoeff());
}

// Of Σ wᵢ wⱼ ½ |(Fᵢ − Fⱼ) (Xⱼ − Xᵢ)|, at most ⅜ of the largest of a tet's edges, when nodes move by one.
double bend_factor_of(const Body& body, const Tables64& tables) {
  double most = 0;
  std::map<int, Vec3> difference;
  for (Eigen::Index t = 0; t < body.cage.tets.rows() && body.phong; ++t)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) {
        const int ends[2] = {body.cage.tets(t, i), body.cage.tets(t, j)};
        difference.clear();
        for (const int side : {0, 1})
          for (int k = tables.first_slope[std::size_t(body.first_node + ends[side])];
               k < tables.first_slope[std::size_t(body.first_node + ends[side]) + 1]; ++k) {
            const Tables64::Slope& slope = tables.slopes[std::size_t(k)];
            difference.try_emplace(slope.node, Vec3::Zero()).first->second +=
                (side == 0 ? 1.0 : -1.0) * Eigen::Map<const Vec3>(slope.gradient);
          }
        const Vec3 edge = body.cage.positions.row(ends[1]) - body.cage.positions.row(ends[0]);
        double sum = 0;
        for (const auto& [node, gradient] : difference) sum += std::abs(gradient.dot(edge));
        most = std::max(most, 0.375 * 0.5 * sum);
      }
  return most;
}

void append(const Body& body, const Topology& topology, Tables64& tables, Tables64::Body& out) {
  const ContactShape& shape = *body.shape;
  const int tets = int(body.cage.tets.rows());
  LIMBER_CHECK(shape.min_weight.rows() == tets, shape.min_weight.rows(), tets);
  out.field = {shape.field.values.data(), {}, {}, 1 / shape.field.cell_m, shape.field.unit_m};
  for (int c = 0; c < 3; ++c)
    out.field.nodes[c] = shape.field.nodes[std::size_t(c)], out.field.lower[c] = shape.field.lower_m[c];
  out.reach_factor = 1;
  const SurfaceSamples& samples = shape.samples;
  std::map<int, std::vector<int>> wall_tets;  // of a node
  Eigen::Index s = 0;
  for (int t = 0; t < tets; ++t) {
    const int tet = body.first_tet + t;
    const Tables64::Core& core = tables.cores.emplace_back(
        core_of(body.cage.positions, body.cage.tets, t, shape.min_weight, tables.core_reach));
    if (core.scale > 0) {
      out.cored_tets.push_back(tet);
      out.reach_factor = std::max(out.reach_factor, reach_factor(core));
    }
    tables.first_sample.push_back(int(tables.samples.size()));
    const auto& nodes = topology.tets[std::size_t(tet)].node;
    Eigen::Index end = s;
    while (end < samples.positions_m.rows() && samples.tet_from_sample[end] == t) ++end;
    const auto held = [&](Eigen::Index k) {
      for (int i = 0; i < 4; ++i)
        if (!body.fixed[std::size_t(nodes[i] - body.first_node)] && std::abs(samples.weights(k, i)) > 1e-6)
          return false;
      return true;
    };
    for (const bool which : {false, true}) {
      for (Eigen::Index k = s; k < end; ++k) {
        if (held(k) != which) continue;
        auto& sample = tables.samples.emplace_back();
        sample.tet = tet, sample.area = samples.area_m2[k];
        std::copy_n(nodes, 4, sample.node);
        std::copy_n(&samples.weights(k, 0), 4, sample.weight);
        for (int i = 0; i < 4; ++i) tables.weights[i].push_back(samples.weights(k, i));
        out.reach_factor = std::max(out.reach_factor, samples.weights.row(k).cwiseAbs().sum());
      }
      if (!which) tables.first_held_sample.push_back(int(tables.samples.size()));
    }
    s = end;
    if (tables.first_held_sample.back() > tables.first_sample.back())
      for (const int node : nodes) wall_tets[node].push_back(tet);
    if (tables.first_sample.back() < int(tables.samples.size())) out.sampled_tets.push_back(tet);
  }
  LIMBER_CHECK(s == samples.positions_m.rows(), s, samples.positions_m.rows());
  for (const auto& [node, tets_of_node] : wall_tets) {
    out.wall_nodes.push_back(node), out.first_tet_of_wall_node.push_back(int(out.tets_of_wall_nodes.size()));
    out.tets_of_wall_nodes.insert(out.tets_of_wall_nodes.end(), tets_of_node.begin(), tets_of_node.end());
  }
  out.first_tet_of_wall_node.push_back(int(out.tets_of_wall_nodes.size()));
}

void append_tets_round_nodes(const Body& body, Tables64& tables) {
  for (int t = 0; t < body.cage.tets.rows(); ++t)
    for (int i = 0; i < 4; ++i)
      tables.tets_round_node[std::size_t(body.first_node + body.cage.tets(t, i))].push_back(body.first_tet +
                                                                                            t);
}

void append_shares(const World& world, Tables64& tables) {
  std::vector<double> scratch(std::size_t(world.nodes), 0.0);
  const double* rest = world.tables64.rest_positions.data();
  for (const auto& sample : tables.samples) {
    tables.first_share.push_back(int(tables.shares.size()));
    if (!tables.slopes.empty() &&
        tables.first_slope[std::size_t(sample.node[0])] < tables.first_slope[std::size_t(sample.node[0]) + 1])
      tables.spread(rest, sample.node, sample.weight, 1, scratch, tables.shares);
    else
      for (int i = 0; i < 4; ++i) tables.shares.push_back({sample.node[i], sample.weight[i]});
  }
  tables.first_share.push_back(int(tables.shares.size()));
}

// What each precision computes by itself.
template <class Real>
void complete(const Topology& topology, const Tables<Real>& world, SurfaceTables<Real>& tables) {
  for (int sample = 0; sample < int(tables.samples.size()); ++sample) {
    auto& sizes = tables.sizes.emplace_back();
    for (const auto [node, weight] : tables.shares_of(sample)) {
      sizes.all += std::abs(weight);
      if (world.inverse_mass[std::size_t(node)] > 0) sizes.borne += std::abs(weight);
    }
  }
  const Real* rest = world.rest_positions.data();
  for (std::size_t n = 0; n < world.rest_positions.size(); n += 3)
    tables.rest_places.insert(tables.rest_places.end(), {rest[n], rest[n + 1], rest[n + 2], 0});
  if (tables.slopes.empty()) return;
  for (const Topology::Tet& tet : topology.tets)
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j)
        for (int c = 0; c < 4; ++c)
          tables.half_edges.push_back(
              c < 3 ? Real(0.5) * (rest[3 * tet.node[j] + c] - rest[3 * tet.node[i] + c]) : Real(0));
}

SurfaceTables<float> single_precision(const Tables64& t) {
  SurfaceTables<float> out;
  for (const auto& s : t.samples) {
    auto& copy = out.samples.emplace_back();
    std::copy_n(s.node, 4, copy.node), std::copy_n(s.weight, 4, copy.weight);
    copy.tet = s.tet, copy.area = float(s.area);
  }
  for (int i = 0; i < 4; ++i) out.weights[i].assign(t.weights[i].begin(), t.weights[i].end());
  out.first_sample = t.first_sample, out.first_held_sample = t.first_held_sample;
  out.core_reach = float(t.core_reach), out.wall_slack = float(t.wall_slack);
  for (const auto& c : t.cores) {
    auto& copy = out.cores.emplace_back();
    std::copy_n(c.least, 4, copy.least), copy.scale = float(c.scale);
  }
  for (const auto& b : t.bodies) {
    auto& copy = out.bodies.emplace_back();
    copy.field.values = b.field.values;
    std::copy_n(b.field.nodes, 3, copy.field.nodes), std::copy_n(b.field.lower, 3, copy.field.lower);
    copy.field.inverse_cell = float(b.field.inverse_cell), copy.field.unit = float(b.field.unit);
    copy.phong = b.phong, copy.bulge = float(b.bulge), copy.bend_factor = 1.0001f * float(b.bend_factor);
    copy.reach_factor = 1.0001f * float(b.reach_factor);
    copy.sampled_tets = b.sampled_tets, copy.cored_tets = b.cored_tets;
    copy.wall_nodes = b.wall_nodes, copy.first_tet_of_wall_node = b.first_tet_of_wall_node;
    copy.tets_of_wall_nodes = b.tets_of_wall_nodes;
  }
  out.offset.assign(t.offset.begin(), t.offset.end());
  out.first_own_offset = t.first_own_offset, out.own_offset.assign(t.own_offset.begin(), t.own_offset.end());
  for (const auto& s : t.slopes)
    out.slopes.push_back({s.node, {float(s.gradient[0]), float(s.gradient[1]), float(s.gradient[2])}});
  out.first_slope = t.first_slope, out.first_share = t.first_share;
  for (const auto& s : t.shares) out.shares.push_back({s.node, float(s.weight)});
  out.weight_gradients.assign(t.weight_gradients.begin(), t.weight_gradients.end());
  out.tets_round_node = t.tets_round_node;
  return out;
}

}  // namespace

void make_surface_tables(double offset_m, World& world) {
  const std::size_t with_shape = std::size_t(std::count_if(world.bodies.begin(), world.bodies.end(),
                                                           [](const Body& b) { return b.shape != nullptr; }));
  LIMBER_CHECK(with_shape == 0 || with_shape == world.bodies.size(), with_shape, world.bodies.size());
  if (with_shape == 0) return;
  LIMBER_CHECK(offset_m >= 0, offset_m);
  Tables64& tables = world.surfaces64;
  tables.core_reach = 2 * offset_m, tables.wall_slack = 0.05 * offset_m;
  tables.bodies.resize(world.bodies.size());
  tables.tets_round_node.resize(std::size_t(world.nodes));
  append_slopes(world, tables);
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    Tables64::Body& body = tables.bodies[b];
    body.phong = world.bodies[b].phong, body.bulge = bulge_of(world.bodies[b], world.tables64.skin[b]);
    body.bend_factor = bend_factor_of(world.bodies[b], tables);
  }
  for (const bool moving : {true, false})  // in the order of the world's tets
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
      if (world.bodies[b].moving != moving) continue;
      append(world.bodies[b], world.topology, tables, tables.bodies[b]);
      if (world.bodies[b].self_contact) append_tets_round_nodes(world.bodies[b], tables);
    }
  tables.first_sample.push_back(int(tables.samples.size()));
  for (auto& column : tables.weights) column.resize(column.size() + block_size, 0);
  append_shares(world, tables);
  const std::size_t bodies = world.bodies.size();
  tables.offset.assign(bodies * bodies, offset_m);
  world.surfaces = single_precision(tables);
  complete(world.topology, world.tables64, tables);
  complete(world.topology, world.tables, world.surfaces);
}

}  // namespace limber::fem::detail
