// Builds a World from what was asked for. Its parts are made in detail/:
//
// - check_world.cpp: what is refused. make_body.cpp: the rest cage and masses of each body.
// - make_elements.cpp: from material to elements. make_topology.cpp: what contact knows of meshes.
// - make_tables.cpp: the arrays that steppers read. make_surface_tables.cpp: those of fine surfaces.
// - start.cpp: where bodies begin, and the parting of those that overlap there.
//
// This file has the order, the time step, and forces. States are in states.cpp. A World never changes once
// it is built, and threads share it. A spec has one World, bit for bit, however many threads build it.
//
// The step: kick-drift is stable up to 2 (√(1 + ζ²) − ζ)/ω of the fastest mode of each body
// (docs/dynamics.md, "Step"). A world takes a share of the smallest such limit. A scene may only lower it,
// and contact keeps its stiffness then. At a third of the limit 4 of 2,997 Neo-Hookean tets thrown about
// wildly were lost, at a quarter none.
#include "fem/world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "fem/detail/check_world.h"
#include "fem/detail/even_masses.h"
#include "fem/detail/ligaments.h"
#include "fem/detail/make_body.h"
#include "fem/detail/make_elements.h"
#include "fem/detail/make_stars.h"
#include "fem/detail/make_surface_tables.h"
#include "fem/detail/make_tables.h"
#include "fem/detail/make_topology.h"
#include "fem/detail/overlap.h"
#include "fem/detail/start.h"

