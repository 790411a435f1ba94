#include "limber/detail/world/prepare_scene.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"
#include "core/words.h"
#include "scenes/library.h"

namespace limber::detail {

PreparedScene prepare_scene(const ScenePrepareOptions& options) {
  const scenes::Scene scene =
      scenes::read_scene_file(scenes::find_scene(options.scene.scene), options.scene.sets);
  std::vector<std::string> known;
  for (const scenes::BodySpec& body : scene.bodies) known.push_back(body.name);
  for (const std::string& name : options.bodies)
    if (std::count(known.begin(), known.end(), name) == 0) {
      const std::string meant = nearest(name, known);
      throw InputError(fmt::format("--body {}: {} has no such body{}; it has {}", name, options.scene.scene,
                                   meant.empty() ? "" : fmt::format(" (did you mean {}?)", meant),
                                   fmt::join(known, ", ")));
    }
  std::vector<std::size_t> asked;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (options.bodies.empty() ||
        std::count(options.bodies.begin(), options.bodies.end(), scene.bodies[b].name) > 0)
      asked.push_back(b);
  const std::vector<BodyReport> reports =
      prepare_bodies_of(scene, asked, options.scene.data, options.out, options.scene.store);
  keep_stiffness_shares(scene, asked, options.out);
  PreparedScene prepared{.bodies = {}, .bodies_of_scene = known.size()};
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const scenes::BodySpec& body = scene.bodies[asked[i]];
    prepared.bodies.push_back({body.name, body_folder(options.out, body), reports[i].surface.triangles,
                               reports[i].cage.value().tets});
  }
  if (options.bodies.empty()) prepare_beside(scene, options.scene.data, options.out);
  return prepared;
}

}  // namespace limber::detail
