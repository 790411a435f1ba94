// The text of a new scene: its bodies, where they go, who looks at them from where, the film.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/authoring/organs.h"

namespace limber::detail {

// What comes to the organ that the story is about: "instrument", "endoscope", "balloon"; empty: nothing does.
std::string tool_name(Story);
// Whether the organ that the story is about is what moves.
bool organ_moves(const NewSceneOptions&);
// Of organs that have come apart at that scale.
std::string scene_text(const std::vector<Organ>&, const NewSceneOptions&, double scale);

}  // namespace limber::detail
