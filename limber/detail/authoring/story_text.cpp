#include "limber/detail/authoring/story_text.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "limber/detail/authoring/line_of_sight.h"
#include "scenes/anatomy.h"

namespace limber::detail {

bool organ_moves(const NewSceneOptions& options) {
  return options.story == Story::away || options.story == Story::aside;
}

namespace {

constexpr int max_triangles_seen_through = 30'000;
constexpr int points_looked_at = 150;  // of the robot

std::string vector_text(const Vec3& v) {
  return fmt::format("[{:.4g}, {:.4g}, {:.4g}]", v.x(), v.y(), v.z());
}

constexpr const char* no_gravity = "gravity_m_s2 = [0, 0, 0]   # whoever leads it bears its weight\n";

std::string body_text(const Organ& organ, const NewSceneOptions& options, double scale) {
  const bool it = organ.name == options.robot, robot = it && organ_moves(options);
  // Where none is led, what is promised is in shares of the size of what the tour is about.
  const bool yardstick = it && options.story == Story::tour && options.fascia_hz > 0 && !organ.bone;
  const Vec3 center = organ.box.center() + organ.way_m;
  std::string text = fmt::format("\n[[bodies]]\nname = \"{}\"\nrole = \"{}\"\n", organ.name,
                                 organ.see_through                      ? "scenery"
                                 : robot || yardstick                   ? "robot"
                                 : options.fascia_hz > 0 && !organ.bone ? "free"
                                                                        : "obstacle");
  if (organ.bone && !organ.see_through) text += "kind = \"rigid\"\n";
  text += fmt::format("model = {{ file = \"{}\", scale = {:g}, up = \"{}\", front = \"{}\" }}\n", organ.file,
                      options.scale * (organ.see_through ? 1 : scale), options.up, options.front);
  text += fmt::format("pose = {{ position_m = [{:.7g}, {:.7g}, {:.7g}], anchor = \"center\" }}", center.x(),
                      center.y(), center.z());
  if (organ.way_m.norm() > 0) text += fmt::format("   # {:.2g} m from its true place", organ.way_m.norm());
  text += "\n";
  const scenes::Anatomy& usual = scenes::anatomy_of(organ.name);
  if (organ.see_through) {
    const bool hull = usual.kind == scenes::PartKind::hull;
    text += fmt::format("color = \"{}\"\nopacity = {}\n",
                        organ.bone ? "#efe6d0"
                        : hull     ? "#c98f70"
                                   : usual.color,
                        organ.bone ? 0.35
                        : hull     ? 0.22
                                   : 0.15);
    if (organ.surface.triangles.rows() > max_triangles_seen_through)
      text += fmt::format("triangles = {}\n", max_triangles_seen_through);
    return text;
  }
  text += fmt::format("cage = {{ tets = {} }}\n", organ.bone ? bone_tets : options.tets);
  if (organ.bone) return text + "color = \"#e8dfc8\"\nlook = \"bone\"\n";
  const bool hung = options.fascia_hz > 0 && !robot;
  text += fmt::format(
      "material = {{ youngs_modulus_pa = {:g}, poisson_ratio = 0.45, density_kg_m3 = {:g}, friction = 0.05{} "
      "}}\n",
      usual.youngs_modulus_pa, usual.density_kg_m3,
      hung ? fmt::format(", fascia_hz = {:g}", options.fascia_hz) : "");
  text += fmt::format("color = \"{}\"\nlook = \"tissue\"\n", usual.color);
  if (robot && options.fascia_hz > 0) text += no_gravity;
  if (robot || hung) return text;
  const Vec3 half = 0.5 * scale * organ.box.size();
  const Vec3 lower(center.x() - 2 * half.x(), center.y() - 2 * half.y(), center.z() - 2 * half.z()),
      upper(center.x() - 0.5 * half.x(), center.y() + 2 * half.y(), center.z() + 2 * half.z());
  return text + fmt::format("fixed = [{{ box_m = [{}, {}] }}]   # its back\n", vector_text(lower),
                            vector_text(upper));
}

const Vec3& direction_of(const std::string& goal) {
  static const std::map<std::string, Vec3> directions{{"front", Vec3::UnitX()}, {"back", -Vec3::UnitX()},
                                                      {"left", Vec3::UnitY()},  {"right", -Vec3::UnitY()},
                                                      {"up", Vec3::UnitZ()},    {"down", -Vec3::UnitZ()}};
  return directions.at(goal);
}

Vec3 center_of_mass(const TetMesh& cage) {
  Vec3 sum = Vec3::Zero();
  double all = 0;
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
    const auto corner = [&](int i) -> Vec3 { return cage.positions.row(cage.tets(t, i)); };
    const double share = signed_volume(corner(0), corner(1), corner(2), corner(3));
    sum += share / 4 * (corner(0) + corner(1) + corner(2) + corner(3)), all += share;
  }
  return sum / all;
}

// How far the robot goes along `direction` until it is past all that lies in its way, and at least one and a
// half times its length there and once its largest.
double way_to_goal(const std::vector<Organ>& organs, const Organ& robot, double scale,
                   const Vec3& direction) {
  const Box box = bounding_box(placed(robot, scale).positions);
  const Vec3 along = direction.cwiseAbs();
  const double from = direction.dot(box.center()) - along.dot(box.size()) / 2;
  const double length = scale * along.dot(robot.box.size());
  double way =
      std::max(1.5 * length, scale * robot.box.size().maxCoeff());  // the goal's radius is 0.4 of that
  for (const std::size_t i : simulated(organs)) {
    if (&organs[i] == &robot) continue;
    const Box other = bounding_box(placed(organs[i], scale).positions);
    const Vec3 gap = (other.center() - box.center()).cwiseAbs() - (other.size() + 1.25 * box.size()) / 2;
    bool in_the_way = true;
    for (int c = 0; c < 3; ++c) in_the_way &= along[c] > 0 || gap[c] < 0;
    const double end = direction.dot(other.center()) + along.dot(other.size()) / 2;
    if (in_the_way) way = std::max(way, end - from + 0.1 * length);
  }
  return way;
}

// To which side the robot is moved, by about its own length: where least is in the way, bones three times.
std::string free_side(const std::vector<Organ>& organs, const Organ& robot, double scale) {
  const Box box = bounding_box(placed(robot, scale).positions);
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const char* side : {"left", "right", "front", "down", "up"}) {
    const Vec3 way = 0.8 * std::abs(direction_of(side).dot(box.size())) * direction_of(side);
    double in_the_way = 0;
    for (const std::size_t i : simulated(organs)) {
      if (&organs[i] == &robot) continue;
      const Box other = bounding_box(placed(organs[i], scale).positions);
      const Vec3 both =
          ((box.upper + way).cwiseMin(other.upper) - (box.lower + way).cwiseMax(other.lower)).cwiseMax(0);
      in_the_way += (organs[i].bone ? 3 : 1) * both.prod();
    }
    if (in_the_way < least) least = in_the_way, best = side;
  }
  return best;
}

