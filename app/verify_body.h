// Checks of a body's folder: what its files say of one another, and what a scene says of it.
#pragma once

#include "app/body.h"
#include "app/promises.h"
#include "app/scene_world.h"

namespace limber::app {

// By the files alone.
void check_body(const std::string& name, const PreparedBody&, const fs::path& folder, Promises&);

// By the scene: its model, placed as the scene says.
void check_origin(const std::string& name, const Origin&, Promises&);

}  // namespace limber::app
