// [[bodies]]: role, cage, material, parts, pose and look of each, and which of them is the robot.
//
// What a table may lack depends on the role: scenery has neither cage nor material, a rigid obstacle needs no
// material, since it never deforms and is not moved by forces. Bodies are checked against the bounds here as
// far as their size is known without their mesh; cages that reach out are found when the world is built.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/words.h"
#include "scenes/detail/scene_parts.h"
#include "scenes/detail/schema.h"
#include "scenes/detail/typed_reads.h"
#include "scenes/models.h"

namespace limber::scenes {

namespace {

// Five tets a cell: 40,000 cells are the 200,000 tets that cage.tets may have at most.
void check_cell_size(const Node& node, double cell_m, const Model& model, const std::string& body) {
  const auto* blocks = std::get_if<BlocksModel>(&model);
  if (!blocks)
    complain(node, fmt::format("{}.cage.cell_m goes with model.blocks only; write tets = N instead", body));
  double cells = 0;
  for (const Box& solid : blocks->solids) cells += (solid.size() / cell_m).array().ceil().prod();
  if (const double most = 40'000; cells > most)
    complain(node,
             fmt::format("{}.cage.cell_m makes {:.0f} cells; write a larger one, for at most {:.0f} cells",
                         body, cells, most));
}

CageSpec read_cage(const Node& table, const Model& model, const std::string& body) {
  CageSpec cage;
  cage.mode = text(table, "mode");
  cage.shells = integer(table, "shells");
  const Node *cells = table.find("cells"), *cell_m = table.find("cell_m"), *tets = table.find("tets");
  if ((cells != nullptr) + (cell_m != nullptr) + (tets != nullptr) != 1)
    complain(table, fmt::format("{}.cage has {} of tets, cells and cell_m; give exactly one, as tets = 300",
                                body, cells || cell_m || tets ? "more than one" : "none"));
  if (tets) {
    cage.tets = integer(table, "tets");
    return cage;
  }
  if (cage.mode != "lattice")
    complain(*table.find("mode"),
             fmt::format("{}.cage.mode is how a cage of so many tets is made, and this one is made of cells; "
                         "leave mode out, or write tets = 300 instead of {}",
                         body, cells ? "cells" : "cell_m"));
  if (cell_m) {
    cage.cell_m = number(table, "cell_m");
    check_cell_size(*cell_m, cage.cell_m, model, body);
    return cage;
  }
  const auto* plate = std::get_if<PlateModel>(&model);
  const auto* tube = std::get_if<TubeModel>(&model);
  if (!tube && !std::holds_alternative<BoxModel>(model) && !(plate && !plate->hole))
    complain(
        *cells,
        fmt::format("{}.cage.cells needs a box, a tube, or a plate without a hole; write tets = N instead",
                    body));
  cage.cells = as_vector(*cells).cast<int>();
  if (tube && tube->wall_m > 0 && (cage.cells[0] % 2 == 1 || cage.cells[0] < 6))
    complain(*cells,
             fmt::format("{}.cage.cells has {} cells round the tube; write an even number, 6 at least", body,
                         cage.cells[0]));
  if (tube && tube->wall_m == 0 && cage.cells[0] != cage.cells[1])
    complain(*cells, fmt::format("{}.cage.cells has {} and {} cells across the rod; write one number twice",
                                 body, cage.cells[0], cage.cells[1]));
  if (tube && is_closed(tube->path_m) && (cage.cells[2] % 2 == 1 || cage.cells[2] < 6))
    complain(*cells,
             fmt::format("{}.cage.cells has {} cells along the ring; write an even number, 6 at least", body,
                         cage.cells[2]));
  if (const int made = 5 * cage.cells.prod(), most = 200'000; made > most)
    complain(*cells,
             fmt::format("{}.cage.cells make {} tets; write fewer cells, at most {} tets", body, made, most));
  return cage;
}

MaterialSpec read_material(const Node& body_table, Kind kind, Role role, const std::string& body) {
  constexpr double any_modulus_pa = 1e6;
  const Node* table = body_table.find("material");
  if (!table && kind == Kind::deformable)
    complain(body_table, fmt::format("{} is deformable and lacks a material; add for example material = "
                                     "{{ youngs_modulus_pa = 5e3, density_kg_m3 = 100 }}",
                                     body));
  if (!table && role != Role::obstacle)
    complain(body_table, fmt::format("{} is rigid, moves and lacks a material; add for example material = "
                                     "{{ density_kg_m3 = 100 }}",
                                     body));
  if (table && kind == Kind::deformable && !table->find("youngs_modulus_pa"))
    complain(*table,
             fmt::format(
                 "{}.material lacks \"youngs_modulus_pa\" (Pa; stiffness); add for example youngs_modulus_pa "
                 "= 5e3",
                 body));
  if (!table) {  // it never deforms: any sound material does
    const Key& friction = *find_key("bodies[].material.friction");
    return {"springs", any_modulus_pa, 0.45,
            1000,      0.05,           as_number(parse_set_value(std::string(friction.fallback), "")),
            0};
  }
  return {text(*table, "model"),
          maybe_number(*table, "youngs_modulus_pa").value_or(any_modulus_pa),
          number(*table, "poisson_ratio"),
          number(*table, "density_kg_m3"),
          number(*table, "damping_ratio"),
          number(*table, "friction"),
          number(*table, "mass_damping_per_s"),
          number(*table, "fascia_hz"),
          number(*table, "fascia_damping_ratio"),
          flag(*table, "mesh_independent")};
}

std::vector<PartSpec> read_parts(const Array& tables, const BodySpec& body, const std::string& body_name) {
  std::vector<PartSpec> parts;
  for (const Node& table : tables) {
    const std::string what = fmt::format("{}.parts[{}]", body_name, parts.size());
    PartSpec part;
    const Node *shell = table.find("shell"), *region = table.find("box_m");
    if ((shell != nullptr) == (region != nullptr))
      complain(table, fmt::format("{} has {}; give either shell = N or box_m = [[x, y, z], [x, y, z]]", what,
                                  shell ? "both shell and box_m" : "neither shell nor box_m"));
    if (shell) part.shell = int(as_number(*shell));
    if (region) part.box_m = box(table, "box_m");
    part.youngs_modulus_pa = maybe_number(table, "youngs_modulus_pa");
    part.density_kg_m3 = maybe_number(table, "density_kg_m3");
    if (!part.youngs_modulus_pa && !part.density_kg_m3)
      complain(table, fmt::format("{} changes nothing; give youngs_modulus_pa or density_kg_m3", what));
    if (part.youngs_modulus_pa && body.kind == Kind::rigid)
      complain(child(table, "youngs_modulus_pa"),
               fmt::format("{}.youngs_modulus_pa is of no use: {} is rigid; remove it", what, body_name));
    part.where = table.where.text();
    parts.push_back(std::move(part));
  }
  return parts;
}

FixedSpec read_fixed(const Node& node) {
  FixedSpec fixed;
  const auto* elements = node.array();
  if (!elements)
    fixed.walls = true;
  else
    for (const Node& element : *elements)
      if (element.table())
        fixed.boxes_m.push_back(box(element, "box_m"));
      else
        fixed.walls = true;
  return fixed;
}

Role read_role(const std::string& word) {
  return word == "robot"      ? Role::robot
         : word == "obstacle" ? Role::obstacle
         : word == "free"     ? Role::free
                              : Role::scenery;
}

Vec3 read_body_color(const Node& table, Role role) {
  const char* usual[] = {"#c0392b", "#3f7cac", "#e0a030", "#c8ccd0"};
  return as_color(text_or(table, "color", usual[int(role)]));
}

// As far as is known without its model's file.
void check_inside(const BodySpec& body, const Box& bounds, const Node& position, const std::string& what) {
  const Box occupied = surely_occupied(body);
  const double tolerance_m = 1e-9 * bounds.diagonal();
  for (int i = 0; i < 3; ++i) {
    const bool below = occupied.lower[i] < bounds.lower[i] - tolerance_m;
    if (!below && occupied.upper[i] <= bounds.upper[i] + tolerance_m) continue;
    complain(position, fmt::format("{} is outside the bounds: it reaches {} = {:.6g}, they end at {:.6g}; "
                                   "move it or enlarge world.bounds_m",
                                   what, "xyz"[i], below ? occupied.lower[i] : occupied.upper[i],
                                   below ? bounds.lower[i] : bounds.upper[i]));
  }
}

BodyLook read_look(const std::string& word) {
  return named<BodyLook>(word, {{"plain", BodyLook::plain},
                                {"rubber", BodyLook::rubber},
                                {"tissue", BodyLook::tissue},
                                {"bone", BodyLook::bone},
                                {"fabric", BodyLook::fabric},
                                {"skin", BodyLook::skin}});
}

// Where the scene does not say.
double roughness_of(BodyLook look) {
  switch (look) {
    case BodyLook::plain:
      return 0.45;
    case BodyLook::rubber:
      return 0.5;
    case BodyLook::tissue:
      return 0.32;
    case BodyLook::bone:
      return 0.65;
    case BodyLook::fabric:
      return 0.9;
    case BodyLook::skin:
      return 0.55;
  }
  LIMBER_CHECK(false, int(look));
}

BodySpec read_body(const Node& table, const Box& bounds) {
  BodySpec body;
  body.name = text(table, "name");
  const std::string what = "bodies." + body.name;
  body.role = read_role(text(table, "role"));
  body.kind = text(table, "kind") == "rigid" ? Kind::rigid : Kind::deformable;
  if (table.find("contact"))
    body.contact = text(table, "contact") == "cage" ? Contact::cage : Contact::surface;
  if (table.find("self_contact")) body.self_contact = flag(table, "self_contact");
  const bool bends =
      table.find("deformation") ? text(table, "deformation") == "phong" : body.kind == Kind::deformable;
  body.deformation = bends ? Deformation::phong : Deformation::linear;
  body.max_volume_change = number(table, "max_volume_change");
  body.max_stretch = maybe_number(table, "max_stretch");
  body.max_contact_load_n = maybe_number(table, "max_contact_load_n");
  body.model = read_model(child(table, "model"), what);
  body.color_srgb = read_body_color(table, body.role);
  body.texture = table.find("texture") ? flag(table, "texture") : !table.find("color");
  body.opacity = number(table, "opacity");
  body.look = table.find("look")                                            ? read_look(text(table, "look"))
              : body.kind == Kind::deformable && body.role != Role::scenery ? BodyLook::rubber
                                                                            : BodyLook::plain;
  body.roughness = maybe_number(table, "roughness").value_or(roughness_of(body.look));
  body.metallic = number(table, "metallic");
  const Node& pose = child(table, "pose");
  body.pose = {vector(pose, "position_m"), direction(pose, "axis", (what + ".pose.axis").c_str()),
               number(pose, "angle_deg"), text(pose, "anchor")};
  body.where = child(pose, "position_m").where.text();
  if (const Node* triangles = table.find("triangles")) {
    body.triangles = integer(table, "triangles");
    if (body.role != Role::scenery)
      complain(
          *triangles,
          fmt::format("{} is not scenery, so its surface is kept vertex by vertex; remove triangles", what));
  }
  body.velocity_m_s = vector(table, "velocity_m_s");
  body.angular_velocity_rad_s = vector(table, "angular_velocity_rad_s");
  const bool stands = body.role == Role::scenery || (body.role == Role::obstacle && body.kind == Kind::rigid);
  if (table.find("gravity_m_s2")) body.gravity_m_s2 = vector(table, "gravity_m_s2");
  for (const char* key : {"velocity_m_s", "angular_velocity_rad_s", "gravity_m_s2"})
    if (stands && table.find(key) && !vector(table, key).isZero(0))
      complain(child(table, key),
               fmt::format(
                   "{} cannot be pushed, and has no {}; {}", what, key,
                   body.role == Role::scenery ? "remove it" : "write [[motions]] for it, or another role"));
  if (body.role == Role::scenery) {
    for (const char* key : {"cage", "material"})
      if (const Node* node = table.find(key))
        complain(*node,
                 fmt::format("{} is scenery, which has no {}; remove it, or choose another role", what, key));
    return body;
  }
  if (!table.find("cage"))
    complain(table, fmt::format("{} lacks a cage; add for example cage = {{ tets = 300 }}", what));
  body.cage = read_cage(child(table, "cage"), body.model, what);
  body.material = read_material(table, body.kind, body.role, what);
  body.parts = read_parts(list(table, "parts"), body, what);
  const auto of_a_shell = [](const PartSpec& part) { return part.shell.has_value(); };
  constexpr int usual_shells = 32, tets_a_shell = 75;  // what a cage can show of a shell
  if (body.cage.shells == 0 && body.cage.mode == "paper" && body.cage.tets > 0)
    body.cage.shells = std::clamp(body.cage.tets / tets_a_shell, 1, usual_shells);
  else if (body.cage.shells == 0 && std::any_of(body.parts.begin(), body.parts.end(), of_a_shell))
    body.cage.shells = usual_shells;
  body.fixed = read_fixed(child(table, "fixed"));
  if (body.kind == Kind::rigid && body.role != Role::obstacle &&
      (body.fixed.walls || !body.fixed.boxes_m.empty()))
    complain(child(table, "fixed"),
             fmt::format(
                 "{} is rigid and moves, so no node of it can be fixed; remove fixed, or make it deformable, "
                 "or role = \"obstacle\"",
                 what));
  check_inside(body, bounds, child(pose, "position_m"), what);
  return body;
}

// Names differ in more than capitals, for each names a folder, and some disks do not tell capitals apart.
void add_body(BodySpec body, const Node& table, Scene& scene) {
  for (const auto* bodies : {&scene.bodies, &scene.scenery})
    for (const BodySpec& other : *bodies)
      if (same_but_for_case(other.name, body.name))
        complain(child(table, "name"),
                 other.name == body.name
                     ? fmt::format("two bodies are called \"{}\"; give each its own name", body.name)
                     : fmt::format("bodies are called \"{}\" and \"{}\", which is one folder on some disks; "
                                   "give them names that differ in more than capitals",
                                   other.name, body.name));
  if (body.role == Role::scenery) {
    scene.scenery.push_back(std::move(body));
    return;
  }
  if (body.role == Role::robot) {
    if (scene.robot >= 0)
      complain(child(table, "role"),
               fmt::format("two robots, {} and {}; exactly one body may have role = \"robot\"",
                           scene.bodies[std::size_t(scene.robot)].name, body.name));
    scene.robot = int(scene.bodies.size());
  }
  scene.bodies.push_back(std::move(body));
}

}  // namespace

bool is_rigid_obstacle(const BodySpec& body) {
  return body.role == Role::obstacle && body.kind == Kind::rigid;
}

// Exactly one robot where there is a goal. Of a scene that is only simulated the first body that can be
// pushed takes its place: shares of "the robot's size" are of its.
void read_bodies(const Node& root, Scene& scene, const Complaints& complaints) {
  bool robot = false;  // also one that is complained of
  for (const Node& table : list(root, "bodies")) {
    robot |= read_role(text(table, "role")) == Role::robot;
    complaints.during([&] { add_body(read_body(table, scene.bounds_m), table, scene); });
  }
  if (robot) return;
  if (root.find("goal"))
    complaints.during([&] {
      complain(child(root, "bodies"), "there is no robot; give the body that is to move role = \"robot\"");
    });
  const auto first = std::find_if_not(scene.bodies.begin(), scene.bodies.end(), is_rigid_obstacle);
  if (first != scene.bodies.end())
    scene.robot = int(first - scene.bodies.begin());
  else
    complaints.during([&] {
      complain(child(root, "bodies"),
               "no body can be pushed, so nothing happens; add one that is soft, or role = \"free\"");
    });
}

int body_called(const Node& node, const Scene& scene, const std::string& key) {
  std::vector<std::string> names;
  for (const BodySpec& body : scene.bodies) names.push_back(body.name);
  const auto at = std::find(names.begin(), names.end(), as_text(node));
  if (at == names.end())
    complain(node, fmt::format("{} is \"{}\"; it must be a body that is not scenery: {}", key, as_text(node),
                               fmt::join(names, ", ")));
  return int(at - names.begin());
}

int other_body(const Node& node, const Scene& scene, const std::string& key) {
  std::vector<std::string> others;
  for (int b = 0; b < int(scene.bodies.size()); ++b) {
    const std::string& name = scene.bodies[std::size_t(b)].name;
    if (b != scene.robot && name == as_text(node)) return b;
    if (b != scene.robot) others.push_back(name);
  }
  complain(node, fmt::format("{} is \"{}\"; it must be a body other than the robot{}{}", key, as_text(node),
                             others.empty() ? ", and there is none" : ": ", fmt::join(others, ", ")));
}

}  // namespace limber::scenes