namespace limber::fem {
namespace {

// Share of the largest stable elastic step that is taken: contact needs the rest (docs/contact.md).
// Neo-Hookean tets stiffen when stretched, and so need more.
constexpr double step_safety = 1.0 / 3, neo_hookean_step_safety = 0.25, fascia_step_safety = 0.25,
                 ligament_step_safety = 0.25;
// Of a world in which only rigid bodies move, and so no elastic step exists.
constexpr double rigid_step_s = 1e-3;
// Forces of contact are held for so many steps of the elastic forces at most.
constexpr int max_substeps = 8;

// The shape to which interpolation draws the robot, seen from its centre of mass; its rest shape if none is
// given.
Points goal_shape(const Body& robot, const Points& given) {
  if (given.rows() != 0 && given.rows() != robot.node_count())
    throw InputError(
        fmt::format("body {}: the goal shape has {} nodes, the robot {}; give the same cage, deformed",
                    robot.name, given.rows(), robot.node_count()));
  if (!given.allFinite())
    throw InputError(fmt::format("body {}: the goal shape has a node that is not finite", robot.name));
  Points shape = given.rows() ? given : robot.cage.positions;
  shape.rowwise() -= detail::center_of(robot, shape).transpose();
  return shape;
}

// The longest step of contact on fine surfaces. Of all bodies that are pushed the smallest counts, by the
// geometric mean of its size and of its thickness 6 V/A: thin bodies are passed soonest, long ones go
// fastest. Overlap grows with the square of the step (docs/contact-measured.md, "Substeps").
double longest_contact_step_s(const World& world) {
  constexpr double of_one_meter_s = 1.5e-3;
  double smallest_m = std::numeric_limits<double>::infinity();
  for (const Body& body : world.bodies) {
    if (!body.pushed()) continue;
    const double size_m = bounding_box(body.cage.positions).size().maxCoeff();
    const double thickness_m = 6 * body.rest_volume_m3 / area({body.cage.positions, body.surface});
    smallest_m = std::min(smallest_m, std::sqrt(size_m * std::min(size_m, thickness_m)));
  }
  return of_one_meter_s * std::sqrt(smallest_m);
}

// Sets the steps: of elastic forces as long as is stable; of contact on fine surfaces, which costs ten times
// as much, as many of those as are accurate, and of contact between cages one. Steps of elastic forces and
// contact_dt_s are float32 numbers exactly, so that float and double steppers step alike. A sliver among the
// tets sets the step of the whole world; the message names the body that has it.
void choose_step(double max_dt_s, World& world) {
  const auto step_of = [](const Body& body) {
    const bool springs = body.material.model == MaterialModel::springs;
    return (springs ? step_safety : neo_hookean_step_safety) * body.elastic_dt_limit_s;
  };
  const auto stiffest =
      std::min_element(world.bodies.begin(), world.bodies.end(),
                       [&](const Body& a, const Body& b) { return step_of(a) < step_of(b); });
  double step_s = std::isfinite(step_of(*stiffest)) ? step_of(*stiffest) : rigid_step_s;
  // x'' + 2 ζ ω x' + ω² x = 0, velocity first, is stable to h ω = 2 (√(1 + ζ²) − ζ).
  for (const Body& body : world.bodies)
    if (const double ratio = body.material.fascia_damping_ratio; body.material.fascia_hz > 0)
      step_s = std::min(step_s, fascia_step_safety * 2 * (std::hypot(1, ratio) - ratio) /
                                    (2 * std::numbers::pi * body.material.fascia_hz));
  step_s = float(std::min(step_s, ligament_step_safety * detail::largest_stable_step(world.ligaments)));
  const double allowed_s = max_dt_s > 0 ? double(float(max_dt_s)) : std::numeric_limits<double>::infinity();
  const double contact_s = world.bodies[0].shape ? std::min(longest_contact_step_s(world), allowed_s) : 0;
  const double substep_s = std::min(step_s, allowed_s);
  world.substeps = std::clamp(int(contact_s / substep_s), 1, max_substeps);
  world.dt_s = world.substeps * substep_s;
  world.contact_dt_s = float(world.substeps * step_s);
  if (!(substep_s >= 1e-7))
    throw InputError(fmt::format(
        "body {}: its stable time step is {:.2g} s, too short to be of use; soften it, or mesh it "
        "without slivers, and see that no ligament is too stiff for what hangs on it",
        stiffest->name, substep_s));
}

// A force in steps of the world and on the nodes that may move. Its mass is that of all nodes it is meant
// for, held ones too: each node gets F m/Σ m, and what would fall on held nodes is lost.
Force make_force(const ForceSpec& spec, const World& world) {
  const auto refuse = [](const std::string& why) { throw InputError(why); };
  if (spec.body < 0 || spec.body >= int(world.bodies.size()))
    refuse(fmt::format("a force acts on body {}, and there are {}", spec.body, world.bodies.size()));
  const Body& body = world.bodies[std::size_t(spec.body)];
  if (!body.pushed())
    refuse(fmt::format("body {}: a force acts on it, and none of its nodes can be pushed", body.name));
  if (!(spec.from_s >= 0 && spec.to_s > spec.from_s && spec.to_s / world.dt_s < 1e15))
    refuse(fmt::format("body {}: a force acts on it from {} to {} s, which is no time", body.name,
                       spec.from_s, spec.to_s));
  if (!spec.force_n.allFinite()) refuse(fmt::format("body {}: a force on it is not finite", body.name));
  Force force{spec.body,
              std::llround(spec.from_s / world.dt_s),
              std::llround(spec.to_s / world.dt_s),
              spec.force_n,
              {},
              body.mass_kg};
  std::vector<int> nodes = spec.nodes;
  if (nodes.empty()) {
    nodes.resize(std::size_t(body.node_count()));
    std::iota(nodes.begin(), nodes.end(), 0);
  } else {
    force.mass_kg = 0;
    for (const int n : nodes) force.mass_kg += body.node_mass_kg.at(std::size_t(n));
  }
  std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(force.nodes),
               [&](int n) { return !body.fixed[std::size_t(n)]; });
  if (force.nodes.empty())
    refuse(fmt::format("body {}: a force acts on nodes of it that are all held", body.name));
  return force;
}

Pressure make_pressure(const PressureSpec& spec, const World& world) {
  const auto refuse = [](const std::string& why) { throw InputError(why); };
  if (spec.body < 0 || spec.body >= int(world.bodies.size()))
    refuse(fmt::format("a pressure is in body {}, and there are {}", spec.body, world.bodies.size()));
  const Body& body = world.bodies[std::size_t(spec.body)];
  if (!body.pushed() || body.kind != BodyKind::deformable)
    refuse(fmt::format(
        "body {}: a pressure is in it, and nothing of it can be blown up: it is rigid, or all of it is held",
        body.name));
  if (!(spec.from_s >= 0 && spec.to_s > spec.from_s && spec.to_s / world.dt_s < 1e15))
    refuse(fmt::format("body {}: a pressure is in it from {} to {} s, which is no time", body.name,
                       spec.from_s, spec.to_s));
  if (!std::isfinite(spec.pressure_pa))
    refuse(fmt::format("body {}: a pressure in it is not finite", body.name));
  return {spec.body, std::llround(spec.from_s / world.dt_s), std::llround(spec.to_s / world.dt_s),
          spec.pressure_pa};
}

}  // namespace

