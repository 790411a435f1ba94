// A plan replayed in worlds that are a little different: a report, no verdict.
#pragma once

#include "limber/robust.h"

namespace limber::detail {

// Throws InputError where the folder holds no plan from its scene's start that reaches its goal.
Robustness robust(const RobustOptions&);

}  // namespace limber::detail
