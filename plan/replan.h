// Follows a path by feedback and looks ahead: where following from the state that was reached would not end
// in the goal, as far as the planner knows the world, it plans anew from there. Method and figures:
// docs/planning.md.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "plan/follow.h"

namespace limber::plan {

struct ReplanOptions {
  double every_s = 0.2;           // of the motion, from one look to the next; > 0
  std::int64_t iterations = 400;  // of a search, at most
  int searches = 8;               // at most
};

class Replanner {
 public:
  // A system that begins in this state. What one makes is used as long as the replanner lives.
  using From = std::function<std::unique_ptr<const System>(const State&)>;
  // `known`: the world as the planner has it; `acting`: as it is, with another time step perhaps. `guide` is
  // of the known one, from `start`, in steps of the acting one. Settings with one goal; they must outlive it.
  Replanner(From known, From acting, const State& start, const Settings&, Guide guide, const ReplanOptions&);

  // As ControlRollout::next, from the start on. Where all goes as planned these are a Follower's controls.
  // A function of the states that it was asked about, in their order. Throws Interrupted.
  std::optional<Control> next(const State&);

  int looks() const { return looks_; }
  int searches() const { return searches_; }        // what looks made of it,
  int plans_found() const { return plans_found_; }  // and how many of them found a way

 private:
  // Where the present guide begins, in both worlds.
  struct Stage {
    std::unique_ptr<const System> known, acting;
    Follower in_known, in_acting;
    Stage(std::unique_ptr<const System> known_, std::unique_ptr<const System> acting_, const Settings&,
          Guide);
  };
  State as_known(State) const;
  bool gets_there(const State& known) const;
  void plan_from(const State&);

  const From known_, acting_;
  const Settings& settings_;
  const ReplanOptions options_;
  std::optional<Stage> stage_;
  double next_look_s_;
  int looks_ = 0, searches_ = 0, plans_found_ = 0;
};

}  // namespace limber::plan