// What fascia holds gives way to newtons and not to a rod's own weight. Led through so much damping a rod of
// 40 g that is pushed with 2 N goes at 0.3 m/s, and not as fast as it would be thrown.
constexpr double force_in_fascia_m_s2 = 50, damping_in_fascia_per_s = 150;

// What comes to an organ, point first: a rod with round ends.
struct ToolKind {
  const char* name;
  const char* how;  // it comes
  double length_m, width_m, density_kg_m3;
};
constexpr ToolKind instrument{"instrument", "an instrument comes", 0.15, 0.008,
                              4000};  // steel, mostly hollow
constexpr ToolKind endoscope{"endoscope", "a soft endoscope comes", 0.2, 0.01, 1000};
constexpr ToolKind balloon{"balloon", "a balloon is blown up, where it comes", 0.1, 0.018, 1000};
constexpr double before_organ_m = 0.002, tissue_beside_m = 0.004;
// So soft that three fifths of what may blow it up double its volume; it presses with the rest.
constexpr double balloon_modulus_pa = 6e3, balloon_pressure_pa = 6e3, balloon_volume = 2;
constexpr double endoscope_modulus_pa = 1e6;

const ToolKind* tool_kind(Story story) {
  return story == Story::instrument  ? &instrument
         : story == Story::endoscope ? &endoscope
         : story == Story::balloon   ? &balloon
                                     : nullptr;
}

