#include "cli/scene_text.h"

#include <fmt/format.h>

namespace limber::cli {

std::string line_of_body(const Json& body) {
  std::string text = fmt::format("  body         {}: {}", body.at("name").get<std::string>(),
                                 body.at("role").get<std::string>());
  if (body.contains("kind")) text += ", " + body.at("kind").get<std::string>();
  if (body.contains("contact"))
    text += fmt::format(", touched at its {}", body.at("contact").get<std::string>());
  if (body.contains("triangles"))
    text += fmt::format("; {} triangles of {}", body.at("triangles").get<std::int64_t>(),
                        body.at("model").get<std::string>());
  else if (body.contains("model"))
    text += "; " + body.at("model").get<std::string>();
  if (body.contains("tets_asked"))
    text += fmt::format(", {} tets asked for", body.at("tets_asked").get<int>());
  if (body.contains("cells")) text += fmt::format(", cells {}", body.at("cells").dump());
  if (body.contains("cell_m")) text += fmt::format(", cells of {} m", body.at("cell_m").get<double>());
  if (body.contains("size_m"))
    text += fmt::format("; {:.3g} x {:.3g} x {:.3g} m", body.at("size_m")[0].get<double>(),
                        body.at("size_m")[1].get<double>(), body.at("size_m")[2].get<double>());
  if (body.contains("material")) {
    const Json& m = body.at("material");
    if (m.contains("youngs_modulus_pa"))
      text += fmt::format("; {}, {:.4g} Pa, Poisson {}", m.at("model").get<std::string>(),
                          m.at("youngs_modulus_pa").get<double>(), m.at("poisson_ratio").get<double>());
    if (m.contains("density_kg_m3"))
      text += fmt::format(", {:.4g} kg/m3", m.at("density_kg_m3").get<double>());
  }
  return text + "\n";
}

std::string text_of_scene(const Json& scene) {
  std::string text = fmt::format("{}: {}\n", scene.at("name").get<std::string>(),
                                 scene.at("description").get<std::string>());
  for (const Json& body : scene.at("bodies")) text += line_of_body(body);
  text +=
      scene.contains("preset")
          ? fmt::format("  goals        {}\n  planner      {}, {} iterations\n", scene.at("goals").get<int>(),
                        scene.at("preset").get<std::string>(), scene.at("iterations").get<std::int64_t>())
          : "  goals        none; it can be simulated\n";
  const Json& film = scene.at("film");
  return text + fmt::format(
                    "  film         {} x {}, {} frames a second, cameras: {}\n"
                    "limber scene check {} loads its models and says more\n",
                    film.at("size_px")[0].get<int>(), film.at("size_px")[1].get<int>(),
                    film.at("frames_per_second").get<int>(), film.at("cameras").get<int>(),
                    scene.at("scene").get<std::string>());
}

}  // namespace limber::cli
