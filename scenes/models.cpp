#include "scenes/models.h"

#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;  // clang 14 (tools/fuzz) does not deduce it

Eigen::Matrix3d pose_turn(const Pose& pose) {
  return Eigen::AngleAxisd(pose.angle_deg * std::numbers::pi / 180, pose.axis).toRotationMatrix();
}

Vec3 anchor_of(const std::string& anchor, const Box& bounds) {
  if (anchor == "center") return bounds.center();
  if (anchor == "bottom") return {bounds.center().x(), bounds.center().y(), bounds.lower.z()};
  return Vec3::Zero();
}

// Turns the file's axes into ours; exact, for all its elements are 0, 1 or −1.
Eigen::Matrix3d ours_from_file(const FileModel& model) {
  Eigen::Matrix3d rows;
  rows << model.front.transpose(), model.up.cross(model.front).transpose(), model.up.transpose();
  return rows;
}

Box turned_bounds(const Eigen::Matrix3d& turn, const Points& positions) {
  Box bounds;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) bounds.include(turn * positions.row(v).transpose());
  return bounds;
}

Eigen::Matrix3d metres_from_model(const BodySpec& body, const Points& positions, bool made) {
  const auto to_height = [&](const Eigen::Matrix3d& turn, double height_m) -> Eigen::Matrix3d {
    const double height = turned_bounds(turn, positions).size().z();
    if (!(height > 0))
      throw InputError(
          fmt::format("bodies.{}: the model has no height, so it cannot be made {} m high; give scale",
                      body.name, height_m));
    return turn * (height_m / height);
  };
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  if (const auto* model = std::get_if<MadeModel>(&body.model)) return to_height(same, model->height_m);
  const auto* model = std::get_if<FileModel>(&body.model);
  if (!model) return same;
  const Eigen::Matrix3d turn = made ? same : ours_from_file(*model);
  return model->height_m ? to_height(turn, *model->height_m) : Eigen::Matrix3d(turn * model->scale);
}

Points corners(const Box& box) {
  Points made(8, 3);
  for (int i = 0; i < 8; ++i)
    for (int a = 0; a < 3; ++a) made(i, a) = (i >> a & 1 ? box.upper : box.lower)[a];
  return made;
}

Box centered(const Vec3& size_m) { return {-size_m / 2, size_m / 2}; }

const Vec3* box_size(const Model& model) {
  if (const auto* box = std::get_if<BoxModel>(&model)) return &box->size_m;
  if (const auto* plate = std::get_if<PlateModel>(&model)) return &plate->box.size_m;
  return nullptr;
}

constexpr const char* ball = "beach_ball";

// Of a body that limber makes, or may make; empty for others.
std::string name_of_made(const Model& model) {
  if (const auto* file = std::get_if<FileModel>(&model)) return file->made;
  if (const auto* made = std::get_if<MadeModel>(&model)) return made->made;
  return {};
}

SurfaceMesh make_named(const std::string& made) {
  if (made == ball) return make_beach_ball();
  if (made == "bunny") return make_bunny();
  if (made == "dragon") return make_dragon();
  if (made == "heart") return make_heart();
  if (made == "lung_left") return make_lung(1);
  if (made == "lung_right") return make_lung(-1);
  if (made == "liver") return make_liver();
  if (made == "spine") return make_spine();
  LIMBER_CHECK(made == "ribcage", made);
  return make_ribcage();
}

}  // namespace

std::array<int, 2> plate_plane(const Vec3& size_m) {
  int thin = 0;
  size_m.minCoeff(&thin);
  return thin == 0 ? std::array{1, 2} : thin == 1 ? std::array{0, 2} : std::array{0, 1};
}

std::optional<SurfaceMesh> made_surface(const BodySpec& body) {
  auto surface =
      std::visit(Overloaded{[](const FileModel& m) {
                              return m.made.empty() ? std::nullopt : std::optional(make_named(m.made));
                            },
                            [](const MadeModel& m) { return std::optional(make_named(m.made)); },
                            [](const BoxModel& m) { return std::optional(make_box(m)); },
                            [](const PlateModel& m) { return std::optional(make_plate(m)); },
                            [](const SphereModel& m) { return std::optional(make_sphere(m)); },
                            [](const BlocksModel& m) { return std::optional(make_blocks(m)); },
                            [](const TubeModel& m) { return std::optional(make_tube(m)); }},
                 body.model);
  if (box_size(body.model) && body.cage.tets == 0) surface->positions *= 1 - 1e-6;
  return surface;
}

Appearance made_appearance(const BodySpec& body, const SurfaceMesh& made) {
  return name_of_made(body.model) == ball ? beach_ball_appearance(made) : Appearance();
}