struct Tool {
  const ToolKind* kind;
  Vec3 outward;                // unit; from the organ along the rod
  Vec3 at_start_m, at_goal_m;  // its middle
  double volume_m3() const {
    const double w = kind->width_m;
    return (kind == &instrument ? 1 : EIGEN_PI / 4) * kind->length_m * w * w;
  }
  double mass_kg() const { return kind->density_kg_m3 * volume_m3(); }
  Vec3 tip_m(const Vec3& middle) const { return middle - 0.5 * kind->length_m * outward; }
  // What leads an endoscope by its tip is the front of it.
  Vec3 goal_m() const { return kind == &endoscope ? tip_m(at_goal_m) : at_goal_m; }
};

// From before the body, or from above and below there, to that point of the organ that is farthest out on a
// line through its middle: where nothing is in the way, then where no ribs are, then most from the front.
Tool tool_to(const ToolKind& kind, const NewSceneOptions& options, const std::vector<Organ>& organs,
             const Organ& target, double scale) {
  std::vector<SurfaceMesh> solid, ribs;
  for (const Organ& organ : organs)
    if (&organ != &target && (!organ.see_through || organ.bone))
      (organ.see_through ? ribs : solid).push_back(placed_surface(options, organ, scale));
  const SurfaceMesh surface = placed_surface(options, target, scale);
  const Vec3 center = bounding_box(surface.positions).center();
  Tool best{};
  double most = -1;
  for (const double around_deg : {0.0, -20.0, 20.0, -40.0, 40.0, -60.0, 60.0, -80.0, 80.0})
    for (const double up_deg : {0.0, 25.0, -25.0, 50.0, -50.0}) {
      const double around = around_deg * EIGEN_PI / 180, up = up_deg * EIGEN_PI / 180;
      const Vec3 outward(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up));
      Vec3 aim = center;
      double farthest = -std::numeric_limits<double>::infinity();
      for (Eigen::Index v = 0; v < surface.positions.rows(); ++v) {
        const Vec3 from_center = Vec3(surface.positions.row(v)) - center;
        const double along = outward.dot(from_center), aside = (from_center - along * outward).norm();
        if (along - 2 * aside > farthest) farthest = along - 2 * aside, aim = center + from_center;
      }
      constexpr int spokes = 12;
      Points tube(2 * spokes + 1, 3);
      const Vec3 x = outward.unitOrthogonal(), y = outward.cross(x);
      tube.row(0) = aim.transpose();
      for (int i = 0; i < 2 * spokes; ++i) {
        const double turn = 2 * EIGEN_PI * i / spokes,
                     radius = (i < spokes ? 0.5 : 1) * (0.5 * kind.width_m + tissue_beside_m);
        tube.row(1 + i) = (aim + radius * (std::cos(turn) * x + std::sin(turn) * y)).transpose();
      }
      const double free = share_in_sight(tube, outward, solid);
      const double worth = 4 * free + share_in_sight(tube, outward, ribs) + 0.5 * outward.x();
      if (worth <= most) continue;
      most = worth;
      const double way_m = std::max(0.08, 0.6 * scale * target.box.size().maxCoeff());
      const double half_m = 0.5 * kind.length_m;
      best = {.kind = &kind,
              .outward = outward,
              .at_start_m = aim + (before_organ_m + way_m + half_m) * outward,
              .at_goal_m = aim + (before_organ_m + half_m) * outward};
    }
  return best;
}

std::string box_text(const Vec3& middle, double half) {
  return fmt::format("[{}, {}]", vector_text(middle - Vec3::Constant(half)),
                     vector_text(middle + Vec3::Constant(half)));
}

