// New scenes from models, a scan or an atlas, and what is to be known of a scene before hours of planning.
// docs/imaging.md, docs/scene.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "limber/scene.h"

namespace limber {

// What a new scene tells of the model that it is about: it goes away, past all that lies in its way; an
// instrument comes to it, or a soft endoscope, or a balloon that is blown up there; it is moved aside; or
// nothing moves but the cameras.
enum class Story { away, instrument, endoscope, balloon, aside, tour };

struct NewSceneOptions {
  std::filesystem::path from = {};    // models in one frame: a folder, a label map, an atlas
  std::filesystem::path out = {};     // the scene file to write
  std::filesystem::path labels = {};  // names of a label map's labels; empty: as it has them
  std::string robot = {};             // the model that it is about
  Story story = Story::away;
  std::vector<std::string> only = {};  // names without ending, labels, an atlas' names or ids; empty: all
  std::vector<std::string> see_through = {}, rigid = {};  // besides those whose names say so
  double scale = 0.001;                                   // metres a file unit
  double shrink = 1;                                      // at most so much of every organ's true size
  int tets = 160;                                         // of a soft cage
  // Of soft organs but the robot: hung in their places, under gravity; 0: held at their backs.
  double fascia_hz = 0;
  std::string up = "+z", front = "-y";
  // front, back, left, right, up, down; empty: front, or aside to where least is in the way.
  std::string goal = {};
  // Of a label map: as of ModelOptions.
  double label_gap = 0.2;
  int label_rounds = 10;
  double min_island = 8;
};

struct NewScene {
  std::filesystem::path file;
  std::size_t bodies = 0, scenery = 0;
  double scale = 1;  // of their true size
  // Bodies that are not at their true place, and how far from it.
  std::vector<std::pair<std::string, double>> moved_m;
  std::vector<std::string> notes;
  std::filesystem::path data;  // the folder that planning it must be told, or empty
  bool plannable = true;       // else it is simulated
};
// Writes the scene, and the models of a scan or an atlas beside it. Throws InputError, DiskError.
LIMBER_API NewScene make_scene(const NewSceneOptions&, const Context& = {});

struct SceneCheckOptions {
  SceneSource scene = {};
  std::string preset = {};  // empty: the scene's
  // A work folder: bodies are prepared there, and a search is tried.
  std::optional<std::filesystem::path> work = {};
  std::optional<std::filesystem::path> still = {};  // a PNG of the start
  std::string camera = "main", size = {};           // of the still, as of FilmOptions
};

// What a goal asks for, term by term.
struct GoalTerm {
  std::string asked;  // "centre of mass within 0.3 m of (3.2 1 1)"
  bool met;
  std::string found;
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
  std::vector<GoalTerm> goal;          // where it is not prepared, of the middles of surfaces
  std::vector<std::string> asked_too;  // keys of the goal that only prepared bodies can answer
  std::string rigid_passage_json;  // the text of a JSON object (docs/cli.md); empty where nothing was tried
  std::optional<TriedSearch> tried;
  double frames_a_second = 0;     // of the film, a second of motion
  std::optional<double> paint_s;  // of the still
};
// As far as the check came: the first problems leave out what needs a scene without them.
struct SceneFindings {
  std::filesystem::path file;
  std::vector<std::string> problems, warnings;
  std::string lacks;                       // what a search would need; empty: nothing
  std::vector<std::string> bodies_json;    // of each what the scene says, and what its model is
  std::optional<double> prepare_cpu_s;     // estimated
  std::optional<double> contact_offset_m;  // where contact is on surfaces
  std::optional<std::vector<NearPair>> pairs;
  std::optional<bool> film_possible;
  std::optional<StartFindings> start;
};
// What can be said of a scene before it is planned. Throws InputError where the still cannot be painted.
LIMBER_API SceneFindings examine_scene(const SceneCheckOptions&, const Context& = {});

}  // namespace limber
