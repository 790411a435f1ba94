#include "plan/settings.h"

#include <cmath>

#include "core/error.h"
#include "core/json_shape.h"

namespace limber::plan {

namespace {

void require(bool good, const char* name, double value, const char* range) {
  if (!good) throw InputError(fmt::format("planner: {} is {}; it must be {}", name, value, range));
}

void require_within(double value, double lower, double upper, const char* name) {
  if (!(value >= lower && value <= upper))
    throw InputError(fmt::format("planner: {} is {}; it must be in [{}, {}]", name, value, lower, upper));
}

void validate_search_options(const SearchOptions& l) {
  require_within(l.lag, 0, 65535, "lag");
  require_within(l.time_weight, 0, 1, "time_weight");
  require_within(l.guidance, 0, 1, "guidance");
  require(std::isfinite(l.soft_price) && l.soft_price >= 0, "soft_price", l.soft_price, "at least 0");
  require(std::isfinite(l.look_s) && l.look_s >= 0, "look_s", l.look_s, "at least 0");
  if ((l.stop_in_goal || l.end_hopeless) && l.look_s == 0)
    throw InputError(
        "planner: stop_in_goal and end_hopeless need rollouts that are looked at; set look_s above 0");
  if ((l.guidance > 0) && l.lag == 0)
    throw InputError("planner: guidance needs a lag of at least 1; set lag, or guidance to 0");
}

void validate_goal(const Goal& goal, const std::string& name) {
  if (!goal.center_of_mass_m.allFinite())
    throw InputError(fmt::format("planner: {}'s center_of_mass_m is not finite", name));
  require(std::isfinite(goal.radius_m) && goal.radius_m > 0, (name + "'s radius_m").c_str(), goal.radius_m,
          "above 0");
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

bool is_weight(double w) { return std::isfinite(w) && w >= 0; }

void validate_weights(const Settings& s) {
  const ManipulationWeights& w = s.weights;
  require(is_weight(w.body), "weight of body", w.body, "at least 0");
  require(is_weight(w.control_point), "weight of control_point", w.control_point, "at least 0");
  require(is_weight(w.interpolation), "weight of interpolation", w.interpolation, "at least 0");
  const double elsewhere = w.body + w.control_point;
  if (s.goal_bias < 1 && elsewhere == 0)
    throw InputError(
        "planner: body and control_point both have weight 0, and interpolation is only possible towards the "
        "goal; give "
        "one of them a weight, or set goal_bias to 1");
  if (elsewhere + w.interpolation == 0)
    throw InputError("planner: all manipulations have weight 0; give one of them a weight");
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
  if (!via.rest) s.settle.max_duration_s = 0;
  return s;
}

void validate(const Settings& s) {
  require_within(double(s.max_iterations), 0, double(most_iterations), "max_iterations");
  validate_goal(s.goal, "the goal");
  for (std::size_t i = 0; i < s.via.size(); ++i) validate_goal(s.via[i].goal, fmt::format("via {}", i + 1));
  require_within(s.goal_bias, 0, 1, "goal_bias");
  validate_weights(s);
  require(std::isfinite(s.max_force_n) && s.max_force_n >= 0, "max_force_n", s.max_force_n, "at least 0");
  require_within(s.max_force_share, 0, 1, "max_force_share");
  require_within(s.min_force_share, 0, s.max_force_share, "min_force_share");
  require(std::isfinite(s.max_duration_s) && s.max_duration_s >= 0, "max_duration_s", s.max_duration_s,
          "at least 0");
  require_within(s.min_duration_s, 0, s.max_duration_s, "min_duration_s");
  require(std::isfinite(s.control_point_radius_m) && s.control_point_radius_m > 0, "control_point_radius_m",
          s.control_point_radius_m, "above 0");
  require(std::isfinite(s.settle.max_duration_s) && s.settle.max_duration_s >= 0, "settle max_duration_s",
          s.settle.max_duration_s, "at least 0");
  require(std::isfinite(s.settle.mean_speed_m_s) && s.settle.mean_speed_m_s > 0, "settle mean_speed_m_s",
          s.settle.mean_speed_m_s, "above 0");
  require_within(s.settle.max_force_share, 0, 1, "settle max_force_share");
  validate_search_options(s.search_options);
  require_within(s.frames_per_second, min_frames_per_second, max_frames_per_second, "frames_per_second");
  require_within(s.in_flight, 0, 65536, "in_flight");
  require(s.time_limit_s >= 0, "time_limit_s", s.time_limit_s, "at least 0");
}

void validate(const Settings& s, const System& system) {
  validate(s);
  require_within(s.max_duration_s, 0, 1e8 * system.dt_s(), "max_duration_s");
  require_within(s.settle.max_duration_s, 0, 1e8 * system.dt_s(), "settle max_duration_s");
}

Json json_of(const Settings& s) {
  Json json;
  json["seed"] = s.seed;
  json["max_iterations"] = s.max_iterations;
  json["goal"] = json_of(s.goal);
  for (const Via& via : s.via) {
    json["via"].push_back(json_of(via.goal));
    json["via"].back()["rest"] = via.rest;
  }
  json["goal_bias"] = s.goal_bias;
  json["weights"] = {{"body", s.weights.body},
                     {"control_point", s.weights.control_point},
                     {"interpolation", s.weights.interpolation}};
  json["max_force_n"] = s.max_force_n;
  json["min_force_share"] = s.min_force_share;
  json["max_force_share"] = s.max_force_share;
  json["min_duration_s"] = s.min_duration_s;
  json["max_duration_s"] = s.max_duration_s;
  json["control_point_radius_m"] = s.control_point_radius_m;
  json["settle"] = {{"max_duration_s", s.settle.max_duration_s},
                    {"mean_speed_m_s", s.settle.mean_speed_m_s},
                    {"max_force_share", s.settle.max_force_share},
                    {"hold", s.settle.hold}};
  const SearchOptions& l = s.search_options;
  json["laws"] = {{"lag", l.lag},
                  {"metric", l.metric == Metric::distance ? "distance" : "time_to_go"},
                  {"time_weight", l.time_weight},
                  {"guidance", l.guidance},
                  {"soft_price", l.soft_price},
                  {"learn_prices", l.learn_prices},
                  {"steer", l.steer},
                  {"look_s", l.look_s},
                  {"stop_in_goal", l.stop_in_goal},
                  {"hold", l.hold},
                  {"end_hopeless", l.end_hopeless}};
  json["frames_per_second"] = s.frames_per_second;
  json["in_flight"] = s.in_flight;
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
  json.at("max_iterations").get_to(s.max_iterations);
  s.goal = goal_from_json(json.at("goal"));
  if (json.contains("via"))
    for (const Json& via : json.at("via")) s.via.push_back({goal_from_json(via), via.at("rest").get<bool>()});
  json.at("goal_bias").get_to(s.goal_bias);
  json.at("weights").at("body").get_to(s.weights.body);
  json.at("weights").at("control_point").get_to(s.weights.control_point);
  json.at("weights").at("interpolation").get_to(s.weights.interpolation);
  json.at("max_force_n").get_to(s.max_force_n);
  json.at("min_force_share").get_to(s.min_force_share);
  json.at("max_force_share").get_to(s.max_force_share);
  json.at("min_duration_s").get_to(s.min_duration_s);
  json.at("max_duration_s").get_to(s.max_duration_s);
  json.at("control_point_radius_m").get_to(s.control_point_radius_m);
  json.at("settle").at("max_duration_s").get_to(s.settle.max_duration_s);
  json.at("settle").at("mean_speed_m_s").get_to(s.settle.mean_speed_m_s);
  json.at("settle").at("max_force_share").get_to(s.settle.max_force_share);
  const Json& search_options = json.at("laws");
  search_options.at("lag").get_to(s.search_options.lag);
  s.search_options.metric = search_options.at("metric") == "distance" ? Metric::distance : Metric::time_to_go;
  search_options.at("time_weight").get_to(s.search_options.time_weight);
  search_options.at("guidance").get_to(s.search_options.guidance);
  search_options.at("soft_price").get_to(s.search_options.soft_price);
  search_options.at("learn_prices").get_to(s.search_options.learn_prices);
  search_options.at("steer").get_to(s.search_options.steer);
  search_options.at("look_s").get_to(s.search_options.look_s);
  search_options.at("stop_in_goal").get_to(s.search_options.stop_in_goal);
  search_options.at("hold").get_to(s.search_options.hold);
  s.settle.hold = json.at("settle").value("hold", s.search_options.hold);  // before there were two of them
  search_options.at("end_hopeless").get_to(s.search_options.end_hopeless);
  json.at("frames_per_second").get_to(s.frames_per_second);
  json.at("in_flight").get_to(s.in_flight);
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
  const Json in_a = json_of(a), in_b = json_of(b);
  for (const char* key :
       {"seed", "via", "goal", "goal_bias", "weights", "max_force_n", "min_force_share", "max_force_share",
        "min_duration_s", "max_duration_s", "control_point_radius_m", "settle", "laws", "frames_per_second"})
    if (in_a.value(key, Json()) != in_b.value(key, Json())) return key;  // no goals on the way, no via
  return "";
}

}  // namespace limber::plan
