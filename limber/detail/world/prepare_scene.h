// The bodies of a scene in its work folder, as plan and run would make them first.
#pragma once

#include "limber/detail/world/scene_world.h"

namespace limber::detail {

struct ScenePrepareOptions {
  SceneOptions scene;
  fs::path out;
  std::vector<std::string> bodies;  // these alone; empty: all, and what the scene has beside them
};
struct PreparedScene {
  struct Body {
    std::string name;
    fs::path folder;
    int triangles = 0, tets = 0;
  };
  std::vector<Body> bodies;  // that were asked for
  std::size_t bodies_of_scene = 0;
};
// Of several machines each may make some of them. Throws InputError, DiskError.
PreparedScene prepare_scene(const ScenePrepareOptions&);

}  // namespace limber::detail
