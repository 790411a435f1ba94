#include "core/state.h"

#include <algorithm>

#include "core/hash.h"

namespace limber {

std::uint64_t hash_of(const State& state) {
  return Hasher()
      .value(state.step)
      .values(std::span(state.positions))
      .values(std::span(state.velocities))
      .digest();
}

float largest_force(const Control& control) {
  switch (control.manipulation) {
    case Manipulation::none:
      return 0;
    case Manipulation::body:
      return control.force_n.norm();
    case Manipulation::control_point:
      return std::max(control.force_n.norm(), control.second_force_n.norm());
    case Manipulation::interpolation:
    case Manipulation::hold:
      return control.max_force_n;
  }
  return 0;
}

}  // namespace limber
