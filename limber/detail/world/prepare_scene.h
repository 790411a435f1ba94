// The bodies of a scene in its work folder, as plan and run would make them first.
#pragma once

#include "limber/detail/world/scene_world.h"
#include "limber/motion.h"

namespace limber::detail {

// Of several machines each may make some of them. Throws InputError, DiskError.
PreparedScene prepare_scene(const ScenePrepareOptions&);

}  // namespace limber::detail