std::string body_text(const Tool& tool, const NewSceneOptions& options) {
  const ToolKind& kind = *tool.kind;
  const bool hung = options.fascia_hz > 0;
  std::string text = fmt::format("\n[[bodies]]\nname = \"{}\"\nrole = \"robot\"\n", kind.name), material;
  if (&kind == &instrument) {
    const Vec3 axis = Vec3::UnitX().cross(tool.outward);
    const double angle_deg = std::atan2(axis.norm(), tool.outward.x()) * 180 / EIGEN_PI;
    text += fmt::format(
        "kind = \"rigid\"\nmodel = {{ box = {{ size_m = [{:g}, {:g}, {:g}], bevel_m = {:g} }} }}\n"
        "pose = {{ position_m = {}, axis = {}, angle_deg = {:.5g} }}\ncage = {{ tets = 60 }}\n",
        kind.length_m, kind.width_m, kind.width_m, 0.49 * kind.width_m, vector_text(tool.at_start_m),
        axis.norm() > 1e-9 ? vector_text(axis.normalized()) : "[0, 0, 1]", angle_deg);
  } else {
    // A tube's round ends reach beyond its path.
    const Vec3 half = 0.5 * (kind.length_m - kind.width_m) * tool.outward;
    const int across = &kind == &balloon ? 2 : 1;
    text += fmt::format(
        "self_contact = false   # it cannot reach itself\n"
        "model = {{ tube = {{ path_m = [{}, {}], diameter_m = {:g} }} }}\ncage = {{ cells = [{}, {}, {}] "
        "}}\n",
        vector_text(tool.at_start_m + half), vector_text(tool.at_start_m - half), kind.width_m, across,
        across, int(std::round(across * kind.length_m / kind.width_m)));
    material = &kind == &balloon
                   ? fmt::format("model = \"neo_hookean\", youngs_modulus_pa = {:g}, poisson_ratio = 0.3, ",
                                 balloon_modulus_pa)
                   : fmt::format("youngs_modulus_pa = {:g}, poisson_ratio = 0.4, ", endoscope_modulus_pa);
    if (&kind == &balloon) text += "max_volume_change = 4\n";
  }
  text += fmt::format("material = {{ {}density_kg_m3 = {:g}, friction = 0.05{} }}\n{}", material,
                      kind.density_kg_m3,
                      hung ? fmt::format(", mass_damping_per_s = {:g}", damping_in_fascia_per_s) : "",
                      &kind == &instrument  ? "color = \"#aab4bd\"\nroughness = 0.3\nmetallic = 0.6\n"
                      : &kind == &endoscope ? "color = \"#2b3a55\"\n"
                                            : "color = \"#e8c84a\"\nlook = \"rubber\"\n");
  return hung ? text + no_gravity : text;
}

// How a tool is pushed; an endoscope by its tail, and by its tip, which leads it.
std::string planner_text(const Tool& tool) {
  const ToolKind& kind = *tool.kind;
  if (&kind == &instrument)
    return "weights = { body = 1, control_point = 0, interpolation = 0 }   # it is not turned\n";
  if (&kind == &balloon) return fmt::format("max_pressure_pa = {:g}\n", balloon_pressure_pa);
  const double half = 0.9 * kind.width_m;
  const Vec3 tip = tool.tip_m(tool.at_start_m), tail = 2 * tool.at_start_m - tip;
  return fmt::format(
      "patches_m = [{}, {}]   # its tip, which leads it and is steered, and its tail\nlead = true\n"
      "weights = {{ body = 0, control_point = 1, interpolation = 0 }}\nsettle_time_s = 0\n",
      box_text(tip, half), box_text(tail, half));
}

struct Views {
  Vec3 best, side;  // from the scene to the camera
};

