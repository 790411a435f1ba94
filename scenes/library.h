// Where scenes and models are found.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/file.h"

namespace limber::scenes {

// The folders of scenes that come with limber, in the order in which they are searched: those in
// LIMBER_SCENES (separated by colons), share/limber/scenes beside the folder of the program or library, or
// above it, the source tree it was built from. Only those that exist.
std::vector<fs::path> scene_folders();

struct KnownScene {
  std::string name;
  fs::path file;
};
std::vector<KnownScene> known_scenes();  // by name; the first folder that has a name wins

// A scene file, a folder that holds scene.toml, or the name of a known scene. Throws InputError that lists
// the known names and the nearest one.
fs::path find_scene(const std::string& name_or_path);

// A model file named in a scene: an absolute path as it is; else in `folders` in their order (the scene's
// own, --data), then in the cache of models, where the set-up step of a scene puts what it fetches.
std::optional<fs::path> find_model(const std::string& file, const std::vector<fs::path>& folders);

// $LIMBER_MODELS, or limber/models in $XDG_CACHE_HOME or ~/.cache.
fs::path model_cache();

// What to tell the user when find_model found nothing: the places searched and, where the scene has one, its
// set-up step.
std::string how_to_get_model(const std::string& file, const std::vector<fs::path>& folders);

}  // namespace limber::scenes
