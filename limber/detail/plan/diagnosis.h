// Why no plan was found, as far as can be known: what stands in the way at the nearest node, and whether
// rigid geometry forbids it.
#pragma once

#include <string>

#include "core/json.h"
#include "limber/detail/world/fem_system.h"
#include "plan/search.h"

namespace limber::detail {

struct Diagnosis {
  std::string text;             // sentences that follow plan::explain's
  double widest_passage_m = 0;  // between rigid bodies and walls to the goal, a ball's radius; −1: none
  double robot_radius_m = 0;    // of the largest ball in the robot
  Json json;                    // all of it
};
Diagnosis diagnose(const fem::World&, const FemSystem&, const plan::Plan&);

}  // namespace limber::detail
