#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/words.h"
#include "scenes/detail/schema.h"
#include "scenes/models.h"
#include "scenes/problems.h"
#include "scenes/scene.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

[[noreturn]] void complain(const Node& node, const std::string& what) {
  throw InputError(fmt::format("{}: {}", node.where.text(), what));
}

// ---- typed reads; check_and_complete() has made sure that they succeed ----

const Node& child(const Node& table, std::string_view key) {
  const Node* node = table.find(key);
  LIMBER_CHECK(node, key);
  return *node;
}
double as_number(const Node& node) {
  const auto* integer = std::get_if<std::int64_t>(&node.value);
  return integer ? double(*integer) : std::get<double>(node.value);
}
double number(const Node& table, std::string_view key) { return as_number(child(table, key)); }
int integer(const Node& table, std::string_view key) { return int(number(table, key)); }
std::optional<double> maybe_number(const Node& table, std::string_view key) {
  const Node* node = table.find(key);
  return node ? std::optional(as_number(*node)) : std::nullopt;
}
bool flag(const Node& table, std::string_view key) { return std::get<bool>(child(table, key).value); }
const std::string& as_text(const Node& node) { return std::get<std::string>(node.value); }
const std::string& text(const Node& table, std::string_view key) { return as_text(child(table, key)); }
std::string text_or(const Node& table, std::string_view key, const char* otherwise) {
  const Node* node = table.find(key);
  return node ? as_text(*node) : otherwise;
}
const Array& list(const Node& table, std::string_view key) { return *child(table, key).array(); }
Vec3 as_vector(const Node& node) {
  const Array& a = *node.array();
  return {as_number(a[0]), as_number(a[1]), as_number(a[2])};
}
Vec3 vector(const Node& table, std::string_view key) { return as_vector(child(table, key)); }
Eigen::Vector2d vector2(const Node& table, std::string_view key) {
  const Array& a = list(table, key);
  return {as_number(a[0]), as_number(a[1])};
}
Box as_box(const Node& node) { return {as_vector((*node.array())[0]), as_vector((*node.array())[1])}; }
Box box(const Node& table, std::string_view key) { return as_box(child(table, key)); }
Vec3 as_color(const std::string& rrggbb) {
  const auto channel = [&](std::size_t at) { return std::stoi(rrggbb.substr(at, 2), nullptr, 16) / 255.0; };
  return {channel(1), channel(3), channel(5)};
}
Vec3 direction(const Node& table, std::string_view key, const char* what) {
  const Vec3 v = vector(table, key);
  if (v.norm() < 1e-9)
    complain(child(table, key),
             fmt::format("{} is [0, 0, 0], which points nowhere; write a direction", what));
  return v.normalized();
}

// ---- edits: --set a.b.c=value ----

std::vector<std::string> split_path(std::string_view path) {
  std::vector<std::string> parts;
  while (true) {
    const auto dot = path.find('.');
    parts.emplace_back(path.substr(0, dot));
    if (dot == path.npos) return parts;
    path.remove_prefix(dot + 1);
  }
}

// The tables between `table` (at `path`) and the one known key of that name further down, as material between
// a body and friction; empty when there is no such key, or more than one.
std::vector<std::string> tables_between(const Node& table, const std::string& path, const std::string& name) {
  const auto present = [&](const std::vector<std::string>& between) {
    const Node* node = &table;
    for (const std::string& part : between) node = node ? node->find(part) : nullptr;
    return node != nullptr;
  };
  std::vector<std::vector<std::string>> all, there;
  for (const Key& key : keys()) {
    const std::string_view parent = key.parent();
    if (key.name() != name || !parent.starts_with(path + ".")) continue;
    const std::string_view rest = parent.substr(path.size() + 1);
    if (rest.find("[]") != rest.npos) continue;
    all.push_back(split_path(rest));
    if (present(all.back())) there.push_back(all.back());
  }
  if (there.size() == 1) return there.front();
  return all.size() == 1 ? all.front() : std::vector<std::string>{};
}

Node& element_of(Node& array, const std::string& name, const std::string& source, const std::string& path) {
  auto& elements = std::get<Array>(array.value);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const Node* own = elements[i].find("name");
    const auto* own_name = own ? std::get_if<std::string>(&own->value) : nullptr;
    names.push_back(own_name ? *own_name : std::to_string(i));
    if (name == names.back() || name == std::to_string(i)) return elements[i];
  }
  const std::string meant = nearest(name, names);
  throw InputError(fmt::format("{}: {} has no \"{}\"; {}", source, path, name,
                               meant.empty() ? fmt::format("there are: {}", fmt::join(names, ", "))
                                             : fmt::format("did you mean \"{}\"?", meant)));
}

