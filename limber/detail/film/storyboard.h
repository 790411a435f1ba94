// One sheet of a scene before it is planned: what each camera sees at the start, at each goal and at the end,
// with the ways that are to be gone. docs/rendering.md, "Before the plan".
#pragma once

#include "limber/detail/world/scene_world.h"
#include "limber/film.h"

namespace limber::detail {

// Throws InputError as Shot does, and where `out` does not end in .png.
WrittenStoryboard write_storyboard(const StoryboardOptions&);

}  // namespace limber::detail
