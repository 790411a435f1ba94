#include "plan/settings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/json_shape.h"

namespace limber::plan {

NLOHMANN_JSON_SERIALIZE_ENUM(Metric, {{Metric::time_to_go, "time_to_go"}, {Metric::distance, "distance"}})

namespace {

// What a number may be: from `lower`, or above it, to `upper`.
struct Range {
  double lower = 0, upper = std::numeric_limits<double>::infinity();
  bool open = false;
};
constexpr Range at_least_zero, positive{.open = true}, fraction{0, 1};

void require_in(const Range& range, double value, const std::string& name) {
  if ((range.open ? value > range.lower : value >= range.lower) && value <= range.upper &&
      std::isfinite(value))
    return;
  throw InputError(fmt::format("planner: {} is {}; it must be {}", name, value,
                               std::isfinite(range.upper)
                                   ? fmt::format("in [{}, {}]", range.lower, range.upper)
                               : range.open ? fmt::format("above {}", range.lower)
                                            : fmt::format("at least {}", range.lower)));
}

// Every setting but seed, goals and limit of time, once: its place in JSON, its field, its range. Writer,
// reader and check are made of this table; the order is that of the file. `laws` are what SearchOptions once
// were called.
template <class AnySettings, class Visitor>
void describe(AnySettings& s, const Visitor& visit) {
  visit("/max_iterations", s.max_iterations, Range{0, double(iteration_limit)});
  visit("/goal_bias", s.goal_bias, fraction);
  visit("/weights/body", s.weights.body, at_least_zero);
  visit("/weights/control_point", s.weights.control_point, at_least_zero);
  visit("/weights/interpolation", s.weights.interpolation, at_least_zero);
  visit("/max_force_n", s.max_force_n, at_least_zero);
  visit("/min_force_share", s.min_force_share, Range{0, s.max_force_share});
  visit("/max_force_share", s.max_force_share, fraction);
  visit("/min_duration_s", s.min_duration_s, Range{0, s.max_duration_s});
  visit("/max_duration_s", s.max_duration_s, at_least_zero);
  visit("/control_point_radius_m", s.control_point_radius_m, positive);
  visit("/settle/max_duration_s", s.settle.max_duration_s, at_least_zero);
  visit("/settle/mean_speed_m_s", s.settle.mean_speed_m_s, positive);
  visit("/settle/max_force_share", s.settle.max_force_share, fraction);
  visit("/settle/hold", s.settle.hold, Range{});
  auto& o = s.search_options;
  visit("/laws/lag", o.lag, Range{0, 65535});
  visit("/laws/metric", o.metric, Range{});
  visit("/laws/time_weight", o.time_weight, fraction);
  visit("/laws/guidance", o.guidance, fraction);
  visit("/laws/soft_price", o.soft_price, at_least_zero);
  visit("/laws/learn_prices", o.learn_prices, Range{});
  visit("/laws/steer", o.steer, Range{});
  visit("/laws/look_s", o.look_s, at_least_zero);
  visit("/laws/stop_in_goal", o.stop_in_goal, Range{});
  visit("/laws/hold", o.hold, Range{});
  visit("/laws/end_hopeless", o.end_hopeless, Range{});
  visit("/frames_per_second", s.frames_per_second, Range{min_frames_per_second, max_frames_per_second});
  visit("/in_flight", s.in_flight, Range{0, 65536});
}

// Those that files hold only where they are not 0: most have none, and older ones know none.
template <class AnySettings, class Visitor>
void describe_rare(AnySettings& s, const Visitor& visit) {
  visit("/max_pressure_pa", s.max_pressure_pa, at_least_zero);
  visit("/settle/pressure_pa", s.settle.pressure_pa, Range{0, s.max_pressure_pa});
  visit("/laws/density_price", s.search_options.density_price, at_least_zero);
}

// What a message calls it: /settle/hold is settle.hold.
std::string name_of(const char* pointer) {
  std::string name = pointer + 1;
  std::replace(name.begin(), name.end(), '/', '.');
  return name.starts_with("laws.") ? name.substr(5) : name;  // as the scene has it
}

void validate_goal(const Goal& goal, const std::string& name) {
  if (!goal.center_of_mass_m.allFinite())
    throw InputError(fmt::format("planner: {}'s center_of_mass_m is not finite", name));
  require_in(positive, goal.radius_m, name + "'s radius_m");
  if (goal.box_m && !holds(goal, goal.center_of_mass_m))
    throw InputError(fmt::format("planner: {}'s center_of_mass_m is not in its box_m", name));
}

Json json_of(const Goal& goal) {
  const auto list = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  Json json{{"center_of_mass_m", list(goal.center_of_mass_m)}, {"radius_m", goal.radius_m}};
  if (const auto& box = goal.box_m) json["box_m"] = {list(box->lower), list(box->upper)};
  return json;
}

Goal goal_from_json(const Json& json) {
  const auto read = [](const Json& list, Vec3& v) {
    for (int axis = 0; axis < 3; ++axis) list.at(std::size_t(axis)).get_to(v[axis]);
  };
  Goal goal;
  read(json.at("center_of_mass_m"), goal.center_of_mass_m);
  json.at("radius_m").get_to(goal.radius_m);
  if (json.contains("box_m")) {
    Box& box = goal.box_m.emplace();
    read(json.at("box_m").at(0), box.lower), read(json.at("box_m").at(1), box.upper);
  }
  return goal;
}

}  // namespace

bool holds(const Goal& goal, const Vec3& center) {
  return goal.box_m ? (center.array() >= goal.box_m->lower.array()).all() &&
                          (center.array() <= goal.box_m->upper.array()).all()
                    : (center - goal.center_of_mass_m).norm() <= goal.radius_m;
}

Settings settings_of_leg(const Settings& settings, int leg) {
  Settings s = settings;
  if (leg == int(s.via.size())) return s;
  const Via& via = settings.via.at(std::size_t(leg));
  s.goal = via.goal;
  s.settle.pressure_pa = 0;
  if (!via.rest) s.settle.max_duration_s = 0;
  return s;
}

void validate(const Settings& s) {
  const auto check = [](const char* name, const auto& value, const Range& range) {
    require_in(range, double(value), name_of(name));  // flags and choices have a range that holds them all
  };
  describe(s, check), describe_rare(s, check);
  if (s.time_limit_s != std::numeric_limits<double>::infinity())
    require_in(at_least_zero, s.time_limit_s, "time_limit_s");
  validate_goal(s.goal, "the goal");
  for (std::size_t i = 0; i < s.via.size(); ++i) validate_goal(s.via[i].goal, fmt::format("via {}", i + 1));
  const double elsewhere = s.weights.body + s.weights.control_point;
  if (s.goal_bias < 1 && elsewhere == 0)
    throw InputError(
        "planner: body and control_point both have weight 0, and interpolation is only possible towards the "
        "goal; give one of them a weight, or set goal_bias to 1");
  if (elsewhere + s.weights.interpolation == 0)
    throw InputError("planner: all manipulations have weight 0; give one of them a weight");
  const SearchOptions& o = s.search_options;
  if ((o.stop_in_goal || o.end_hopeless) && o.look_s == 0)
    throw InputError(
        "planner: stop_in_goal and end_hopeless need rollouts that are looked at; set look_s above 0");
  if (o.guidance > 0 && o.lag == 0)
    throw InputError("planner: guidance needs a lag of at least 1; set lag, or guidance to 0");
}

void validate(const Settings& s, const System& system) {
  validate(s);
  const Range steps{0, 1e8 * system.dt_s()};
  require_in(steps, s.max_duration_s, "max_duration_s");
  require_in(steps, s.settle.max_duration_s, "settle.max_duration_s");
}

Json json_of(const Settings& s) {
  Json json;
  json["seed"] = s.seed;
  json["max_iterations"] = s.max_iterations;  // the order that files have had
  json["goal"] = json_of(s.goal);
  for (const Via& via : s.via) {
    json["via"].push_back(json_of(via.goal));
    json["via"].back()["rest"] = via.rest;
  }
  describe(
      s, [&](const char* name, const auto& value, const Range&) { json[Json::json_pointer(name)] = value; });
  describe_rare(s, [&](const char* name, double value, const Range&) {
    if (value != 0) json[Json::json_pointer(name)] = value;
  });
  json["time_limit_s"] = std::isfinite(s.time_limit_s) ? Json(s.time_limit_s) : Json();
  return json;
}

Settings settings_from_json(const Json& json, const std::string& what) try {
  Json example = json_of(Settings{});
  example.erase("time_limit_s");                       // a number or null
  example["in_flight"] = example["laws"]["lag"] = -1;  // of 32 bits
  example.erase("seed");                               // of 64 bits
  constexpr const char* remedy = "plan anew with limber plan";
  require_like(json, example, Keys::those_there, what + ": planner settings", remedy);
  if (!json.at("seed").is_number_integer())
    throw InputError(fmt::format("{}: planner settings: seed is no whole number; {}", what, remedy));
  Settings s;
  json.at("seed").get_to(s.seed);
  s.goal = goal_from_json(json.at("goal"));
  if (json.contains("via"))
    for (const Json& via : json.at("via")) s.via.push_back({goal_from_json(via), via.at("rest").get<bool>()});
  describe(s, [&](const char* name, auto& value, const Range&) {
    // Once there was one of the two.
    const bool old =
        &value == static_cast<const void*>(&s.settle.hold) && !json.at("settle").contains("hold");
    json.at(Json::json_pointer(old ? "/laws/hold" : name)).get_to(value);
  });
  describe_rare(s, [&](const char* name, double& value, const Range&) {
    if (const Json::json_pointer at(name); json.contains(at)) json.at(at).get_to(value);
  });
  if (const Json& limit = json.at("time_limit_s"); !limit.is_null()) limit.get_to(s.time_limit_s);
  return s;
} catch (const Json::exception& trouble) {
  constexpr int key_not_found = 403;
  if (trouble.id == key_not_found)
    throw InputError(fmt::format(
        "{}: the plan was made by an older limber, whose planner had fewer settings ({}); plan anew "
        "with limber plan, without --resume",
        what, trouble.what()));
  throw InputError(fmt::format("{}: planner settings: {}", what, trouble.what()));
}

std::string first_difference(const Settings& a, const Settings& b) {
  Json in_a = json_of(a), in_b = json_of(b);
  for (Json* json : {&in_a, &in_b})
    for (const char* key : {"max_iterations", "in_flight", "time_limit_s"}) json->erase(key);
  for (const Json* json : {&in_a, &in_b})  // one of them may have no via
    for (const auto& [key, value] : json->items())
      if (in_a.value(key, Json()) != in_b.value(key, Json())) return key;
  return "";
}

}  // namespace limber::plan
