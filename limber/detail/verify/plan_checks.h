// The checks of a plan or a simulation, one file a subject. Each adds rows to the table of promises, which
// docs/verify.md lists; none throws for a promise that is broken. Private to the checks of a folder's motion
// (verify_plan.cpp).
//
// What holds for all: the scene's text is taken for granted, and nothing that the plan says of itself. A
// figure is worked out again from scene, bodies and controls, and compared. Numbers that the same code makes
// are compared bit for bit, for limber promises the same bytes for the same input.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/verify/promises.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/fem_system.h"
#include "plan/control_rollout.h"

namespace limber::detail {

// A force in float32 may be so much longer than its length in double.
constexpr double rounding_factor = 1 + 1e-6;

// The first key at which two JSON documents differ, "" where they are the same.
std::string first_difference(const Json& a, const Json& b);

// The path as the world has it: its controls, run again from the world's start, with a state at every frame.
// The system's own judgement of states is not asked for; what a frame must keep to is measured afterwards.
class Replay {
 public:
  Replay(const FemSystem& system, const plan::Plan& plan, const plan::Settings& settings) {
    course_.from = system.start();
    course_.controls = plan.trajectory.controls;
    plan::run(system, settings, {&course_, 1},
              {.settle = plan::ControlRolloutOptions::never,
               .keep_frames = true,
               .ask_acceptable = false,
               .stoppable = true});
  }
  bool whole() const { return course_.states.size() == course_.controls.size(); }
  const plan::ControlRollout& course() const { return course_; }
  // After so many controls; the last good state where the dynamics diverged before.
  const State& after(std::size_t controls) const {
    const std::size_t there = std::min(controls, course_.states.size());
    return there == 0 ? course_.from : course_.states[there - 1];
  }

 private:
  plan::ControlRollout course_;
};

// Where the motion begins (check_beginning.cpp). check_start: where bodies overlapped in the scene and were
// parted; nothing where none did.
void check_start(const plan::Plan&, const fem::World&, Promises&);
void check_beginning(const fs::path& folder, const PlanFolder&, const fem::World&, Promises&);

// The path, the way through the tree and the replay are one (check_path.cpp).
void check_path(const plan::Plan&, const plan::Settings&, const Replay&, Promises&);

// The search once more (check_search.cpp).
void check_search(const PlanFolder&, const FemSystem&, const plan::Settings&, Promises&);

// Outcome, figures and what the summary tells (check_claims.cpp).
void check_claims(const PlanFolder&, const fem::World&, const FemSystem&, const plan::Settings&,
                  const MotionFigures&, Promises&);

// All of a motion on which nothing was searched (check_simulation.cpp). `figures` are overwritten.
void check_simulation(const fs::path& folder, const PlanFolder&, const std::vector<PreparedBody>&,
                      const fem::World&, MotionFigures& figures, Promises&);

}  // namespace limber::detail
