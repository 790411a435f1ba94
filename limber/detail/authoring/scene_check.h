// What a user wants to know of a scene before hours of planning: docs/cli.md.
#pragma once

#include "limber/authoring.h"

namespace limber::detail {

// What can be said of a scene before it is planned. Throws InputError where the still cannot be painted.
SceneFindings check_scene(const SceneCheckOptions&);

}  // namespace limber::detail
