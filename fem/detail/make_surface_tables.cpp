#include "fem/detail/make_surface_tables.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

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

void append(const Body& body, double offset_m, const Topology& topology, Tables64& tables,
            Tables64::Body& out) {
  const ContactShape& shape = *body.shape;
  const int tets = int(body.cage.tets.rows());
  LIMBER_CHECK(shape.least_weight.rows() == tets, shape.least_weight.rows(), tets);
  out.field = {shape.field.values.data(), {}, {}, 1 / shape.field.cell_m, shape.field.unit_m};
  for (int c = 0; c < 3; ++c)
    out.field.nodes[c] = shape.field.nodes[std::size_t(c)], out.field.lower[c] = shape.field.lower_m[c];
  out.reach_factor = 1;
  const SurfaceSamples& samples = shape.samples;
  Eigen::Index s = 0;
  for (int t = 0; t < tets; ++t) {
    const int tet = body.first_tet + t;
    const Tables64::Core& core = tables.cores.emplace_back(
        core_of(body.cage.positions, body.cage.tets, t, shape.least_weight, 2 * offset_m));
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
    if (tables.first_held_sample.back() > tables.first_sample.back()) out.wall_tets.push_back(tet);
    if (tables.first_sample.back() < int(tables.samples.size())) out.sampled_tets.push_back(tet);
  }
  LIMBER_CHECK(s == samples.positions_m.rows(), s, samples.positions_m.rows());
}

void append_tets_round_nodes(const Body& body, Tables64& tables) {
  for (int t = 0; t < body.cage.tets.rows(); ++t)
    for (int i = 0; i < 4; ++i)
      tables.tets_round_node[std::size_t(body.first_node + body.cage.tets(t, i))].push_back(body.first_tet +
                                                                                            t);
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
  out.wall_slack = float(t.wall_slack);
  for (const auto& c : t.cores) {
    auto& copy = out.cores.emplace_back();
    std::copy_n(c.least, 4, copy.least), copy.scale = float(c.scale);
  }
  for (const auto& b : t.bodies) {
    auto& copy = out.bodies.emplace_back();
    copy.field.values = b.field.values;
    std::copy_n(b.field.nodes, 3, copy.field.nodes), std::copy_n(b.field.lower, 3, copy.field.lower);
    copy.field.inverse_cell = float(b.field.inverse_cell), copy.field.unit = float(b.field.unit);
    copy.reach_factor = 1.0001f * float(b.reach_factor);
    copy.sampled_tets = b.sampled_tets, copy.cored_tets = b.cored_tets;
    copy.wall_tets = b.wall_tets;
  }
  out.offset.assign(t.offset.begin(), t.offset.end());
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
  tables.bodies.resize(world.bodies.size());
  tables.tets_round_node.resize(std::size_t(world.nodes));
  for (const bool moving : {true, false})  // in the order of the world's tets
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
      if (world.bodies[b].moving != moving) continue;
      append(world.bodies[b], offset_m, world.topology, tables, tables.bodies[b]);
      if (world.bodies[b].self_contact) append_tets_round_nodes(world.bodies[b], tables);
    }
  tables.first_sample.push_back(int(tables.samples.size()));
  const std::size_t bodies = world.bodies.size();
  tables.wall_slack = 0.05 * offset_m;
  tables.offset.assign(bodies * bodies, offset_m);
  world.surfaces = single_precision(tables);
}

}  // namespace limber::fem::detail
