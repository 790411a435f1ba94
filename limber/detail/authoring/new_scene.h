// A scene to begin with, from models in one frame, a scan or an atlas. docs/imaging.md.
#pragma once

#include "core/file.h"
#include "limber/authoring.h"

namespace limber::detail {

// Writes the scene, and the models of a scan or an atlas beside it. Throws InputError, DiskError.
NewScene new_scene(const NewSceneOptions&);

}  // namespace limber::detail
