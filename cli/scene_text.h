// Lines about scenes, read or checked.
#pragma once

#include <string>

#include "core/json.h"

namespace limber::cli {

// Of a body as facts_of(scenes::BodySpec) has it.
std::string line_of_body(const Json& body);
// Of facts_of_scene.
std::string text_of_scene(const Json& scene);

}  // namespace limber::cli
