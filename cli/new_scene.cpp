#include <fmt/format.h>

#include "cli/commands.h"

namespace limber::cli {

Outcome new_scene(const NewSceneOptions& options) {
  const NewScene made = make_scene(options, at_terminal());
  const std::string data = made.data.empty() ? std::string() : fmt::format(" --data {}", made.data.string()),
                    next =
                        made.plannable
                            ? fmt::format("limber run {}{} -o DIR", made.file.string(), data)
                            : fmt::format("limber simulate {}{} --duration 1.2s -o DIR && limber render DIR",
                                          made.file.string(), data);
  Json moved_m = Json::object();
  std::string text = fmt::format("{}: {} bodies at {:g} of their size, {} only seen\n", made.file.string(),
                                 made.bodies, made.scale, made.scenery);
  for (const auto& [name, way_m] : made.moved_m) {
    moved_m[name] = way_m;
    text += fmt::format("  {} stands {:.1f} mm off its true place\n", name, 1e3 * way_m);
  }
  for (const std::string& note : made.notes) text += fmt::format("  {}\n", note);
  text += fmt::format("next: {}\n", next);
  return {exit_done,
          {{"scene", made.file.string()},
           {"bodies", made.bodies},
           {"scenery", made.scenery},
           {"scale", made.scale},
           {"moved_m", moved_m},
           {"notes", made.notes},
           {"next", next}},
          text};
}

}  // namespace limber::cli
