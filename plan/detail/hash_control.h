#pragma once

#include "core/hash.h"
#include "core/state.h"

namespace limber::plan::detail {

inline void hash_control(Hasher& hasher, const Control& c) {
  hasher.value(std::int32_t(c.manipulation))
      .value(c.node)
      .value(c.radius_m)
      .value(c.max_force_n)
      .value(c.steps);
  hasher.matrix(c.force_n).matrix(c.target_m);
  if (c.second_node >= 0) hasher.value(c.second_node).matrix(c.second_force_n);
  if (c.pressure_pa != 0) hasher.text("pressure").value(c.pressure_pa);
}

}  // namespace limber::plan::detail