// Directions from which most of the points is seen past the other organs, at the start, on the way and at the
// goal: of those from before the body, or from above it, and of those square to the way.
Views views_of(const std::vector<Organ>& organs, const Organ& about, double scale, const Points& all,
               const Vec3& way) {
  std::vector<SurfaceMesh> hiding;
  for (const std::size_t i : simulated(organs)) {
    if (&organs[i] == &about) continue;
    const TetMesh cage = placed(organs[i], scale);
    hiding.push_back({cage.positions, boundary_triangles(cage.tets)});
  }
  const Eigen::Index step = std::max<Eigen::Index>(1, all.rows() / points_looked_at);
  constexpr int stops = 4;  // of the way
  Points points(stops * (all.rows() / step), 3);
  for (Eigen::Index p = 0; p < points.rows(); ++p)
    points.row(p) = all.row(p / stops * step) + double(p % stops) / (stops - 1) * way.transpose();
  // A way that leads to or from the eye looks short.
  const auto worth = [&](const Vec3& direction) {
    return share_in_sight(points, direction, hiding) -
           0.4 * std::abs(direction.normalized().dot(way.normalized()));
  };
  const auto best_of = [&](const std::vector<Vec3>& directions) {
    return *std::max_element(directions.begin(), directions.end(),
                             [&](const Vec3& a, const Vec3& b) { return worth(a) < worth(b); });
  };
  std::vector<Vec3> before;
  for (const double to_the_left : {-1.5, -1.0, -0.6, -0.3, 0.3, 0.6, 1.0, 1.5})
    for (const double up : {0.15, 0.35, 0.7}) before.push_back({1, to_the_left, up});
  Vec3 across = way.cross(Vec3::UnitZ());
  if (across.norm() < 1e-9 * way.norm()) across = Vec3::UnitY();
  across.normalize();
  const Vec3 up(0, 0, 0.12);
  return {best_of(before), best_of({across + up, up - across})};
}

std::string camera_text(const char* header, const Vec3& direction, const std::string& more) {
  return fmt::format("\n{}\ndirection = {}\nfov_deg = 24\n{}", header, vector_text(direction), more);
}

std::string subject_text(const std::string& name, double fill) {
  return fmt::format("subject = \"{}\"\nfill = {:g}\n", name, fill);
}
std::string subject_text(const std::string& tool, const std::string& organ, double fill) {
  return fmt::format("subject = [\"{}\", \"{}\"]\nfill = {:g}\n", tool, organ, fill);
}

// Of all organs, then to the one it is about, round that, and back.
std::string tour_text(const std::vector<Organ>& organs, const Organ& about, double scale) {
  Box all;
  for (const std::size_t i : simulated(organs))
    if (!organs[i].bone) all.include(bounding_box(placed(organs[i], scale).positions));
  const Box one = bounding_box(placed(about, scale).positions);
  const auto distance = [](const Box& box, double room) {
    return room * 0.5 * box.diagonal() / std::tan(12 * EIGEN_PI / 180);
  };
  const double far_m = distance(all, 1.1), near_m = distance(one, 1.5);
  struct Stop {
    double at;
    Vec3 direction, target;
    double distance_m;
  };
  const Vec3 middle = 0.5 * (all.center() + one.center());
  const Stop stops[] = {{0, {1, -0.25, 0.1}, all.center(), far_m},
                        {0.25, {1, 0.7, 0.2}, middle, 0.5 * (far_m + near_m)},
                        {0.5, {1, 0.25, 0.25}, one.center(), near_m},
                        {0.75, {1, -0.6, 0.2}, one.center(), near_m},
                        {1, {1, -0.25, 0.1}, all.center(), far_m}};
  std::string text = "\n[camera]   # to the organ it is about, and back\nfov_deg = 24\nkeyframes = [\n";
  for (const Stop& stop : stops)
    text += fmt::format("  {{ at = {:g}, eye_m = {}, target_m = {} }},\n", stop.at,
                        vector_text(stop.target + stop.distance_m * stop.direction.normalized()),
                        vector_text(stop.target));
  return text + "]\n" + camera_text("[[cameras]]\nname = \"front\"", {1, 0, 0.05}, "") +
         camera_text("[[cameras]]\nname = \"side\"", {0.1, 1, 0.1}, "") +
         camera_text("[[cameras]]\nname = \"above\"", {1, -0.3, 1.2}, subject_text(about.name, 0.4));
}

