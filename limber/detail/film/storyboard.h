// One sheet of a scene before it is planned: what each camera sees at the start, at each goal and at the end,
// with the ways that are to be gone. docs/rendering.md, "Before the plan".
#pragma once

#include "limber/detail/world/scene_world.h"

namespace limber::detail {

struct StoryboardOptions {
  SceneOptions scene;
  std::string size;             // of one picture; empty: 640 pixels wide, of the film's shape
  std::optional<fs::path> out;  // a PNG; default: the scene's name-storyboard.png
};
struct WrittenStoryboard {
  fs::path file;
  std::pair<int, int> size_px;  // of the sheet
  std::vector<std::string> cameras, moments;
};
// Throws InputError as Shot does, and where `out` does not end in .png.
WrittenStoryboard write_storyboard(const StoryboardOptions&);

}  // namespace limber::detail
