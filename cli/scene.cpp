#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "cli/commands.h"
#include "cli/scene_text.h"
#include "core/log.h"
#include "core/progress.h"
#include "limber/edits.h"

namespace limber::cli {

namespace {

Json json_of(const SceneFindings& found) {
  Json json{{"scene", found.file.string()}};
  for (const std::string& body : found.bodies_json)
    json["bodies"].push_back(parse_json(body, found.file.string()));
  if (found.prepare_cpu_s) json["estimate"]["prepare_cpu_s"] = *found.prepare_cpu_s;
  if (found.contact_offset_m) json["contact_offset_m"] = *found.contact_offset_m;
  if (found.pairs) {
    json["overlaps"] = Json::array(), json["gaps_below_offset"] = Json::array();
    for (const NearPair& pair : *found.pairs) {
      Json both{{"body", pair.body}, {"other", pair.other}};
      if (pair.parted)
        both.update(
            {{"depth_m", pair.depth_m}, {"of_robot_size", pair.of_robot_size}, {"parted", *pair.parted}});
      else
        both["gap_m"] = pair.gap_m;
      json[pair.parted ? "overlaps" : "gaps_below_offset"].push_back(both);
    }
  }
  if (found.film_possible) json["film_possible"] = *found.film_possible;
  return json;
}

void add_start(const StartFindings& start, const std::optional<fs::path>& still, Json& json) {
  json["dt_s"] = start.dt_s ? Json(*start.dt_s) : Json();
  for (const GoalTerm& term : start.goal)
    json["goal"].push_back({{"asked", term.asked}, {"found", term.found}, {"met", term.met}});
  if (!start.asked_too.empty()) json["goal_asks_too"] = start.asked_too;
  if (!start.rigid_passage_json.empty())
    json["rigid_passage"] = parse_json(start.rigid_passage_json, "rigid_passage");
  Json& estimate = json["estimate"];
  if (const auto& tried = start.tried)
    estimate["plan"] = {{"tried_iterations", tried->iterations},
                        {"tried_wall_s", tried->wall_s},
                        {"solved", tried->solved},
                        {"iterations", tried->of_all},
                        {"all_iterations_wall_s", tried->all_wall_s}};
  estimate["frames_a_second_of_motion"] = start.frames_a_second;
  if (!start.paint_s) return;
  estimate["paint_s"] = *start.paint_s;
  json["still"] = still->string();
}

std::string line(const char* key, const std::string& words) {
  return fmt::format("  {:12} {}\n", key, words);
}

std::string text_of(const NearPair& pair, double offset_m) {
  const std::string both = fmt::format("{} and {}", pair.body, pair.other);
  return pair.parted
             ? line("overlap", fmt::format("{}: {:.3g} m deep, {:.3g} % of the robot's size{}", both,
                                           pair.depth_m, 100 * pair.of_robot_size,
                                           *pair.parted ? "; they are parted before the plan begins" : ""))
             : line("near",
                    fmt::format("{}: {:.3g} m apart, less than the contact offset of {:.3g} m, which is as "
                                "much between these two",
                                both, pair.gap_m, offset_m));
}

std::string words_of(const std::optional<TriedSearch>& tried) {
  if (!tried) return "not known before bodies are prepared; --work DIR prepares and tries";
  if (tried->solved)
    return fmt::format("a search of {} iterations and {:.2g} s reaches the goal", tried->iterations,
                       tried->wall_s);
  return fmt::format(
      "{} iterations took {:.2g} s; all {} would take about {:.2g} s, and a search that reaches the goal "
      "ends "
      "before",
      tried->iterations, tried->wall_s, tried->of_all, tried->all_wall_s);
}

std::string text_of(const SceneFindings& found, const StartFindings& start,
                    const std::optional<fs::path>& still) {
  std::string text = line("time step", start.dt_s ? fmt::format("{:.3g} ms", 1e3 * *start.dt_s)
                                                  : "not known before cages are made; --work DIR makes them");
  for (const GoalTerm& term : start.goal)
    text += line("goal", fmt::format("{}: {}{}", term.asked, term.found, term.met ? ", met" : ""));
  if (!start.asked_too.empty())
    text += line("goal", fmt::format("{}: not known before bodies are prepared; --work DIR tells",
                                     fmt::join(start.asked_too, ", ")));
  text += line("to prepare",
               start.prepared
                   ? "done"
                   : fmt::format("about {:.2g} CPU s, by the number of triangles; may be twice or half "
                                 "that",
                                 *found.prepare_cpu_s));
  if (found.lacks.empty()) text += line("to plan", words_of(start.tried));
  if (!start.paint_s)
    return text +
           line("to film", fmt::format("{:g} frames a second of motion; --still FILE.png paints one and "
                                       "tells how long that takes",
                                       start.frames_a_second));
  return text +
         line("to film",
              fmt::format("painting the still took {:.2g} s; at that, {:g} frames a second of motion "
                          "take {:.2g} s, shared by the threads",
                          *start.paint_s, start.frames_a_second, start.frames_a_second * *start.paint_s)) +
         line("still", still->string());
}

}  // namespace

Outcome check_scene(const SceneCheckOptions& options) {
  const SceneFindings found = examine_scene(options, at_terminal());
  const bool good = found.problems.empty(), to_plan = found.lacks.empty();
  Json json = json_of(found);
  std::string text;
  for (const Json& body : json.value("bodies", Json::array())) text += line_of_body(body);
  if (found.pairs)
    for (const NearPair& pair : *found.pairs) text += text_of(pair, found.contact_offset_m.value_or(0));
  if (found.start) {
    add_start(*found.start, options.still, json);
    text += text_of(found, *found.start, options.still);
  }
  json["problems"] = found.problems, json["warnings"] = found.warnings;
  json["can_be_planned"] = good && to_plan, json["can_be_simulated"] = good;
  if (good && !to_plan) text += line("no plan", found.lacks);
  for (const std::string& warning : found.warnings) text += line("warning", warning);
  for (const std::string& problem : found.problems) text += line("problem", problem);
  if (!good) json["error"] = found.problems.front(), json["exit_code"] = int(exit_bad_input);
  const char* const done = to_plan ? "planned" : "simulated";
  const std::string verdict = good ? fmt::format("can be {}", done)
                                   : fmt::format("cannot be {}: {} problem{}", done, found.problems.size(),
                                                 found.problems.size() == 1 ? "" : "s");
  return {good ? exit_done : exit_bad_input, json,
          fmt::format("{}: {}\n{}", found.file.string(), verdict, text)};
}

namespace {
constexpr std::chrono::milliseconds between_looks{200};
}

Outcome watch_still(StillOptions options) {
  for (;;) {
    const std::vector<fs::path> files = files_shown(options.scene, at_terminal());
    options.scene.scene = files.front().string();
    Edits edits(stamps_of(files));
    try {
      fmt::print("{}", cli::render_still(options).text);
      std::fflush(stdout);
    } catch (const InputError& error) {
      log::warn("{}", error.what());
    }
    do {
      throw_if_stopped();
      std::this_thread::sleep_for(between_looks);
    } while (!edits.are_done(stamps_of(files)));
  }
}

Outcome render_still(const StillOptions& options) {
  const WrittenStill still = paint_still(options, at_terminal());
  return {exit_done,
          {{"still", still.file.string()},
           {"size", {still.size_px.first, still.size_px.second}},
           {"camera", options.camera}},
          still.file.string() + "\n"};
}

Outcome write_storyboard(const StoryboardOptions& options) {
  const WrittenStoryboard made = paint_storyboard(options, at_terminal());
  return {exit_done,
          {{"storyboard", made.file.string()},
           {"size", {made.size_px.first, made.size_px.second}},
           {"cameras", made.cameras},
           {"moments", made.moments}},
          made.file.string() + "\n"};
}

}  // namespace limber::cli