// Moving bodies get the first nodes and tets, in the order given, then the others. Pairs of bodies rub with
// the geometric mean of their coefficients. The skin, a fifth of the mean edge, is how far lists of contact
// candidates reach.
World build_world(const WorldSpec& spec) {
  detail::check(spec);
  World world;
  world.robot = spec.robot;
  world.bounds_m = spec.bounds_m;
  world.walls = spec.walls;
  world.rest_speed_m_s = spec.rest_speed_m_s;
  world.part_overlaps = spec.part_overlaps;
  world.max_overlap_m = spec.max_overlap_m;
  for (const BodySpec& body : spec.bodies) {
    world.bodies.push_back(detail::make_body(body));
    world.bodies.back().gravity_m_s2 = body.gravity_m_s2.value_or(spec.gravity_m_s2);
  }
  if (!world.bodies[spec.robot].pushed())
    throw InputError(
        fmt::format("body {}: the robot has no node that can move", world.bodies[spec.robot].name));

  detail::find_stiffness_shares(world.bodies);
  // Between cages a longer step would make contact softer, and nothing stands against that.
  for (Body& body : world.bodies)
    if (body.shape) detail::even_masses(body);
  auto& tables = world.tables64;
  tables.elements.runs_of_body.resize(world.bodies.size());
  world.topology.bodies.resize(world.bodies.size());
  world.rigid_tables.resize(world.bodies.size());
  world.nodes = 0;
  int tets = 0;
  // Moving bodies first: State is the front of all nodes.
  for (const bool moving : {true, false}) {
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
      Body& body = world.bodies[b];
      if (body.moving != moving) continue;
      body.first_node = world.nodes, body.first_tet = tets;
      world.nodes += body.node_count(), tets += int(body.cage.tets.rows());
      detail::append_nodes(body, tables);
      detail::append_topology(body, int(b), world.topology);
      if (body.kind == BodyKind::rigid) world.rigid_tables[b] = detail::make_rigid(body);
      if (!moving || body.kind != BodyKind::deformable) continue;
      const detail::ElementLists elements = detail::make_elements(body);
      body.elastic_dt_limit_s = detail::largest_stable_step(body, elements);
      detail::append(elements, body.first_node, world.elements);
      detail::append_stars(elements, int(b), body.first_node, tables.elements);
    }
    if (moving) world.moving_nodes = world.nodes;
  }

  const Body& robot = world.bodies[world.robot];
  world.goal_shape_m = goal_shape(robot, spec.goal_shape_m);
  for (int n = 0; n < robot.node_count(); ++n)
    for (int c = 0; c < 3; ++c) tables.goal_from_center.push_back(world.goal_shape_m(n, c));
  for (const Body& a : world.bodies) {
    for (const Body& b : world.bodies)
      tables.pair_friction.push_back(std::sqrt(a.material.friction * b.material.friction));
    tables.skin.push_back(0.2 * detail::mean_edge(a));
  }
  world.tables = detail::single_precision(tables);
  for (const LigamentSpec& ligament : spec.ligaments)
    world.ligaments.push_back(detail::make_ligament(ligament, world));
  choose_step(spec.max_dt_s, world);
  for (const ForceSpec& force : spec.forces) world.forces.push_back(make_force(force, world));
  for (const PressureSpec& pressure : spec.pressures)
    world.pressures.push_back(make_pressure(pressure, world));
  detail::make_surface_tables(spec.contact_offset_m, world);
  detail::check_places(world);
  detail::set_start(spec, world);
  return world;
}

CageOverlap cage_overlap(const TetMesh& one, const TetMesh& two) {
  const Triangles surface_of_one = boundary_triangles(one.tets),
                  surface_of_two = boundary_triangles(two.tets);
  const auto overlap = detail::deepest_overlap({one.positions, one.tets, surface_of_one},
                                               {two.positions, two.tets, surface_of_two});
  return {overlap.depth_m, overlap.way_m};
}

}  // namespace limber::fem