// Names of all but the hulls; and the front taken off what is only seen, before the middle of the organs.
std::string film_text(const std::vector<Organ>& organs, const NewSceneOptions& options, double scale,
                      const std::string& caption, double speed) {
  std::vector<std::string> names, hulls;
  Box soft;
  for (const Organ& organ : organs) {
    if (organ.see_through) hulls.push_back(fmt::format("\"{}\"", organ.name));
    if (!organ.see_through || organ.bone || scenes::anatomy_of(organ.name).kind != scenes::PartKind::hull)
      names.push_back(fmt::format("\"{}\"", organ.name));
    if (!organ.see_through && !organ.bone) soft.include(bounding_box(placed(organ, scale).positions));
  }
  if (const std::string tool = tool_name(options.story); !tool.empty())
    names.push_back(fmt::format("\"{}\"", tool));
  std::string text = fmt::format(
      "\n[film]\nframes_per_second = 30\nspeed = {:.2g}{}\nlook = \"clinical\"\nbounds_lines = false\n"
      "clock = {}\nscale_bar = true\ncaption = \"{}\"\nlabels = [{}]\n",
      speed, speed < 1 ? "   # slow motion: what is small moves quickly" : "", options.story != Story::tour,
      caption, fmt::join(names, ", "));
  if (!hulls.empty() && !soft.empty())
    text += fmt::format(
        "\n[[film.cuts]]   # opens the body from the front\npoint_m = {}\nnormal = [1, 0, 0]\n"
        "bodies = [{}]\n",
        vector_text(soft.center()), fmt::join(hulls, ", "));
  return text;
}

std::string in_words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

}  // namespace

std::string tool_name(Story story) {
  const ToolKind* kind = tool_kind(story);
  return kind ? kind->name : "";
}

