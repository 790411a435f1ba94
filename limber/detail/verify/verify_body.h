// Checks of a body's folder: what its files say of one another, and what a scene says of it.
#pragma once

#include "limber/detail/body/body.h"
#include "limber/detail/verify/promises.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {

// By the files alone. `made_cage`: of a body in cells, where the scene is at hand. `remake`: shells, too, are
// made again, whatever that costs. Throws InputError where shells.obj is none.
void check_body(const std::string& name, const PreparedBody&, const fs::path& folder,
                const std::optional<TetMesh>& made_cage, bool remake, Promises&);

// By the model that the body must be of, read by the words of its report.
void check_model(const std::string& name, const PreparedBody&, const fs::path& model, Promises&);

// By the scene: its model, placed as the scene says, and the shape of its goal. Of a file that is not here
// nothing is promised; where it `must_be_here`, a promise is broken.
void check_origin(const std::string& name, const Origin&, bool must_be_here, Promises&);
void check_goal_cage(GoalCage, bool must_be_here, Promises&);

}  // namespace limber::detail