std::optional<TetMesh> made_cage(const BodySpec& body) {
  if (body.cage.tets > 0) return std::nullopt;
  if (const auto* blocks = std::get_if<BlocksModel>(&body.model))
    return make_blocks_cage(*blocks, body.cage.cell_m);
  if (const auto* tube = std::get_if<TubeModel>(&body.model)) try {
      return make_tube_cage(*tube, body.cage.cells);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: bodies.{}.cage: {}", body.where, body.name, error.what()));
    }
  const Vec3* size_m = box_size(body.model);
  LIMBER_CHECK(size_m, body.name);
  return make_box_cage(*size_m, body.cage.cells);
}

Eigen::Affine3d own_from_model(const BodySpec& body, const Points& model_positions, bool made) {
  const Eigen::Matrix3d linear = pose_turn(body.pose) * metres_from_model(body, model_positions, made);
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() = linear;
  map.translation() = -anchor_of(body.pose.anchor, turned_bounds(linear, model_positions));
  return map;
}

Eigen::Affine3d world_from_model(const BodySpec& body, const Points& model_positions, bool made) {
  return Eigen::Translation3d(body.pose.position_m) * own_from_model(body, model_positions, made);
}

std::optional<Box> start_box(const BodySpec& body) {
  Box bounds;
  if (const Vec3* size_m = box_size(body.model)) {
    bounds = turned_bounds(pose_turn(body.pose), corners(centered(*size_m)));
  } else if (const auto* sphere = std::get_if<SphereModel>(&body.model)) {
    bounds = centered(Vec3::Constant(sphere->diameter_m));
  } else if (const auto* made = std::get_if<MadeModel>(&body.model); made && made->made == ball) {
    bounds = centered(Vec3::Constant(made->height_m));
  } else if (const auto* blocks = std::get_if<BlocksModel>(&body.model)) {
    Box solids;
    for (const Box& solid : blocks->solids) solids.include(solid);
    bounds = turned_bounds(pose_turn(body.pose), corners(solids));
  } else {
    return std::nullopt;
  }
  const Vec3 shift = body.pose.position_m - anchor_of(body.pose.anchor, bounds);
  return Box{bounds.lower + shift, bounds.upper + shift};
}

Box surely_occupied(const BodySpec& body) {
  if (const std::optional<Box> start = start_box(body)) return *start;
  const auto* tube = std::get_if<TubeModel>(&body.model);
  if (!tube || body.pose.anchor != "origin") return {body.pose.position_m, body.pose.position_m};
  Box path;
  for (const Vec3& point : tube->path_m) path.include(body.pose.position_m + pose_turn(body.pose) * point);
  return path;
}

void transform(const Eigen::Affine3d& map, Points& positions) {
  for (Eigen::Index v = 0; v < positions.rows(); ++v)
    positions.row(v) = (map * Vec3(positions.row(v).transpose())).transpose();
}

namespace {

bool is_in(const Box& box, const Box& bounds_m, const Vec3& p) {
  const double tolerance_m = 1e-6 * bounds_m.diagonal();
  return ((p - box.lower).array() >= -tolerance_m).all() && ((box.upper - p).array() >= -tolerance_m).all();
}

}  // namespace

std::vector<int> nodes_in(const Box& box_m, const Box& bounds_m, const Points& positions) {
  std::vector<int> nodes;
  for (int n = 0; n < int(positions.rows()); ++n)
    if (is_in(box_m, bounds_m, positions.row(n))) nodes.push_back(n);
  return nodes;
}

std::vector<int> fixed_nodes(const BodySpec& body, const Box& bounds_m, const Points& cage_positions) {
  const double tolerance_m = 1e-6 * bounds_m.diagonal();
  const auto on_wall = [&](const Vec3& p) {
    return ((p - bounds_m.lower).cwiseAbs().minCoeff() <= tolerance_m) ||
           ((p - bounds_m.upper).cwiseAbs().minCoeff() <= tolerance_m);
  };
  std::vector<int> nodes;
  std::vector<bool> box_holds_one(body.fixed.boxes_m.size());
  for (int n = 0; n < int(cage_positions.rows()); ++n) {
    const Vec3 p = cage_positions.row(n);
    bool held = (body.kind == Kind::rigid && body.role == Role::obstacle) || (body.fixed.walls && on_wall(p));
    for (std::size_t b = 0; b < body.fixed.boxes_m.size(); ++b)
      if (is_in(body.fixed.boxes_m[b], bounds_m, p)) held = box_holds_one[b] = true;
    if (held) nodes.push_back(n);
  }
  if (body.fixed.walls && nodes.empty())
    throw InputError(fmt::format(
        "bodies.{}.fixed is \"walls\", but no node of its cage lies on a wall of the bounds; move "
        "the body to a wall or use boxes",
        body.name));
  for (std::size_t b = 0; b < box_holds_one.size(); ++b)
    if (!box_holds_one[b])
      throw InputError(fmt::format(
          "bodies.{}.fixed: no node of its cage lies in the box from [{:.6g}] to [{:.6g}]; move or "
          "enlarge the box",
          body.name, fmt::join(body.fixed.boxes_m[b].lower, ", "),
          fmt::join(body.fixed.boxes_m[b].upper, ", ")));
  return nodes;
}

}  // namespace limber::scenes