std::string scene_text(const std::vector<Organ>& organs, const NewSceneOptions& options, double scale) {
  const Organ& robot = *std::find_if(organs.begin(), organs.end(),
                                     [&](const Organ& organ) { return organ.name == options.robot; });
  const ToolKind* kind = tool_kind(options.story);
  const TetMesh robot_cage = placed(robot, scale);
  const std::optional<Tool> tool =
      kind ? std::optional(tool_to(*kind, options, organs, robot, scale)) : std::nullopt;
  const std::string side = !options.goal.empty()           ? options.goal
                           : options.story == Story::aside ? free_side(organs, robot, scale)
                                                           : "front";
  const Vec3 size = scale * robot.box.size(), direction = direction_of(side);
  const double along = std::abs(direction.dot(size));
  const double way_m = options.story == Story::aside ? std::max(0.8 * along, 0.5 * size.maxCoeff())
                                                     : way_to_goal(organs, robot, scale, direction);
  const Vec3 start = tool ? tool->at_start_m : center_of_mass(robot_cage),
             goal = tool ? tool->at_goal_m : Vec3(start + way_m * direction);
  Box bounds;
  for (const std::size_t i : simulated(organs)) {
    // Bones do not move, and may reach out.
    const Box box = organs[i].bone ? Box{organs[i].box.center(), organs[i].box.center()}
                                   : bounding_box(placed(organs[i], scale).positions);
    const Vec3 more = Vec3::Constant(0.3 * size.maxCoeff());
    bounds.include(box.lower - more), bounds.include(box.upper + more);
  }
  if (tool) {
    const Vec3 reach = Vec3::Constant(0.7 * kind->length_m);
    bounds.include(start + reach), bounds.include(start - reach);
  } else if (organ_moves(options)) {
    bounds.include(goal + 1.5 * size), bounds.include(goal - 1.5 * size);
  }
  // At 5 m/s² a body of a metre is pushed for 0.2 to 1 s at a time; times go with the root of the length.
  const double length = tool ? (goal - start).norm() : size.maxCoeff(), time = std::sqrt(length);
  const double mass =
      tool ? tool->mass_kg()
           : std::pow(scale, 3) * robot.volume_m3 * scenes::anatomy_of(robot.name).density_kg_m3;
  const std::string of_true_size = scale < 1
                                       ? fmt::format("{:g} of its true size, about its own middle", scale)
                                       : std::string("of its true size");
  const std::size_t others = simulated(organs).size() - 1;
  const std::string name = in_words(robot.name);
  const std::string description =
      tool ? fmt::format("{} to the {} among {} bodies", kind->how, name, others)
      : options.story == Story::aside
          ? fmt::format("the {} is moved aside, to the {}, among {} bodies", name, side, others)
      : options.story == Story::tour
          ? fmt::format("a tour of {} bodies, to the {}", others + 1, name)
          : fmt::format("{} moves to the {} among {} bodies", robot.name, side, others);
  std::string text = fmt::format(
      "# Made by limber scene new. Every organ is {}.\n"
      "# In an atlas some are a little in one another: those stand off their true places, so that no two "
      "touch at "
      "the\n"
      "# start. Materials are usual ones. Edit what is to be otherwise: docs/scene.md has all keys.\n"
      "name = \"{}\"\ndescription = \"{}\"\n\n[world]\nbounds_m = [{}, "
      "{}]\ngravity_m_s2 = [0, 0, {}]\n",
      of_true_size, options.out.stem().string(), description, vector_text(bounds.lower),
      vector_text(bounds.upper), options.fascia_hz > 0 ? "-9.81" : "0");
  for (const Organ& organ : organs) text += body_text(organ, options, scale);
  if (tool) text += body_text(*tool, options);
  if (options.story == Story::tour)
    return text + tour_text(organs, robot, scale) + film_text(organs, options, scale, description, 0.1);

  const double radius = kind == &balloon                ? 0.012
                        : tool                          ? 0.006
                        : options.story == Story::aside ? 0.2 * length
                                                        : 0.4 * length;
  text += fmt::format("\n[goal]\ncenter_of_mass_m = {}\nradius_m = {:.3g}\n",
                      vector_text(tool ? tool->goal_m() : goal), radius);
  if (kind == &balloon)
    text += fmt::format("volume = {:g}   # of its own, when it is not blown up\n", balloon_volume);
  text += fmt::format(
      "\n[planner]\npreset = \"fast\"\nmax_force_n = {:.2g}\nduration_s = [{:.2g}, {:.2g}]\n"
      "control_point_radius_m = {:.2g}\nsettle_speed_m_s = {:.2g}\n",
      (tool && options.fascia_hz > 0 ? force_in_fascia_m_s2 : 5) * mass, 0.2 * time, time,
      kind == &endoscope ? 2 * kind->width_m : 0.35 * length, 0.02 * time);
  if (tool) text += planner_text(*tool);
  Points looked_at = robot_cage.positions;
  if (tool) {
    constexpr int places = 60;
    looked_at.resize(places, 3);
    for (int i = 0; i < places; ++i)
      looked_at.row(i) =
          (start + (double(i) / (places - 1) - 0.5) * kind->length_m * tool->outward).transpose();
  }
  const Views views = views_of(organs, robot, scale, looked_at, goal - start);
  // Of a tool's way the organ is where it leads to.
  text += camera_text("[camera]   # from where most of the way is seen", views.best,
                      tool ? subject_text(robot.name, 0.4) : subject_text(robot.name, 0.45));
  text += camera_text("[[cameras]]\nname = \"side\"", views.side,
                      tool ? subject_text(robot.name, 0.35) : subject_text(robot.name, 0.45));
  // A balloon is seen from beside.
  text += kind == &balloon ? camera_text("[[cameras]]\nname = \"near\"", views.side,
                                         subject_text(kind->name, robot.name, 0.8))
          : tool ? camera_text("[[cameras]]\nname = \"near\"", views.best, subject_text(robot.name, 0.65))
                 : camera_text("[[cameras]]\nname = \"follow\"", views.best,
                               fmt::format("follow = \"{}\"\n", robot.name));
  text += camera_text("[[cameras]]\nname = \"whole\"", {1, -0.5, 0.3}, "");
  return text + film_text(organs, options, scale, description, std::clamp(time, 0.05, 1.0));
}

}  // namespace limber::detail
