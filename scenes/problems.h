// All that is wrong with a scene's text at once.
#pragma once

#include <string>
#include <vector>

namespace limber::scenes {

// The complaints of read_scene (scenes/scene.h) about the text, as far as one does not hide others; none
// where it takes it.
std::vector<std::string> problems_of(const std::string& text, const std::string& name_for_messages,
                                     const std::vector<std::string>& sets = {});

}  // namespace limber::scenes
