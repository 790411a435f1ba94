// What a goal asks for, term by term: read from the scene and measured in the world, apart from the planner's
// own test of a goal (limber/detail/world/fem_system.h) and from what a plan says of itself.
#pragma once

#include <string>
#include <vector>

#include "fem/world.h"
#include "limber/authoring.h"
#include "scenes/scene.h"

namespace limber::detail {

// Where the robot is taken to be: its centre of mass, or that of its first patch where that leads.
Vec3 robot_place_m(const scenes::Scene&, const fem::World&, const State&);

// The place of the robot (moved along with goal.moves_with since the start), and then turn, shape,
// above, below, clear_of, volume and through, as far as the goal asks for them. Speed is not looked at.
std::vector<GoalTerm> terms_of(const scenes::Scene&, const scenes::Goal&, const fem::World&, const State&);

// Of the robot: its nodes' mean speed is below planner.settle_speed_m_s.
GoalTerm rest_term(const scenes::Scene&, const fem::World&, const State&);

// And it is no moment only, as where a body turns back: so every 0.01 s for the next 0.05 s too, under what
// held it at last.
GoalTerm stay_term(const scenes::Scene&, const fem::World&, const State&, Control held_by);

// With goal.lost_below_m: whether the goal is there still.
GoalTerm loss_term(const scenes::Scene&, const fem::World&, const State&);

}  // namespace limber::detail