void edit(Node& root, const std::string& set) {
  constexpr std::size_t longest_shown = 200;
  const std::string source =
      "--set " + (set.size() > longest_shown ? set.substr(0, longest_shown) + "..." : set);
  const auto equals = set.find('=');
  if (equals == set.npos || equals == 0)
    throw InputError(
        fmt::format("{}: there is no key=value; write for example --set planner.seed=7", source));
  if (!is_utf8(set)) throw InputError(fmt::format("{}: is no UTF-8; write it so, as the scene is", source));
  std::vector<std::string> parts = split_path(std::string_view(set).substr(0, equals));
  if (constexpr std::size_t max_parts = 16; parts.size() > max_parts)
    throw InputError(
        fmt::format("{}: its key has {} parts, and none of a scene has more than five; see docs/scene.md",
                    source, parts.size()));
  Node* node = &root;
  std::string path;  // of the schema
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (std::holds_alternative<Array>(node->value)) {
      node = &element_of(*node, parts[i], source, path);
      path += "[]";
      continue;
    }
    auto* entries = std::get_if<Table>(&node->value);
    if (!entries)
      throw InputError(fmt::format("{}: {} is {}, so nothing in it can be set; set {} itself", source, path,
                                   node->type_name(), path));
    if (!find_key(path.empty() ? parts[i] : path + "." + parts[i])) {
      const auto between = tables_between(*node, path, parts[i]);
      if (!between.empty()) {
        parts.insert(parts.begin() + std::ptrdiff_t(i), between.begin(), between.end());
        --i;
        continue;
      }
    }
    path += (path.empty() ? "" : ".") + parts[i];
    if (!node->find(parts[i])) entries->push_back({parts[i], {source}, {{source}, Table{}}});
    node = node->find(parts[i]);
  }
  *node = parse_set_value(set.substr(equals + 1), source);
}

// What the other file holds, behind the scene's own.
void append(const ScriptText& script, Node& root) {
  if (script.text.empty()) return;
  Node more = parse_document(script.text, script.name_for_messages);
  for (Entry& entry : std::get<Table>(more.value)) {
    if (entry.key != "forces" && entry.key != "motions")
      throw InputError(
          fmt::format("{}: \"{}\" is not for this file; it holds [[forces]] and [[motions]], all "
                      "else stands in the scene",
                      entry.where.text(), entry.key));
    Node* const own = root.find(entry.key);
    if (!own) {
      std::get<Table>(root.value).push_back(std::move(entry));
      continue;
    }
    auto *to = std::get_if<Array>(&own->value), *from = std::get_if<Array>(&entry.value.value);
    if (!from)
      throw InputError(fmt::format("{}: {} must be a list of tables; write [[{}]]", entry.where.text(),
                                   entry.key, entry.key));
    if (to) std::move(from->begin(), from->end(), std::back_inserter(*to));
  }
}

// ---- the parts of a scene, with the checks that look at more than one key ----

double triangle_edge(const Node& table, const Vec3& size) {
  return maybe_number(table, "triangle_m").value_or(size.maxCoeff() / 32);
}

void check_fineness(const Node& table, const Vec3& size, double triangle_m) {
  constexpr double most = 4e6;
  const Vec3 n = (size / triangle_m).array().ceil();
  const double triangles = 4 * (n.x() * n.y() + n.y() * n.z() + n.z() * n.x());  // a few more with bevels
  if (triangles > most)
    complain(
        child(table, "triangle_m"),
        fmt::format("triangle_m = {} would make about {:.0f} triangles, more than {:.0f}; write a larger one",
                    triangle_m, triangles, most));
}

BoxModel read_box(const Node& table, const std::string& what) {
  BoxModel model{vector(table, "size_m"), number(table, "bevel_m"), 0};
  model.triangle_m = triangle_edge(table, model.size_m);
  check_fineness(table, model.size_m, model.triangle_m);
  if (const double most = model.size_m.minCoeff() / 2; model.bevel_m > most)
    complain(child(table, "bevel_m"),
             fmt::format("{}.bevel_m is {}, more than half the smallest size; it must be ≤ {}", what,
                         model.bevel_m, most));
  return model;
}

