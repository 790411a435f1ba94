#include "limber/detail/authoring/scene_facts.h"

namespace limber::detail {

namespace {

const char* name_of(scenes::Role role) {
  switch (role) {
    case scenes::Role::robot:
      return "robot";
    case scenes::Role::obstacle:
      return "obstacle";
    case scenes::Role::free:
      return "free";
    case scenes::Role::scenery:
      break;
  }
  return "scenery";
}

}  // namespace

bool moves(const scenes::BodySpec& body) {
  return body.kind == scenes::Kind::deformable || body.role != scenes::Role::obstacle;
}

Json facts_of(const scenes::BodySpec& body) {
  Json json{{"name", body.name}, {"role", name_of(body.role)}};
  if (body.role == scenes::Role::scenery) return json;
  json["kind"] = body.kind == scenes::Kind::rigid ? "rigid" : "deformable";
  const scenes::MaterialSpec& m = body.material;
  json["contact"] = body.contact == scenes::Contact::cage ? "cage" : "surface";
  if (body.cage.tets > 0) json["tets_asked"] = body.cage.tets;
  if (body.cage.cells.x() > 0)
    json["cells"] = {body.cage.cells.x(), body.cage.cells.y(), body.cage.cells.z()};
  if (body.cage.cell_m > 0) json["cell_m"] = body.cage.cell_m;
  json["material"] = {{"friction", m.friction}};
  if (moves(body)) json["material"]["density_kg_m3"] = m.density_kg_m3;
  if (body.kind == scenes::Kind::deformable)
    json["material"].update(
        {{"model", m.model}, {"youngs_modulus_pa", m.youngs_modulus_pa}, {"poisson_ratio", m.poisson_ratio}});
  return json;
}

Json facts_of_scene(const fs::path& file) {
  const scenes::Scene scene = scenes::read_scene_file(file);
  Json json{{"scene", file.string()}, {"name", scene.name}, {"description", scene.description}};
  for (const auto* bodies : {&scene.bodies, &scene.scenery})
    for (const scenes::BodySpec& body : *bodies) json["bodies"].push_back(facts_of(body));
  const bool to_plan = scene.lacks.empty();
  json["goals"] = to_plan ? scene.via.size() + 1 : 0;
  if (to_plan) json["preset"] = scene.planner.preset, json["iterations"] = scene.planner.iterations;
  json["film"] = {{"size_px", {scene.film.width_px, scene.film.height_px}},
                  {"frames_per_second", scene.film.frames_per_second},
                  {"cameras", scene.cameras.size()}};
  return json;
}

}  // namespace limber::detail
