// From a scene's text to a Scene, or to complaints.
//
// The text becomes a tree of values that know their line and column; edits are made to the tree; the table of
// keys checks each key by itself and puts in what is not said; then the parts are read, each with the checks
// that look at more than one key (scenes/detail/scene_parts.h). read_scene() throws the first complaint;
// problems_of() goes on after one with what does not hang on what is complained of, and collects them. The
// Scene keeps text and edits: a work folder stores them, and reads the same Scene from them again.
#include "scenes/scene.h"

#include <algorithm>
#include <optional>

#include "scenes/detail/edit_scene.h"
#include "scenes/detail/scene_parts.h"
#include "scenes/detail/schema.h"
#include "scenes/detail/typed_reads.h"
#include "scenes/problems.h"

namespace limber::scenes {

namespace {

// The paper's contact and binding, where the scene does not say otherwise.
void keep_to_the_paper(const Node& root, Scene& scene) {
  for (const Node& table : list(root, "bodies"))
    for (BodySpec& body : scene.bodies) {
      if (body.name != text(table, "name")) continue;
      if (!table.find("contact")) body.contact = Contact::cage;
      if (!table.find("deformation")) body.deformation = Deformation::linear;
    }
}

// Not before contact is known, which the preset decides.
void fill_in_max_stretch(Scene& scene) {
  for (BodySpec& body : scene.bodies)
    if (!body.max_stretch && body.kind == Kind::deformable && body.contact == Contact::surface)
      body.max_stretch = usual_max_stretch;
}

}  // namespace

Vec3 axis_named(const std::string& name) { return (name[0] == '-' ? -1.0 : 1.0) * Vec3::Unit(name[1] - 'x'); }

namespace {

// The text as it is after all edits, checked, with all defaults.
Node completed(const std::string& toml, const std::string& name_for_messages,
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
  return root;
}

// Where values stand does not count, nor the order of a table's keys, nor how a number is written.
bool same_values(const Node& a, const Node& b) {
  const auto number = [](const Node& node) -> std::optional<double> {
    if (const auto* whole = std::get_if<std::int64_t>(&node.value)) return double(*whole);
    if (const auto* real = std::get_if<double>(&node.value)) return *real;
    return std::nullopt;
  };
  if (number(a) || number(b)) return number(a) == number(b);
  if (a.value.index() != b.value.index()) return false;
  if (const Array* list = a.array())
    return std::equal(list->begin(), list->end(), b.array()->begin(), b.array()->end(), same_values);
  if (const Table* table = a.table())
    return table->size() == b.table()->size() &&
           std::all_of(table->begin(), table->end(), [&](const Entry& entry) {
             const Node* const other = b.find(entry.key);
             return other && same_values(entry.value, *other);
           });
  if (const auto* text = std::get_if<std::string>(&a.value)) return *text == std::get<std::string>(b.value);
  return std::get<bool>(a.value) == std::get<bool>(b.value);
}

// Where bodies are complained of, what names bodies (forces, motions, goals, cameras) is not read: each would
// complain that a body is not there.
Scene read(const std::string& toml, const std::string& name_for_messages,
           const std::vector<std::string>& sets, const ScriptText& script, const Complaints& complaints) {
  const Node root = completed(toml, name_for_messages, sets, script, complaints);
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
    for (const Node& table : list(root, "pressures")) complaints.during([&] { read_pressure(table, scene); });
    for (const Node& table : list(root, "motions")) complaints.during([&] { read_motion(table, scene); });
    for (const Node& table : list(root, "ligaments")) complaints.during([&] { read_ligament(table, scene); });
    read_goals(root, scene, complaints);
  }
  if (const Node* planner = root.find("planner"))
    complaints.during([&] { scene.planner = read_planner(*planner); });
  if (scene.planner.preset == "paper") keep_to_the_paper(root, scene);
  fill_in_max_stretch(scene);
  if (all_bodies) complaints.during([&] { scene.cameras = read_cameras(root, scene); });
  complaints.during([&] { scene.film = read_film(child(root, "film")); });
  if (all_bodies) {
    const Node& film = child(root, "film");
    complaints.during([&] { check_inset(film, scene); });
    complaints.during([&] { read_labels(film, scene); });
    complaints.during([&] { read_cuts(film, scene); });
  }
  scene.text = toml;
  scene.sets = sets;
  scene.script = script;
  return scene;
}

}  // namespace

// Complaints that are not collected are thrown by the first.
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

bool say_the_same(const Scene& a, const Scene& b) {
  const auto values = [&](const Scene& scene) {
    return completed(scene.text, scene.name, scene.sets, a.script, Complaints());
  };
  return same_values(values(a), values(b));
}

void require_plannable(const Scene& scene) {
  if (!scene.lacks.empty()) throw InputError(scene.lacks);
}

Scene read_scene_file(const fs::path& file, const std::vector<std::string>& sets, const fs::path& script) {
  ScriptText more;
  if (!script.empty()) {
    if (!fs::exists(script) || fs::is_directory(script))
      throw InputError(fmt::format("{}: {}; name a file with [[forces]], [[pressures]] or [[motions]]",
                                   script.string(),
                                   fs::exists(script) ? "is a folder" : "there is no such file"));
    more = {read_file(script, max_scene_bytes), script.string()};
  }
  Scene scene = read_scene(read_file(file, max_scene_bytes), file.string(), sets, more);
  scene.folder = fs::absolute(file).parent_path();
  return scene;
}

}  // namespace limber::scenes