PlateModel read_plate(const Node& table, const std::string& what) {
  PlateModel model{read_box(table, what), {}};
  const Node* node = table.find("hole");
  if (!node) return model;
  const Hole hole{text(*node, "shape") == "round", number(*node, "size_m"), vector2(*node, "center_m")};
  const auto [u, v] = plate_plane(model.box.size_m);
  const double room = std::min(model.box.size_m[u] / 2 - std::abs(hole.center_m[0]),
                               model.box.size_m[v] / 2 - std::abs(hole.center_m[1])) -
                      2 * model.box.bevel_m;
  if (!(hole.size_m / 2 < room))
    complain(child(*node, "size_m"),
             fmt::format("{}.hole of {} m does not fit in the plate; it must be < {} there", what,
                         hole.size_m, std::max(0.0, 2 * room)));
  model.hole = hole;
  return model;
}

std::vector<Box> read_boxes(const Node& table, std::string_view key) {
  std::vector<Box> boxes;
  for (const Node& node : list(table, key)) boxes.push_back(as_box(node));
  return boxes;
}

BlocksModel read_blocks(const Node& table, const std::string& what) {
  constexpr std::size_t max_boxes = 32;
  BlocksModel model{read_boxes(table, "solids"), read_boxes(table, "holes"), number(table, "bevel_m"), 0};
  if (model.solids.empty() || model.solids.size() + model.holes.size() > max_boxes)
    complain(child(table, "solids"),
             fmt::format("{} has {} solids and {} holes; write one solid at least, and at "
                         "most {} boxes in all",
                         what, model.solids.size(), model.holes.size(), max_boxes));
  if (const std::string fault = fault_of(model); !fault.empty())
    complain(table, fmt::format("{}: {}; move the boxes until it is one body", what, fault));
  Box bounds;
  for (const Box& solid : model.solids) bounds.include(solid);
  model.triangle_m = triangle_edge(table, bounds.size());
  check_fineness(table, bounds.size(), model.triangle_m);
  if (const double cells = (bounds.size() / model.triangle_m).prod(), most = 3e7; cells > most)
    complain(
        child(table, "triangle_m"),
        fmt::format("triangle_m = {} would make a grid of {:.0f} cells, more than {:.0f}; write a larger one",
                    model.triangle_m, cells, most));
  return model;
}

FileModel read_file_model(const Node& table, const std::string& what) {
  FileModel model;
  model.file = text(table, "file");
  if (model.file.empty())
    complain(child(table, "file"), what + ".file is empty; write the name of a model file");
  model.made = text_or(table, "made", "");
  model.height_m = maybe_number(table, "height_m");
  if (model.height_m && table.find("scale"))
    complain(*table.find("scale"), what + " has both scale and height_m; keep one of them");
  model.scale = maybe_number(table, "scale").value_or(1);
  model.up = axis_named(text_or(table, "up", "+z"));
  model.front = axis_named(text_or(table, "front", "+x"));
  if (model.up.dot(model.front) != 0)
    complain(*(table.find("front") ? table.find("front") : table.find("up")),
             what + ": up and front lie along the same axis of the file; give two different axes");
  return model;
}

