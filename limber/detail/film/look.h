// What films look like: the presets of light behind film.look, and of materials behind bodies[].look.
#pragma once

#include "render/renderer.h"
#include "scenes/scene.h"

namespace limber::detail {

// Light, ground and background; what else there is in a RenderSettings is left as it is.
void set_light(render::RenderSettings&, const scenes::FilmSpec&);

// size_m: of the body's surface at rest, corner to corner of its box; reliefs and the depth to which light
// gets are shares of it, so that a toy and an organ are seen to be of the same material.
render::MeshLook look_of(const scenes::BodySpec&, double size_m);

}  // namespace limber::detail
