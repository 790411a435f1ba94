// Which steps the frames of a path show.
#pragma once

#include <cmath>
#include <cstdint>

#include "plan/settings.h"

namespace limber::plan {

struct FrameTimes {
  std::int64_t first_step = 0;  // of the path
  double steps_per_frame = 1;   // below 1, some steps are shown several times

  FrameTimes(const System& system, double frames_per_second)
      : FrameTimes(system.start().step, system.dt_s(), frames_per_second) {}
  FrameTimes(std::int64_t first, double dt_s, double frames_per_second)
      : first_step(first), steps_per_frame(1 / (frames_per_second * dt_s)) {}

  // The whole step nearest to frame / frames_per_second.
  std::int64_t step_of(std::int64_t frame) const {
    return first_step + std::llround(double(frame) * steps_per_frame);
  }
  // The first frame that is shown at `step` or later.
  std::int64_t frame_from(std::int64_t step) const {
    auto frame = std::int64_t(double(step - first_step) / steps_per_frame);
    while (frame > 0 && step_of(frame - 1) >= step) --frame;
    while (step_of(frame) < step) ++frame;
    return frame;
  }
  std::int64_t next_step(std::int64_t step) const { return step_of(frame_from(step + 1)); }
};

}  // namespace limber::plan