Model read_model(const Node& table, const std::string& body) {
  const std::string what = body + ".model";
  const auto given = [&](std::string_view key) { return table.find(key) != nullptr; };
  const int kinds = given("file") + given("box") + given("plate") + given("blocks") + given("sphere") +
                    (given("made") && !given("file"));
  if (kinds != 1)
    complain(table, fmt::format("{} has {} of file, made, box, plate, blocks, sphere; give exactly one (made "
                                "may stand beside file)",
                                what, kinds == 0 ? "none" : "more than one"));
  for (const char* key : {"scale", "up", "front"})
    if (given(key) && !given("file"))
      complain(*table.find(key), fmt::format("{}.{} goes with file only; remove it", what, key));
  if (given("height_m") && !given("file") && !given("made"))
    complain(*table.find("height_m"), what + ".height_m goes with file or made only; remove it");
  if (given("file")) return read_file_model(table, what);
  if (given("made")) return MadeModel{text(table, "made"), maybe_number(table, "height_m").value_or(1)};
  if (given("box")) return read_box(child(table, "box"), what + ".box");
  if (given("plate")) return read_plate(child(table, "plate"), what + ".plate");
  if (given("blocks")) return read_blocks(child(table, "blocks"), what + ".blocks");
  const Node& sphere = child(table, "sphere");
  const double d = number(sphere, "diameter_m");
  const SphereModel model{d, triangle_edge(sphere, Vec3::Constant(d))};
  check_fineness(sphere, Vec3::Constant(d), model.triangle_m);
  return model;
}

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
  if (cell_m) {
    cage.cell_m = number(table, "cell_m");
    check_cell_size(*cell_m, cage.cell_m, model, body);
    return cage;
  }
  const auto* plate = std::get_if<PlateModel>(&model);
  if (!std::holds_alternative<BoxModel>(model) && !(plate && !plate->hole))
    complain(
        *cells,
        fmt::format("{}.cage.cells needs a box, or a plate without a hole; write tets = N instead", body));
  cage.cells = as_vector(*cells).cast<int>();
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
            1000,      0.05,           as_number(parse_set_value(std::string(friction.fallback), ""))};
  }
  return {text(*table, "model"),           maybe_number(*table, "youngs_modulus_pa").value_or(any_modulus_pa),
          number(*table, "poisson_ratio"), number(*table, "density_kg_m3"),
          number(*table, "damping_ratio"), number(*table, "friction"),
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

void check_inside(const BodySpec& body, const Box& bounds, const Node& position, const std::string& what) {
  const auto start = start_box(body);
  const Box occupied = start ? *start : Box{body.pose.position_m, body.pose.position_m};
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

template <class Look>
Look named(const std::string& word, std::initializer_list<std::pair<const char*, Look>> looks) {
  for (const auto& [name, look] : looks)
    if (word == name) return look;
  LIMBER_CHECK(false, word);
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
  for (const char* key : {"velocity_m_s", "angular_velocity_rad_s"})
    if (stands && !vector(table, key).isZero(0))
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

bool is_rigid_obstacle(const BodySpec& body) {
  return body.role == Role::obstacle && body.kind == Kind::rigid;
}

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

// A body other than the robot, by its name.
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

void read_force(const Node& table, Scene& scene) {
  ForceSpec force;
  const std::string what = fmt::format("forces[{}]", scene.forces.size());
  force.where = table.where.text();
  force.body = body_called(child(table, "body"), scene, what + ".body");
  if (const BodySpec& body = scene.bodies[std::size_t(force.body)]; is_rigid_obstacle(body))
    complain(child(table, "body"),
             fmt::format("{}: {} is a rigid obstacle, which no force moves; choose another body, or make it "
                         "soft or free",
                         what, body.name));
  force.from_s = number(table, "from_s"), force.to_s = number(table, "to_s");
  if (!(force.to_s > force.from_s))
    complain(child(table, "to_s"),
             fmt::format("{}.to_s is {}, not after from_s, {}; write the later one there", what, force.to_s,
                         force.from_s));
  force.force_n = vector(table, "force_n");
  if (table.find("box_m")) force.box_m = box(table, "box_m");
  scene.forces.push_back(std::move(force));
}

void read_motion(const Node& table, Scene& scene) {
  MotionSpec motion;
  const std::string what = fmt::format("motions[{}]", scene.motions.size());
  motion.where = table.where.text();
  const Node& name = child(table, "body");
  motion.body = body_called(name, scene, what + ".body");
  const BodySpec& body = scene.bodies[std::size_t(motion.body)];
  if (!is_rigid_obstacle(body))
    complain(name, fmt::format("{}: {} is no rigid obstacle, and goes where it is pushed; write role = "
                               "\"obstacle\" and kind = \"rigid\" for it, or [[forces]]",
                               what, body.name));
  for (const MotionSpec& other : scene.motions)
    if (other.body == motion.body)
      complain(name, fmt::format("{}: {} has a motion already; put all keyframes into one", what, body.name));
  for (const Node& node : list(table, "keyframes")) {
    MotionSpec::Keyframe frame{number(node, "at_s"), body.pose.position_m,
                               direction(node, "axis", (what + ".keyframes.axis").c_str()),
                               number(node, "angle_deg")};
    if (node.find("position_m")) frame.position_m = vector(node, "position_m");
    if (!motion.keyframes.empty() && !(frame.at_s > motion.keyframes.back().at_s))
      complain(child(node, "at_s"),
               fmt::format("keyframe at {} s does not come after the one at {} s; put them in order",
                           frame.at_s, motion.keyframes.back().at_s));
    motion.keyframes.push_back(frame);
  }
  if (motion.keyframes.empty())
    complain(
        child(table, "keyframes"),
        fmt::format("{}.keyframes is empty; write for example keyframes = [{{ at_s = 1, position_m = [0, "
                    "0, 1] }}]",
                    what));
  scene.motions.push_back(std::move(motion));
}

Goal::Shape read_goal_shape(const Node& table) {
  Goal::Shape shape{direction(table, "axis", "goal.shape.axis"),
                    number(table, "angle_deg"),
                    vector(table, "stretch"),
                    text(table, "cage"),
                    maybe_number(table, "turn_tolerance_deg"),
                    maybe_number(table, "tolerance_m")};
  if (!shape.turn_tolerance_deg && !shape.tolerance_m)
    complain(table,
             "goal.shape asks for nothing without a tolerance; write for example turn_tolerance_deg = 10");
  return shape;
}

// What all goals have, those on the way too; `name` is the table's.
Goal read_any_goal(const Node& table, const Scene& scene, const std::string& name) {
  const Box& bounds = scene.bounds_m;
  Goal goal;
  goal.center_of_mass_m = vector(table, "center_of_mass_m");
  const std::optional<double> radius = maybe_number(table, "radius_m");
  if (radius.has_value() == (table.find("box_m") != nullptr))
    complain(table,
             fmt::format("the {} needs either radius_m or box_m; write for example radius_m = 0.5", name));
  if (radius) goal.radius_m = *radius;
  if (table.find("box_m")) {
    goal.box_m = box(table, "box_m");
    const Vec3 reach =
        (goal.box_m->upper - goal.center_of_mass_m).cwiseMax(goal.center_of_mass_m - goal.box_m->lower);
    goal.radius_m = reach.norm();
    if ((goal.center_of_mass_m.array() < goal.box_m->lower.array()).any() ||
        (goal.center_of_mass_m.array() > goal.box_m->upper.array()).any())
      complain(child(table, "box_m"),
               fmt::format("{0}.center_of_mass_m is not in {0}.box_m; move one of them", name));
  }
  for (const auto& [key, index] : {std::pair("above", &goal.above),
                                   {"below", &goal.below},
                                   {"clear_of", &goal.clear_of},
                                   {"moves_with", &goal.moves_with}})
    if (const Node* body = table.find(key))
      *index = other_body(*body, scene, fmt::format("{}.{}", name, key));
  for (int i = 0; i < 3; ++i)
    if (goal.center_of_mass_m[i] < bounds.lower[i] || goal.center_of_mass_m[i] > bounds.upper[i])
      complain(child(table, "center_of_mass_m"),
               fmt::format(
                   "the {} is outside the bounds: {} = {} is not between {} and {}; move the {} or enlarge "
                   "world.bounds_m",
                   name, "xyz"[i], goal.center_of_mass_m[i], bounds.lower[i], bounds.upper[i], name));
  return goal;
}

Goal read_goal(const Node& root, const Scene& scene) {
  const Node& table = child(root, "goal");
  Goal goal = read_any_goal(table, scene, "goal");
  if (const Node* shape = table.find("shape")) goal.shape = read_goal_shape(*shape);
  goal.lost_below_m = maybe_number(table, "lost_below_m");
  if (goal.lost_below_m && goal.moves_with < 0)
    complain(child(table, "lost_below_m"), "goal.lost_below_m goes with goal.moves_with only; remove it");
  if (goal.moves_with >= 0 && number(child(root, "planner"), "settle_time_s") > 0)
    complain(child(table, "moves_with"),
             "the robot cannot come to rest in a goal that moves; write planner.settle_time_s = 0");
  return goal;
}

std::vector<Via> read_via(const Node& root, const Scene& scene) {
  std::vector<Via> all;
  for (const Node& table : list(root, "via")) {
    const Via& via = all.emplace_back(Via{read_any_goal(table, scene, "via"), flag(table, "rest")});
    if (!via.rest) continue;
    if (via.goal.moves_with >= 0)
      complain(child(table, "rest"), "the robot cannot come to rest in a via that moves; write rest = false");
    if (number(child(root, "planner"), "settle_time_s") == 0)
      complain(child(table, "rest"),
               "planner.settle_time_s is 0, so the robot has no time to come to rest; raise it, or write "
               "rest = false");
  }
  return all;
}

// Without a goal nothing is searched, and all that belongs to a search may lack.
void read_goals(const Node& root, Scene& scene, const Complaints& complaints) {
  if (!root.find("goal")) {
    std::vector<std::string> lacks{"[goal]"};
    if (!root.find("planner")) lacks.push_back("[planner]");
    if (scene.bodies[std::size_t(scene.robot)].role != Role::robot)
      lacks.push_back("a body with role = \"robot\"");
    scene.lacks = fmt::format(
        "{}: the scene can only be simulated (limber simulate); to be planned it lacks {}; add {}",
        root.where.text(), fmt::join(lacks, ", "), lacks.size() == 1 ? "it" : "them");
    if (!list(root, "via").empty())
      complaints.during([&] {
        complain(list(root, "via").front(), "[[via]] are goals before [goal], and there is none; add [goal]");
      });
    return;
  }
  if (!root.find("planner")) {
    complaints.during(
        [&] { complain(root, "the scene lacks \"planner\" (how the motion is searched); add [planner]"); });
    return;
  }
  complaints.during([&] { scene.via = read_via(root, scene); });
  complaints.during([&] { scene.goal = read_goal(root, scene); });
}

PlannerSpec read_planner(const Node& table) {
  PlannerSpec planner;
  planner.preset = text(table, "preset");
  planner.seed = std::int64_t(number(table, "seed"));
  planner.iterations = integer(table, "iterations");
  planner.goal_bias = number(table, "goal_bias");
  const Node& weights = child(table, "weights");
  planner.weight_body = number(weights, "body");
  planner.weight_control_point = number(weights, "control_point");
  planner.weight_interpolation = number(weights, "interpolation");
  if (!(planner.weight_body + planner.weight_control_point > 0))
    complain(
        weights,
        "planner.weights of body and control_point are both 0, so nothing could drive the robot anywhere but "
        "to the goal; make one of them > 0");
  planner.max_force_n = number(table, "max_force_n");
  const Eigen::Vector2d share = vector2(table, "force_share"), duration = vector2(table, "duration_s");
  planner.min_force_share = share[0], planner.max_force_share = share[1];
  planner.min_duration_s = duration[0], planner.max_duration_s = duration[1];
  planner.control_point_radius_m = number(table, "control_point_radius_m");
  planner.settle_time_s = number(table, "settle_time_s");
  planner.settle_speed_m_s = number(table, "settle_speed_m_s");
  planner.settle_force_share = number(table, "settle_force_share");
  planner.settle_hold = flag(table, "settle_hold");
  planner.lag = integer(table, "lag");
  planner.metric = text(table, "metric");
  planner.time_weight = number(table, "time_weight");
  planner.guidance = number(table, "guidance");
  planner.soft_price = number(table, "soft_price");
  planner.look_s = number(table, "look_s");
  planner.learn_prices = flag(table, "learn_prices");
  planner.steer = flag(table, "steer");
  planner.stop_in_goal = flag(table, "stop_in_goal");
  planner.hold = flag(table, "hold");
  planner.end_hopeless = flag(table, "end_hopeless");
  if (planner.guidance > 0 && planner.lag == 0)
    complain(child(table, "guidance"),
             "guidance needs planner.lag of at least 1; write lag = 31, or guidance = 0");
  if (planner.look_s == 0 && (planner.stop_in_goal || planner.end_hopeless))
    complain(child(table, planner.stop_in_goal ? "stop_in_goal" : "end_hopeless"),
             "stop_in_goal and end_hopeless need pushes that are looked at; write planner.look_s = 0.1");
  planner.shortcut_rounds = integer(table, "shortcut_rounds");
  return planner;
}

CameraSpec read_camera(const Node& table, const Scene& scene, const std::string& name) {
  CameraSpec camera;
  camera.name = name;
  camera.direction = direction(table, "direction", "camera.direction");
  camera.fov_deg = number(table, "fov_deg");
  camera.turn_deg = number(table, "turn_deg");
  for (const Node& node : list(table, "keyframes")) {
    const Keyframe frame{number(node, "at"), vector(node, "eye_m"), vector(node, "target_m")};
    if (!camera.keyframes.empty() && frame.at <= camera.keyframes.back().at)
      complain(child(node, "at"),
               fmt::format("keyframe at {} does not come after the one at {}; put them in order", frame.at,
                           camera.keyframes.back().at));
    if (frame.eye_m == frame.target_m)
      complain(child(node, "target_m"), "the camera looks at the place where it is; move target_m or eye_m");
    camera.keyframes.push_back(frame);
  }
  camera.fill = number(table, "fill");
  if (const Node* follow = table.find("follow")) camera.follow = body_called(*follow, scene, "follow");
  if (const Node* subject = table.find("subject")) {
    camera.subject = body_called(*subject, scene, "subject");
    if (camera.follow >= 0 || !camera.keyframes.empty())
      complain(*subject, "a camera with follow or keyframes frames no subject; remove one of them");
  }
  return camera;
}

std::vector<CameraSpec> read_cameras(const Node& root, const Scene& scene) {
  std::vector<CameraSpec> cameras{read_camera(child(root, "camera"), scene, "main")};
  for (const Node& table : list(root, "cameras")) {
    const std::string& name = text(table, "name");
    for (const CameraSpec& other : cameras)
      if (same_but_for_case(other.name, name))
        complain(child(table, "name"),
                 fmt::format(
                     "two cameras are called \"{}\" (\"main\" is the table camera){}; give each its own name",
                     name, other.name == name ? "" : ", but for capitals"));
    cameras.push_back(read_camera(table, scene, name));
  }
  return cameras;
}

void check_inset(const Node& film, const Scene& scene) {
  if (!scene.film.inset) return;
  std::vector<std::string> names;
  for (const CameraSpec& camera : scene.cameras) names.push_back(camera.name);
  if (std::find(names.begin(), names.end(), scene.film.inset->camera) == names.end())
    complain(child(child(film, "inset"), "camera"),
             fmt::format("film.inset.camera: the scene has no camera \"{}\"; there are: {}",
                         scene.film.inset->camera, fmt::join(names, ", ")));
}

ColorBy read_color_by(const std::string& word) {
  return word == "strain"        ? ColorBy::strain
         : word == "volume"      ? ColorBy::volume
         : word == "penetration" ? ColorBy::penetration
         : word == "speed"       ? ColorBy::speed
                                 : ColorBy::body;
}

// One line or several, without letters that cannot be seen.
std::vector<std::string> lines_of(const Node& node, const char* key) {
  std::vector<std::string> lines{""};
  for (const char c : as_text(node)) {
    if (c == '\n')
      lines.emplace_back();
    else if (static_cast<unsigned char>(c) < ' ' || c == 127)
      complain(node, fmt::format("{} has letters that cannot be seen", key));
    else
      lines.back() += c;
  }
  while (lines.size() > 1 && lines.back().empty()) lines.pop_back();
  constexpr std::size_t most = 8;
  if (lines.size() > most)
    complain(node, fmt::format("{} has {} lines; at most {} fit on the picture", key, lines.size(), most));
  return lines;
}

std::optional<CardSpec> read_card(const Node& film, const char* name) {
  const Node* table = film.find(name);
  if (!table) return {};
  return CardSpec{lines_of(child(*table, "text"), fmt::format("film.{}.text", name).c_str()),
                  number(*table, "duration_s"), text(*table, "ground") == "plain"};
}

FilmSpec read_film(const Node& table) {
  const Eigen::Vector2i size = vector2(table, "size_px").cast<int>(),
                        sheet = vector2(table, "sheet").cast<int>();
  FilmSpec film;
  film.width_px = size[0], film.height_px = size[1];
  film.frames_per_second = integer(table, "frames_per_second");
  film.speed = number(table, "speed");
  if (film.frames_per_second / film.speed > 10'000)
    complain(child(table, "speed"), fmt::format("film.frames_per_second over film.speed are {:g} states a "
                                                "second of motion, more than 10,000; raise speed",
                                                film.frames_per_second / film.speed));
  film.pace = named<Pace>(text(table, "pace"), {{"steady", Pace::steady}, {"contact", Pace::contact}});
  film.slowest = vector2(table, "pace_range")[0], film.quickest = vector2(table, "pace_range")[1];
  if (table.find("length_s")) film.length_s = number(table, "length_s");
  if (film.length_s && film.pace == Pace::steady)
    complain(child(table, "length_s"),
             "film.length_s needs film.pace = \"contact\"; a steady film is as long as speed makes it");
  film.end = named<FilmEnd>(text(table, "end"), {{"path", FilmEnd::path}, {"rest", FilmEnd::rest}});
  film.look = named<FilmLook>(text(table, "look"), {{"studio", FilmLook::studio},
                                                    {"dark", FilmLook::dark},
                                                    {"clinical", FilmLook::clinical},
                                                    {"paper", FilmLook::paper}});
  if (table.find("background")) film.background_srgb = as_color(text(table, "background"));
  film.bounds_lines = flag(table, "bounds_lines");
  film.transparent = flag(table, "transparent");
  film.caption = text(table, "caption");
  if (std::any_of(film.caption.begin(), film.caption.end(),
                  [](unsigned char c) { return c < ' ' || c == 127; }))
    complain(child(table, "caption"), "film.caption has letters that cannot be seen; it is one line");
  film.clock = flag(table, "clock");
  film.scale_bar = flag(table, "scale_bar");
  film.color_by = read_color_by(text(table, "color_by"));
  if (table.find("color_range")) {
    film.color_range = vector2(table, "color_range");
    if (!((*film.color_range)[0] < (*film.color_range)[1]))
      complain(child(table, "color_range"),
               "both ends of film.color_range are the same; write for example [0, 0.5]");
  }
  film.cages = flag(table, "cages");
  film.forces = flag(table, "forces");
  film.path = flag(table, "path");
  film.tree = flag(table, "tree");
  film.side_by_side = flag(table, "side_by_side");
  film.panes = flag(table, "panes");
  film.outlines = flag(table, "outlines");
  if (const Node* inset = table.find("inset"))
    film.inset = InsetSpec{text(*inset, "camera"), number(*inset, "size")};
  film.title = read_card(table, "title"), film.end_card = read_card(table, "end_card");
  if (film.inset && film.side_by_side)
    complain(child(table, "inset"),
             "film.inset and film.side_by_side both show a second picture; take one of them");
  film.sheet_columns = sheet[0], film.sheet_rows = sheet[1];
  return film;
}

// The paper's contact and binding, where the scene does not say otherwise.
void keep_to_the_paper(const Node& root, Scene& scene) {
  for (const Node& table : list(root, "bodies"))
    for (BodySpec& body : scene.bodies) {
      if (body.name != text(table, "name")) continue;
      if (!table.find("contact")) body.contact = Contact::cage;
      if (!table.find("deformation")) body.deformation = Deformation::linear;
    }
}

void fill_in_max_stretch(Scene& scene) {
  for (BodySpec& body : scene.bodies)
    if (!body.max_stretch && body.kind == Kind::deformable && body.contact == Contact::surface)
      body.max_stretch = usual_max_stretch;
}

}  // namespace

Vec3 axis_named(const std::string& name) { return (name[0] == '-' ? -1.0 : 1.0) * Vec3::Unit(name[1] - 'x'); }

namespace {

// After a complaint goes on with what does not hang on what is complained of.
Scene read(const std::string& toml, const std::string& name_for_messages,
           const std::vector<std::string>& sets, const ScriptText& script, const Complaints& complaints) {
  Node root = parse_document(toml, name_for_messages);
  if (root.table()->empty())
    throw InputError(
        fmt::format("{}:1:1: the scene is empty; start from one that comes with limber (`limber scenes` "
                    "lists them)",
                    name_for_messages));
  complaints.during([&] { append(script, root); });
  for (const std::string& set : sets) complaints.during([&] { edit(root, set); });
  check_and_complete(root, complaints);
  Scene scene;
  if (complaints.any()) return scene;

  scene.name = text(root, "name");
  scene.description = text(root, "description");
  const Node& world = child(root, "world");
  scene.bounds_m = box(world, "bounds_m");
  scene.walls = flag(world, "walls");
  scene.rest_speed_m_s = number(world, "rest_speed_m_s");
  scene.gravity_m_s2 = vector(world, "gravity_m_s2");
  scene.contact_offset_m = maybe_number(world, "contact_offset_m");
  scene.part_overlaps = flag(world, "part_overlaps");
  scene.max_dt_s = maybe_number(world, "max_dt_s");
  read_bodies(root, scene, complaints);
  const bool all_bodies = !complaints.any();  // else others may name one that was left out
  if (all_bodies) {
    for (const Node& table : list(root, "forces")) complaints.during([&] { read_force(table, scene); });
    for (const Node& table : list(root, "motions")) complaints.during([&] { read_motion(table, scene); });
    read_goals(root, scene, complaints);
  }
  if (const Node* planner = root.find("planner"))
    complaints.during([&] { scene.planner = read_planner(*planner); });
  if (scene.planner.preset == "paper") keep_to_the_paper(root, scene);
  fill_in_max_stretch(scene);
  if (all_bodies) complaints.during([&] { scene.cameras = read_cameras(root, scene); });
  complaints.during([&] { scene.film = read_film(child(root, "film")); });
  if (all_bodies) complaints.during([&] { check_inset(child(root, "film"), scene); });
  scene.text = toml;
  scene.sets = sets;
  scene.script = script;
  return scene;
}

}  // namespace

Scene read_scene(const std::string& toml, const std::string& name_for_messages,
                 const std::vector<std::string>& sets, const ScriptText& script) {
  return read(toml, name_for_messages, sets, script, Complaints());
}

std::vector<std::string> problems_of(const std::string& toml, const std::string& name_for_messages,
                                     const std::vector<std::string>& sets) {
  std::vector<std::string> problems;
  const Complaints complaints(&problems);
  complaints.during([&] { read(toml, name_for_messages, sets, {}, complaints); });
  return problems;
}

void require_plannable(const Scene& scene) {
  if (!scene.lacks.empty()) throw InputError(scene.lacks);
}

Scene read_scene_file(const fs::path& file, const std::vector<std::string>& sets, const fs::path& script) {
  ScriptText more;
  if (!script.empty()) more = {read_file(script, max_scene_bytes), script.string()};
  Scene scene = read_scene(read_file(file, max_scene_bytes), file.string(), sets, more);
  scene.folder = fs::absolute(file).parent_path();
  return scene;
}

}  // namespace limber::scenes
