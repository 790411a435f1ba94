// From a scene and its prepared bodies to the world that is stepped: what the scene says of each body is
// handed to fem, which makes springs, masses and time step of it.
//
// What is wrong only now, when the cages are known (a box that holds no node, a shell that is not there,
// bodies that overlap), is told with the place in the scene's text, as the reader's complaints are.
#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/stiffness_share.h"
#include "limber/detail/world/body_source.h"
#include "limber/detail/world/kept_share.h"
#include "limber/detail/world/scene_world.h"
#include "limber/detail/world/seen.h"
#include "meshing/contact_shape.h"
#include "meshing/convex_hull.h"
#include "scenes/models.h"

namespace limber::detail {

namespace {

// Surfaces that near push each other, as a share of the robot's size; a field is off by less than that nearly
// everywhere.
constexpr double usual_contact_offset = 0.005;

fem::BodyKind kind_of(const scenes::BodySpec& body) {
  if (body.kind == scenes::Kind::deformable) return fem::BodyKind::deformable;
  return body.role == scenes::Role::obstacle ? fem::BodyKind::immovable : fem::BodyKind::rigid;
}

// [[forces]], [[pressures]] and [[motions]] (docs/simulation.md). A body that has a motion is kinematic: it
// goes its way and is not pushed. A force on a box of nodes must reach one that is not held.
void set_script(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared, fem::WorldSpec& spec) {
  for (const scenes::MotionSpec& motion : scene.motions) {
    fem::BodySpec& body = spec.bodies[std::size_t(motion.body)];
    body.kind = fem::BodyKind::kinematic;
    body.track.pivot_m = scene.bodies[std::size_t(motion.body)].pose.position_m;
    for (const scenes::MotionSpec::Keyframe& k : motion.keyframes)
      body.track.keyframes.push_back({k.at_s, k.position_m, k.angle_deg * std::numbers::pi / 180 * k.axis});
  }
  for (const scenes::PressureSpec& pressure : scene.pressures)
    spec.pressures.push_back({pressure.body, pressure.from_s, pressure.to_s, pressure.pressure_pa});
  for (const scenes::ForceSpec& force : scene.forces) {
    fem::ForceSpec& made =
        spec.forces.emplace_back(fem::ForceSpec{force.body, force.from_s, force.to_s, force.force_n});
    if (!force.box_m) continue;
    const std::string& name = scene.bodies[std::size_t(force.body)].name;
    made.nodes =
        scenes::nodes_in(*force.box_m, scene.bounds_m, prepared[std::size_t(force.body)].cage.positions);
    if (made.nodes.empty())
      throw InputError(
          fmt::format("{}: no node of the cage of {} is in the box of this force; enlarge or move it",
                      force.where, name));
    const std::vector<int>& held = spec.bodies[std::size_t(force.body)].fixed_nodes;
    if (std::includes(held.begin(), held.end(), made.nodes.begin(), made.nodes.end()))
      throw InputError(
          fmt::format("{}: all nodes of {} in the box of this force are held, so it moves nothing; "
                      "move the box, or hold fewer",
                      force.where, name));
  }
}

void set_ligaments(const scenes::Scene& scene, fem::WorldSpec& spec) {
  for (const scenes::LigamentSpec& ligament : scene.ligaments)
    spec.ligaments.push_back({.name = ligament.name,
                              .ends = {{{ligament.from, ligament.from_m, ligament.radius_m},
                                        {ligament.to, ligament.to_m, ligament.radius_m}}},
                              .stiffness_n_m = ligament.stiffness_n_m,
                              .damping_ratio = ligament.damping_ratio,
                              .rest_length = ligament.rest_length,
                              .pushes = ligament.pushes});
}

// What the parts of a body say, tet by tet: of a convex shell, or of a box at the start, by the middle of the
// tet. Later parts rule.
void set_parts(const scenes::BodySpec& body, const PreparedBody& prepared, double share, fem::BodySpec& out) {
  if (body.parts.empty()) return;
  const Tets& tets = prepared.cage.tets;
  const int shells = prepared.report.shells ? prepared.report.shells->count : 0;
  out.youngs_modulus_from_tet_pa.assign(std::size_t(tets.rows()), body.material.youngs_modulus_pa);
  out.density_from_tet_kg_m3.assign(std::size_t(tets.rows()), out.material.density_kg_m3);
  for (const scenes::PartSpec& part : body.parts) {
    if (part.shell && *part.shell >= shells)
      throw InputError(
          fmt::format("{}: bodies.{}.parts: there is no shell {}; the body has {}, numbered from 0 (limber "
                      "info on its folder "
                      "shows them)",
                      part.where, body.name, *part.shell, shells));
    int chosen = 0;
    for (int t = 0; t < tets.rows(); ++t) {
      Vec3 middle = Vec3::Zero();
      for (int i = 0; i < 4; ++i) middle += prepared.cage.positions.row(tets(t, i)).transpose() / 4;
      const bool in_box = (middle.array() >= part.box_m.lower.array()).all() &&
                          (middle.array() <= part.box_m.upper.array()).all();
      if (part.shell ? prepared.shell_from_tet[std::size_t(t)] != *part.shell : !in_box) continue;
      ++chosen;
      if (part.youngs_modulus_pa) out.youngs_modulus_from_tet_pa[std::size_t(t)] = *part.youngs_modulus_pa;
      if (part.density_kg_m3) out.density_from_tet_kg_m3[std::size_t(t)] = share * *part.density_kg_m3;
    }
    if (chosen == 0)
      throw InputError(
          fmt::format("{}: bodies.{}.parts: {}; {}", part.where, body.name,
                      part.shell ? fmt::format("no tet of the cage has its middle in shell {}", *part.shell)
                                 : std::string("no tet of the cage has its middle in that box"),
                      part.shell ? "ask for more tets, fewer shells, or give a box_m"
                                 : "enlarge or move it, or ask for more tets"));
  }
}

// The rest shape, stretched along x, y and z and then turned: x ↦ R S x. Or the cage of a file, node by node.
Points goal_shape(const scenes::Scene& scene, const PreparedBody& robot) {
  const scenes::Goal::Shape& shape = *scene.goal.shape;
  const Points& rest = robot.cage.positions;
  if (has_goal_cage(scene)) {
    if (robot.goal_shape_m.rows() != rest.rows())
      throw InputError(
          fmt::format("{}: goal.shape.cage has {} nodes, the robot's cage {}; deform the cage.msh of its "
                      "folder in bodies/",
                      shape.cage, robot.goal_shape_m.rows(), rest.rows()));
    return robot.goal_shape_m;
  }
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(shape.angle_deg * std::numbers::pi / 180, shape.axis).toRotationMatrix();
  return rest * (turn * shape.stretch.asDiagonal()).transpose();
}

// ---- contact ----

// Of a body that is touched at its cage among others that are not: the cage is its surface.
ContactShape shape_of_cage(const TetMesh& cage) {
  return meshing::make_contact_shape({cage.positions, boundary_triangles(cage.tets)}, cage);
}

double hull_volume(const Points& positions) {
  const ConvexShell hull = meshing::convex_hull(positions);
  return volume(SurfaceMesh{hull.vertices, hull.triangles});
}

// The farthest along evenly many directions.
Points some_extreme_points(const Points& positions) {
  constexpr int along_an_edge = 6;  // of a cube, through whose surface the directions go
  std::set<Eigen::Index> rows;
  for (int i = -along_an_edge; i <= along_an_edge; ++i)
    for (int j = -along_an_edge; j <= along_an_edge; ++j)
      for (int axis = 0; axis < 3; ++axis) {
        Vec3 direction;
        direction[axis] = along_an_edge, direction[(axis + 1) % 3] = i, direction[(axis + 2) % 3] = j;
        const Eigen::VectorXd heights = positions * direction;
        Eigen::Index least, most;
        heights.minCoeff(&least), heights.maxCoeff(&most);
        rows.insert({least, most});
      }
  return positions(std::vector<Eigen::Index>(rows.begin(), rows.end()), Eigen::all);
}

// Whether parts of a surface can meet without folding it flat: it is far from convex. The hull of some points
// is within that of all, and says so at once of most models.
bool can_reach_itself(const PreparedBody& body) {
  constexpr double convex = 0.9;  // of its hull
  const double filled = std::abs(volume(body.surface));
  return filled < convex * hull_volume(some_extreme_points(body.surface.positions)) ||
         filled < convex * hull_volume(body.surface.positions);
}

// Contact at the fine surfaces, unless all bodies are touched at their cages: then shapes are left out, and
// fem goes by the cages (docs/contact.md).
void set_contact(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared,
                 fem::WorldSpec& spec) {
  const bool all_cages = all_touched_at_cages(scene);
  for (std::size_t b = 0; b < prepared.size(); ++b) {
    throw_if_stopped();
    const scenes::BodySpec& body = scene.bodies[b];
    const bool on_surface = body.contact == scenes::Contact::surface && prepared[b].contact.usable;
    spec.bodies[b].phong = !all_cages && body.deformation == scenes::Deformation::phong;
    if (!all_cages)
      spec.bodies[b].shape = std::make_shared<const ContactShape>(
          on_surface ? prepared[b].contact : shape_of_cage(prepared[b].cage));
    spec.bodies[b].self_contact =
        body.self_contact ? *body.self_contact : on_surface && can_reach_itself(prepared[b]);
  }
  const Box robot = bounding_box(prepared[std::size_t(scene.robot)].surface.positions);
  spec.contact_offset_m = contact_offset_m(scene, robot);
  // What is promised of what is seen, less what fields may be off by.
  if (!all_cages)
    spec.max_overlap_m =
        (SeenLimits{}.overlap - meshing::ContactShapeSettings{}.field_error) * robot.size().maxCoeff();
}

}  // namespace

namespace {

void require_patches(const scenes::Scene& scene, const PreparedBody& robot) {
  const std::vector<int> held =
      scenes::fixed_nodes(scene.bodies[std::size_t(scene.robot)], scene.bounds_m, robot.cage.positions);
  for (std::size_t i = 0; i < scene.planner.patches_m.size(); ++i) {
    const std::vector<int> nodes =
        scenes::nodes_in(scene.planner.patches_m[i], scene.bounds_m, robot.cage.positions);
    if (std::includes(held.begin(), held.end(), nodes.begin(), nodes.end()))  // none are, too
      throw InputError(
          fmt::format("{}: planner.patches_m[{}] holds no node of the robot's cage that can be pushed; "
                      "enlarge or move it",
                      scene.planner.patches_where, i));
  }
}

}  // namespace

GoalRules goal_rules_of(const scenes::Scene& scene) {
  const auto rules_of = [](const scenes::Goal& goal) {
    GoalRules rules;
    rules.body = goal.moves_with, rules.lost_below_m = goal.lost_below_m;
    if (goal.shape)
      rules.turn_tolerance_deg = goal.shape->turn_tolerance_deg,
      rules.shape_tolerance_m = goal.shape->tolerance_m, rules.half_turn = goal.shape->half_turn;
    rules.above = goal.above, rules.below = goal.below, rules.clear_of = goal.clear_of;
    rules.through = goal.through, rules.volume = goal.volume;
    return rules;
  };
  GoalRules rules = rules_of(scene.goal);
  for (const scenes::Via& via : scene.via) rules.via.push_back(rules_of(via.goal));
  rules.patches_m = scene.planner.patches_m, rules.lead = scene.planner.lead;
  rules.carry = scene.planner.carry;
  return rules;
}

double contact_offset_m(const scenes::Scene& scene, const Box& robot) {
  return scene.contact_offset_m.value_or(usual_contact_offset * robot.size().maxCoeff());
}

bool all_touched_at_cages(const scenes::Scene& scene) {
  return std::all_of(scene.bodies.begin(), scene.bodies.end(),
                     [](const scenes::BodySpec& body) { return body.contact == scenes::Contact::cage; });
}

std::map<std::string, double> stiffness_shares_of(const fem::World& world) {
  std::map<std::string, double> shares;
  for (const fem::Body& body : world.bodies)
    if (body.moving && body.kind == fem::BodyKind::deformable) shares[body.name] = body.stiffness_share;
  return shares;
}

namespace {

// But for its script and its contact.
fem::BodySpec spec_of_body(const scenes::Scene& scene, const scenes::BodySpec& body,
                           const PreparedBody& prepared) {
  fem::BodySpec fem_body;
  fem_body.name = body.name;
  fem_body.cage = prepared.cage;
  // The cage weighs what the model does, as far as that has an inside: densities are of the model, and the
  // cage is larger, so its own density is lower by the ratio of the volumes.
  const double share = filled_share(prepared);
  fem_body.material = {.model = body.material.model == "springs" ? fem::MaterialModel::springs
                                                                 : fem::MaterialModel::neo_hookean,
                       .youngs_modulus_pa = body.material.youngs_modulus_pa,
                       .poisson_ratio = body.material.poisson_ratio,
                       .density_kg_m3 = share * body.material.density_kg_m3,
                       .damping_ratio = body.material.damping_ratio,
                       .mass_damping_per_s = body.material.mass_damping_per_s,
                       .fascia_hz = body.material.fascia_hz,
                       .fascia_damping_ratio = body.material.fascia_damping_ratio,
                       .friction = body.material.friction,
                       .mesh_independent = body.material.mesh_independent};
  fem_body.fixed_nodes = scenes::fixed_nodes(body, scene.bounds_m, prepared.cage.positions);
  fem_body.kind = kind_of(body);
  fem_body.velocity_m_s = body.velocity_m_s, fem_body.angular_velocity_rad_s = body.angular_velocity_rad_s;
  fem_body.gravity_m_s2 = body.gravity_m_s2;
  fem_body.max_volume_change = body.max_volume_change;
  if (body.max_contact_load_n) fem_body.max_contact_load_n = *body.max_contact_load_n;
  if (body.max_stretch && *body.max_stretch < scenes::any_stretch) fem_body.max_stretch = *body.max_stretch;
  set_parts(body, prepared, share, fem_body);
  return fem_body;
}

fem::WorldSpec spec_of_world(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared) {
  fem::WorldSpec spec;
  for (std::size_t b = 0; b < prepared.size(); ++b)
    spec.bodies.push_back(spec_of_body(scene, scene.bodies[b], prepared[b]));
  set_script(scene, prepared, spec);
  set_ligaments(scene, spec);
  require_patches(scene, prepared[std::size_t(scene.robot)]);
  set_contact(scene, prepared, spec);
  spec.robot = scene.robot;
  spec.bounds_m = scene.bounds_m;
  spec.walls = scene.walls;
  spec.gravity_m_s2 = scene.gravity_m_s2;
  spec.rest_speed_m_s = scene.rest_speed_m_s;
  if (scene.goal.shape) spec.goal_shape_m = goal_shape(scene, prepared[std::size_t(scene.robot)]);
  spec.max_dt_s = scene.max_dt_s.value_or(0);
  spec.part_overlaps = scene.part_overlaps;
  return spec;
}

// As its files have it: what is found there is the same of bodies that are the same but for their place.
fem::BodySpec in_own_frame(fem::BodySpec spec, const PreparedBody& prepared) {
  if (prepared.own_cage_m.rows() > 0) spec.cage.positions = prepared.own_cage_m;
  return spec;
}

// Of bodies whose share is not known yet; once for all that are the same.
void find_stiffness_shares(const std::vector<PreparedBody>& prepared, fem::WorldSpec& spec) {
  std::map<std::string, std::vector<std::size_t>> same;
  for (std::size_t b = 0; b < prepared.size(); ++b)
    if (spec.bodies[b].stiffness_share == 0 && has_stiffness_share(spec.bodies[b]))
      same[stiffness_key_of(in_own_frame(spec.bodies[b], prepared[b]))].push_back(b);
  std::vector<std::vector<std::size_t>> groups;
  for (auto& [key, bodies] : same) groups.push_back(std::move(bodies));
  parallel_for(int(groups.size()), [&](int g) {
    throw_if_stopped();
    const std::vector<std::size_t>& bodies = groups[std::size_t(g)];
    const double share = fem::stiffness_share_of(in_own_frame(spec.bodies[bodies[0]], prepared[bodies[0]]));
    for (const std::size_t b : bodies) spec.bodies[b].stiffness_share = share;
  });
}

// Complaints of fem name a body, not its place in the text.
fem::World build_world_of(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared,
                          fem::WorldSpec& spec) {
  try {
    find_stiffness_shares(prepared, spec);
    return fem::build_world(spec);
  } catch (const InputError& error) {
    for (const scenes::LigamentSpec& ligament : scene.ligaments)
      if (std::string_view(error.what()).starts_with(fmt::format("ligament {}:", ligament.name)))
        throw InputError(fmt::format("{}: {}", ligament.where, error.what()));
    for (const scenes::BodySpec& body : scene.bodies)  // the first that is named has the place
      if (fmt::format(" {} ", error.what()).find(fmt::format(" {} ", body.name)) != std::string::npos ||
          std::string_view(error.what()).find(fmt::format("body {}:", body.name)) != std::string_view::npos)
        throw InputError(fmt::format("{}: {}", body.where, error.what()));
    throw InputError(fmt::format("scene {}: {}", scene.name, error.what()));
  }
}

}  // namespace

fem::World build_world(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared,
                       const std::vector<float>& start_positions,
                       const std::map<std::string, double>& stiffness_shares) {
  fem::WorldSpec spec = spec_of_world(scene, prepared);
  for (fem::BodySpec& body : spec.bodies)
    if (const auto known = stiffness_shares.find(body.name); known != stiffness_shares.end())
      body.stiffness_share = known->second;
  spec.start_positions = start_positions;
  return build_world_of(scene, prepared, spec);
}

fem::World build_world_in(const fs::path& work_folder, const fs::path& store, const scenes::Scene& scene,
                          const std::vector<PreparedBody>& prepared,
                          const std::vector<float>& start_positions) {
  fem::WorldSpec spec = spec_of_world(scene, prepared);
  spec.start_positions = start_positions;
  std::vector<KeptShare> kept;
  for (std::size_t b = 0; b < spec.bodies.size(); ++b) {
    kept.emplace_back(body_folder(work_folder, scene.bodies[b]), in_own_frame(spec.bodies[b], prepared[b]),
                      store);
    spec.bodies[b].stiffness_share = kept[b].share();
  }
  fem::World world = build_world_of(scene, prepared, spec);
  for (std::size_t b = 0; b < kept.size(); ++b) kept[b].keep(world.bodies[b].stiffness_share);
  return world;
}

void keep_stiffness_shares(const scenes::Scene& scene, const std::vector<std::size_t>& bodies,
                           const fs::path& work_folder) {
  std::map<std::string, double> found;
  for (const std::size_t b : bodies) {
    const scenes::BodySpec& body = scene.bodies[b];
    const fs::path folder = body_folder(work_folder, body);
    if (std::any_of(scene.motions.begin(), scene.motions.end(),
                    [&](const scenes::MotionSpec& motion) { return std::size_t(motion.body) == b; }))
      continue;
    PreparedBody prepared = read_body(folder);
    place(prepared, body.pose.position_m);
    const fem::BodySpec spec = in_own_frame(spec_of_body(scene, body, prepared), prepared);
    KeptShare kept(folder, spec);
    if (!has_stiffness_share(spec) || kept.share() > 0) continue;
    const auto [share, is_new] = found.emplace(stiffness_key_of(spec), 0);
    if (is_new) share->second = fem::stiffness_share_of(spec);
    kept.keep(share->second);
  }
}

}  // namespace limber::detail
