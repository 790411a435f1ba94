#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "core/error.h"
#include "core/words.h"
#include "limber/detail/body/body_store.h"
#include "limber/detail/commands.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/library.h"

namespace limber::detail {

Outcome prepare_scene(const ScenePrepareOptions& options) {
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
  std::optional<BodyStore> store;
  if (!options.scene.store.empty()) store.emplace(options.scene.store);
  Json made = Json::array();
  std::string text;
  for (const scenes::BodySpec& body : scene.bodies) {
    if (!options.bodies.empty() && std::count(options.bodies.begin(), options.bodies.end(), body.name) == 0)
      continue;
    const Json report =
        prepare_body_of(scene, body, options.scene.data, options.out, store ? &*store : nullptr);
    const Json &surface = report.at("surface"), &cage = report.at("cage");
    made.push_back({{"body", body.name},
                    {"folder", body_folder(options.out, body).string()},
                    {"triangles", surface.at("triangles")},
                    {"tets", cage.at("tets")}});
    text += fmt::format("  {:16} {} triangles, {} tets\n", body.name, surface.at("triangles").get<int>(),
                        cage.at("tets").get<int>());
  }
  if (options.bodies.empty()) prepare_beside(scene, options.scene.data, options.out);
  return {exit_done,
          {{"out", options.out.string()}, {"bodies", made}},
          fmt::format("{}: {} of {} bodies are prepared\n", options.out.string(), made.size(), known.size()) +
              text};
}

}  // namespace limber::detail
