// What a scene file says, without its models.
#pragma once

#include "core/json.h"
#include "scenes/scene.h"

namespace limber::detail {

// It is not held for good where the scene has it.
bool moves(const scenes::BodySpec&);
Json facts_of(const scenes::BodySpec&);
// Throws InputError where it is no scene.
Json facts_of_scene(const fs::path& file);

}  // namespace limber::detail
