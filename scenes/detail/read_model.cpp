// bodies[].model: a file, or a model that limber makes (box, plate, blocks, sphere, or one by its name).
//
// Made models are checked for what they would cost before anybody makes them: a slip in triangle_m must end
// in a sentence, not in a machine without memory. How they are built is in docs/scene.md, "Models".
#include <algorithm>
#include <cmath>

#include "scenes/detail/scene_parts.h"
#include "scenes/detail/typed_reads.h"
#include "scenes/models.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

double triangle_edge(const Node& table, const Vec3& size) {
  return maybe_number(table, "triangle_m").value_or(size.maxCoeff() / 32);
}

// A box of nx × ny × nz squares has two triangles on each, on six faces.
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

// The hole must leave room for two bevels towards the nearest edge of the plate: its own and the edge's.
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

// Blocks are cut out of a grid of cells of triangle_m, so they cost by their volume, too.
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

TubeModel read_tube(const Node& table, const std::string& what) {
  constexpr std::size_t max_points = 100;
  TubeModel model;
  for (const Node& point : list(table, "path_m")) model.path_m.push_back(as_vector(point));
  model.diameter_m = number(table, "diameter_m"), model.wall_m = number(table, "wall_m");
  model.triangle_m = maybe_number(table, "triangle_m").value_or(model.diameter_m / 8);
  const Node& path = child(table, "path_m");
  if (model.path_m.size() > max_points)
    complain(path,
             fmt::format("{}.path_m has {} points; write at most {}", what, model.path_m.size(), max_points));
  for (std::size_t i = 1; i < model.path_m.size(); ++i)
    if (!((model.path_m[i] - model.path_m[i - 1]).norm() > 1e-3 * model.diameter_m))
      complain(path, fmt::format("{}.path_m has points {} and {} in one place; move one", what, i - 1, i));
  if (!(model.wall_m < model.diameter_m / 2))
    complain(child(table, "wall_m"), fmt::format("{}.wall_m is {}, which leaves no lumen; it must be < {}",
                                                 what, model.wall_m, model.diameter_m / 2));
  if (is_closed(model.path_m) && model.wall_m > 0)
    complain(child(table, "wall_m"),
             what +
                 ".path_m ends where it begins, and such a ring is solid; leave wall_m out, or move its last "
                 "point");
  const double length = length_m(model), bend = min_bend_radius_m(model);
  if (!(length > model.diameter_m))
    complain(path, fmt::format("{} is {:.3g} m long, no longer than it is thick; move its points apart", what,
                               length));
  if (!(bend > 0.6 * model.diameter_m))
    complain(path,
             fmt::format("{} bends round a radius of {:.3g} m, too sharply for a diameter of {:g} m; make it "
                         "thinner, or move its points apart",
                         what, bend, model.diameter_m));
  check_fineness(table, Vec3(length, model.diameter_m, model.diameter_m), model.triangle_m);
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

}  // namespace

std::vector<Box> read_boxes(const Node& table, std::string_view key) {
  std::vector<Box> boxes;
  for (const Node& node : list(table, key)) boxes.push_back(as_box(node));
  return boxes;
}

Model read_model(const Node& table, const std::string& body) {
  const std::string what = body + ".model";
  const auto given = [&](std::string_view key) { return table.find(key) != nullptr; };
  const int kinds = given("file") + given("box") + given("plate") + given("blocks") + given("sphere") +
                    given("tube") + (given("made") && !given("file"));
  if (kinds != 1)
    complain(table,
             fmt::format("{} has {} of file, made, box, plate, blocks, sphere, tube; give exactly one (made "
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
  if (given("tube")) return read_tube(child(table, "tube"), what + ".tube");
  const Node& sphere = child(table, "sphere");
  const double d = number(sphere, "diameter_m");
  const SphereModel model{d, triangle_edge(sphere, Vec3::Constant(d))};
  check_fineness(sphere, Vec3::Constant(d), model.triangle_m);
  return model;
}

}  // namespace limber::scenes
