// What a user wants to know of a scene before hours of planning: docs/cli.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/json.h"
#include "limber/detail/world/goal_terms.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {

struct SceneCheckOptions {
  SceneOptions scene;
  std::string preset;             // empty: the scene's
  std::optional<fs::path> work;   // a work folder: bodies are prepared there, and a search is tried
  std::optional<fs::path> still;  // a PNG of the start
  std::string camera = "main", size;
};

// Two surfaces in one another, or so near that they push.
struct NearPair {
  std::string body, other;
  double depth_m = 0, of_robot_size = 0;
  std::optional<bool> parted;  // of those that overlap: before a plan begins
  double gap_m = 0;            // of those that do not
};
struct TriedSearch {
  std::int64_t iterations = 0, of_all = 0;
  double wall_s = 0, all_wall_s = 0;  // all: estimated
  bool solved = false;
};
struct StartFindings {
  bool prepared = false;
  std::optional<double> dt_s;
  std::vector<GoalTerm> goal;  // where it is not prepared, of the middles of surfaces
  Json rigid_passage;          // as Diagnosis has it; null where nothing was tried
  std::optional<TriedSearch> tried;
  double frames_a_second = 0;     // of the film, a second of motion
  std::optional<double> paint_s;  // of the still
};
// As far as the check came: the first problems leave out what needs a scene without them.
struct SceneFindings {
  fs::path file;
  std::vector<std::string> problems, warnings;
  std::string lacks;                       // what a search would need; empty: nothing
  std::vector<Json> bodies;                // as facts_of has them, with what their models are
  std::optional<double> prepare_cpu_s;     // estimated
  std::optional<double> contact_offset_m;  // where contact is on surfaces
  std::optional<std::vector<NearPair>> pairs;
  std::optional<bool> film_possible;
  std::optional<StartFindings> start;
};
// What can be said of a scene before it is planned. Throws InputError where the still cannot be painted.
SceneFindings check_scene(const SceneCheckOptions&);

}  // namespace limber::detail
