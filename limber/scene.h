// From a scene to its motion: bodies, world, rollouts, plan. docs/library.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "limber/mesh.h"

namespace limber {

struct SceneOptions {
  std::string preset = {};                       // of the planner, "paper" or "fast"; empty: the scene's
  std::vector<std::string> sets = {};            // "planner.seed=7": edits made before it is read
  std::vector<std::filesystem::path> data = {};  // folders in which model files are looked for first
};

// A scene file that was read; never changes, cheap to copy.
class LIMBER_API Scene {
 public:
  const std::string& name() const;
  const std::string& text() const;  // TOML, as it was read
  std::vector<std::string> bodies() const;
  const std::string& robot() const;
  // Where the robot's centre of mass is to get, metres; nothing where the scene can only be simulated. The
  // goal may ask more, and may move (docs/scene.md).
  struct Goal {
    std::array<double, 3> center_of_mass_m{};
    double radius_m = 0;
  };
  std::optional<Goal> goal() const;
  double max_force_n() const;  // that the planner may push the robot with

  struct Impl;
  explicit Scene(std::shared_ptr<const Impl>);
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};
// A file, a folder that holds scene.toml, or the name of a scene that comes with limber. Throws InputError
// with file, line and column.
LIMBER_API Scene read_scene(const std::string& file_or_name, const SceneOptions& = {});
LIMBER_API std::vector<std::string> scene_names();

// Which scene, edited how, with models from where: what work folders are made from.
struct SceneSource {
  std::string scene = {};                        // a file, or the name of a scene that comes with limber
  std::vector<std::string> sets = {};            // as of SceneOptions
  std::vector<std::filesystem::path> data = {};  // likewise
  std::filesystem::path store = {};  // prepared bodies that models, scenes and machines share; empty: none
};

// Several states of a world. Node n of state s is at positions[3 (s · nodes + n)] and the two after it. They
// say nothing of which world they are: another with as many nodes takes them.
struct States {
  int count = 0, nodes = 0;
  std::vector<std::int64_t> steps;           // (count) time = step × World's dt_s
  std::vector<float> positions, velocities;  // (count × nodes × 3), metres, metres a second
  // (count) 0: the dynamics diverged, in this rollout or one before, and the state means nothing; else 1. Who
  // makes states may leave all of it out.
  std::vector<std::uint8_t> sound;
};

// One push of the robot, held for `steps`: no force; force_n on all of it; force_n on what is within radius_m
// of `node`; towards target_m, each node to its place in the goal's shape or all alike, with at most
// max_force_n. docs/planning.md.
struct Push {
  enum class Kind : std::int32_t { none, body, control_point, interpolation, hold };
  Kind kind = Kind::none;
  std::array<float, 3> force_n{};   // body, control_point: on the whole robot
  std::int32_t node = -1;           // control_point: of the robot, from 0
  float radius_m = 0;               // control_point
  std::array<float, 3> target_m{};  // interpolation, hold: of the centre of mass
  float max_force_n = 0;            // interpolation, hold
  std::int32_t steps = 0;           // > 0
  // control_point: another, pushed at the same time, as by a second carrier; −1: none
  std::int32_t second_node = -1;
  std::array<float, 3> second_force_n{};
  float pressure_pa = 0;  // of any kind, ≥ 0: blows a soft robot up meanwhile
};

struct SolveOptions {
  std::optional<std::int64_t> seed = {}, iterations = {};  // nothing: the scene's
  double time_limit_s = std::numeric_limits<double>::infinity();
  std::optional<int> shortcut_rounds = {};
  std::string cost = "duration";  // or "effort", "strain", "volume": what shortcuts make less of
  bool improve = false;           // go on after the first solution
};

struct SaveOptions {
  // As of PlanOptions: "all" nodes of the tree, or those of the "path" alone, where the search is finished.
  // What the film shows is not asked: limber render refuses film.tree of a path alone.
  std::string keep_tree = "all";
};

class Plan;

// A scene's bodies and the world they share, ready to be stepped; never changes, cheap to copy, and several
// threads may use it.
class LIMBER_API Problem {
 public:
  // Prepares bodies that are not up to date in the work folder; without one, in a temporary folder that goes
  // with the last copy.
  explicit Problem(const Scene&, const std::filesystem::path& work_folder = {}, const Context& = {});

  const Scene& scene() const;
  const std::vector<Body>& bodies() const;  // in the order of Scene::bodies()
  double dt_s() const;
  int nodes() const;  // of all that moves
  struct Range {
    int first = 0, count = 0;  // nodes; count 0: does not move
  };
  Range nodes_of(int body) const;  // throws InputError where there is no such body
  States start(int copies = 1) const;
  // Each state pushed by the push of its number, on all threads. A result depends on its state and push
  // alone. Throws InputError where numbers do not fit. A push may be stronger than the planner's max_force_n.
  States rollout(const States&, const std::vector<Push>&, const Context& = {}) const;
  std::vector<std::array<double, 3>> robot_centers(const States&) const;  // of mass, metres

  // As `limber plan`: the same scene and options, the same bytes. Where a watcher says stop, what was found
  // so far. Throws InputError where the scene has no goal, or an option is out of range.
  Plan solve(const SolveOptions& = {}, const Context& = {}) const;
  // As `limber plan --resume`: goes on from where `earlier` ended, with the same bytes as one search that was
  // not cut. Throws as solve() does, and where `earlier` is of another world or was searched otherwise.
  Plan resume(const Plan& earlier, const SolveOptions& = {}, const Context& = {}) const;
  // The scene left to itself, as `limber simulate`.
  Plan simulate(double duration_s, const Context& = {}) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }
  explicit Problem(std::shared_ptr<const Impl>);

 private:
  std::shared_ptr<const Impl> impl_;
};

// A motion that was planned or simulated; never changes, cheap to copy.
class LIMBER_API Plan {
 public:
  // Of a work folder. Throws InputError where it holds none, or another's bodies.
  static Plan load(const std::filesystem::path& folder);
  bool solved() const;
  std::string explanation() const;  // a sentence or two: reached or not, which limit ended it, what to try
  std::int64_t iterations() const;
  int nodes_in_tree() const;
  double duration_s() const;
  double frames_per_second() const;
  int frame_count() const;
  // The tree's and the path's: what `limber plan` prints as "hashes".
  std::string tree_hash() const, trajectory_hash() const;
  States frames() const;             // all of them
  std::vector<Push> pushes() const;  // from the start
  // The fine surface of a body, in the order of Scene::bodies(), at a frame from 0 on. Throws InputError
  // where there is no such body or frame.
  Vertices surface(int body, int frame) const;
  // What the command tells, as the text of a JSON object: docs/files.md.
  std::string summary_json(const Context& = {}) const;
  // plan.npz and all that `limber plan` leaves in a work folder, bodies included. The plan itself stays
  // whole. Throws InputError where an option is none, or it was read from another folder or with all of its
  // tree.
  void save(const std::filesystem::path& folder, const SaveOptions& = {}, const Context& = {}) const;
  const Problem& problem() const;

  struct Impl;
  explicit Plan(std::shared_ptr<const Impl>);
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace limber
