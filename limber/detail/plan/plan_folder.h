// plan.npz with what it takes to rebuild its world: the scene's text, the edits made to it, and the hashes of
// the bodies; beside it timings.json, of what it cost, on which nothing depends.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "limber/detail/body/body.h"
#include "limber/detail/plan/plan_told.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/fem_system.h"
#include "plan/plan_file.h"
#include "plan/search.h"
#include "scenes/scene.h"

namespace limber::detail {

struct PlanFolder {
  plan::Plan plan;
  scenes::Scene scene;
  Json summary;  // as `limber plan --json` printed it; without costs where timings.json is not there
  std::uint64_t file_hash;                         // of plan.npz
  PlanTold told;                                   // of the summary
  std::map<std::string, std::string> cage_hashes;  // by body name
  std::string version;                             // of the limber that wrote it
  int edition;                                     // as plan::PlanFile
  bool sealed() const { return edition >= plan::first_sealed; }
};

// Of the summary what it cost goes to timings.json.
void write_plan_folder(const fs::path& folder, const plan::Plan&, const scenes::Scene&,
                       const std::vector<PreparedBody>&, const Json& summary);

// The summary as plan.npz and manifest.json have it: without costs, but in those of older limbers.
Json kept_summary(const PlanFolder&);

// Of what a signal ended nothing is measured, so that it ends at once: no figures, no pictures.
inline bool is_unmeasured(const plan::Plan& plan) {
  return !plan.measured || (plan.simulation && plan.simulation->ending == plan::Simulation::stopped);
}

// A stop signal came before the path to the nearest node was simulated (plan/search.h): it is the start
// alone.
inline bool lacks_path(const plan::Plan& plan) {
  return plan.trajectory.controls.empty() && plan.best_node != 0;
}

// All of a summary that follows from the plan: not what the dynamics cost, nor what came after the search.
Json facts_of(const plan::Plan&, const fem::World&, const FemSystem&, const MotionFigures&);

// The pictures that lie beside plan.npz, name → bytes.
std::map<std::string, std::string> pictures_of(const scenes::Scene&, const fem::World&, const plan::Plan&,
                                               const MotionFigures&);

// Throws InputError when plan.npz is missing, damaged, or not limber's.
PlanFolder read_plan_folder(const fs::path& folder);

// The same of a plan that was searched: throws InputError where the folder holds a simulation.
PlanFolder read_searched_folder(const fs::path& folder);

// The same, for what knows but motions from the scene's start: `what` says who.
PlanFolder read_folder_from_the_start(const fs::path& folder, const std::string& what);

// Whether it begins as a frame of another folder (its summary's "from"), not at the scene's start.
bool begins_elsewhere(const PlanFolder&);

// The system that the folder's motion is of, from where it began; of a simulation without a goal.
FemSystem system_of(const PlanFolder&, const fem::World&, const std::vector<PreparedBody>&);

// The first entry of plan.npz that limber would write otherwise, or not at all; "" where there is none.
std::string odd_entry(const fs::path& folder, const PlanFolder&, const std::vector<PreparedBody>&);

// Throws InputError where the plan's states, controls or frame times are none of this world: what follows
// would reach beyond its nodes, or replay without end.
void require_of_world(const plan::Plan&, const fem::World&, const fs::path& folder);

// Where a world has its bodies' shares of stiffness from: the summary, for what shows a motion; or they are
// found anew, for what judges it.
enum class StiffnessShares { told, found };
// The world of its scene, begun as the plan begins: bodies that overlap there are not parted once more.
fem::World world_of(const PlanFolder&, const std::vector<PreparedBody>&,
                    StiffnessShares = StiffnessShares::told);

// The bodies of the plan's scene. Throws InputError when a cage has changed since the plan was made.
std::vector<PreparedBody> read_caged_bodies_of(const PlanFolder&, const fs::path& folder);

// The bodies that the plan was made with, and their world, begun as the plan begins. Throws InputError when
// one has changed since, or the plan is not of their world.
struct BodiesAndWorld {
  std::vector<PreparedBody> bodies;
  fem::World world;
};
BodiesAndWorld read_world_of(const PlanFolder&, const fs::path& folder);

}  // namespace limber::detail
