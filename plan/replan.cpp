#include "plan/replan.h"

#include <cmath>
#include <utility>

#include "core/error.h"
#include "plan/search.h"

namespace limber::plan {

Replanner::Stage::Stage(std::unique_ptr<const System> known_, std::unique_ptr<const System> acting_,
                        const Settings& settings, Guide guide)
    : known(std::move(known_)),
      acting(std::move(acting_)),
      in_known(*known, settings, guide),
      in_acting(*acting, settings, std::move(guide)) {}

Replanner::Replanner(From known, From acting, const State& start, const Settings& settings, Guide guide,
                     const ReplanOptions& options)
    : known_(std::move(known)), acting_(std::move(acting)), settings_(settings), options_(options) {
  LIMBER_CHECK(settings.via.empty() && options.every_s > 0, settings.via.size(), options.every_s);
  std::unique_ptr<const System> begins = acting_(start);
  next_look_s_ = double(start.step) * begins->dt_s() + options.every_s;
  // Where it begins is as planned, whatever the step is.
  State in_known = start;
  in_known.step = std::llround(double(start.step) * begins->dt_s() / guide.dt_s);
  stage_.emplace(known_(in_known), std::move(begins), settings_, std::move(guide));
}

State Replanner::as_known(State state) const {
  state.step = std::llround(double(state.step) * stage_->acting->dt_s() / stage_->known->dt_s());
  return state;
}

bool Replanner::gets_there(const State& known) const {
  ControlRollout course;
  course.from = known;
  course.next = [this](const State& state) -> std::optional<Control> {
    if (stage_->in_known.is_over(state)) return std::nullopt;
    return stage_->in_known.next(state);
  };
  run(*stage_->known, settings_, {&course, 1},
      {.settle = ControlRolloutOptions::anywhere, .ask_acceptable = false, .stoppable = true});
  return course.result == ControlRollout::rests_in_goal;
}

void Replanner::plan_from(const State& state) {
  const State from = as_known(state);
  std::unique_ptr<const System> known = known_(from);
  Settings settings = settings_;
  settings.seed += std::uint64_t(++searches_);
  settings.max_iterations = options_.iterations;
  const Plan found = plan(*known, settings);
  if (!found.solved()) return;
  ++plans_found_;
  Guide guide = guide_of(*known, settings_, found.trajectory);
  stage_.emplace(std::move(known), acting_(state), settings_, std::move(guide));
}

std::optional<Control> Replanner::next(const State& state) {
  const double now_s = double(state.step) * stage_->acting->dt_s();
  bool over = stage_->in_acting.is_over(state);
  if (over || now_s >= next_look_s_) {
    next_look_s_ = now_s + options_.every_s;
    ++looks_;
    if (searches_ < options_.searches && !gets_there(as_known(state))) {
      plan_from(state);
      over = stage_->in_acting.is_over(state);
    }
  }
  if (over) return std::nullopt;
  return stage_->in_acting.next(state);
}

}  // namespace limber::plan
