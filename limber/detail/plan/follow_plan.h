// A plan of another folder, followed by feedback in a world that may be another.
#pragma once

#include <memory>

#include "limber/detail/plan/plan_folder.h"
#include "plan/follow.h"

namespace limber::detail {

class FollowedPlan {
 public:
  // Scene and world, which must outlive it, are those in which it is followed. Throws InputError where the
  // folder holds no plan from its scene's start that reaches its goal, or the scene is not to be planned with
  // or has another robot.
  FollowedPlan(const fs::path& folder, const scenes::Scene&, const fem::World&);

  // Chosen by plan::Follower from its state alone.
  Control next(const State& state) const { return follower_->next(state); }
  double duration_s() const { return duration_s_; }  // of the plan, its settle included
  // What a summary tells of it: the plan, and how the simulation keeps to it and ends. `from` is the folder
  // to which the plan's is told.
  FollowingTold facts(const plan::Plan& simulation, const fs::path& from) const;

 private:
  fs::path folder_;
  std::string trajectory_hash_;
  plan::Settings settings_;  // of the scene in which it is followed
  std::unique_ptr<FemSystem> system_;
  std::unique_ptr<plan::Follower> follower_;
  double duration_s_ = 0;
};

}  // namespace limber::detail
