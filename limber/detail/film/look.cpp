#include "limber/detail/film/look.h"

#include "core/error.h"

namespace limber::detail {

namespace {

struct Light {
  Vec3 zenith, horizon, ground, far_ground;  // sRGB
  Vec3 key, sky;                             // linear
  double key_size_deg;
};

Light light_of(scenes::FilmLook look) {
  switch (look) {
    case scenes::FilmLook::studio:  // a warm lamp in a cool room
      return {{0.56, 0.64, 0.73},
              {0.83, 0.865, 0.90},
              {0.90, 0.885, 0.86},
              {0.80, 0.79, 0.775},
              {0.92, 0.83, 0.72},
              {0.34, 0.39, 0.46},
              7};
    case scenes::FilmLook::dark:
      return {{0.035, 0.04, 0.055},
              {0.12, 0.135, 0.165},
              {0.23, 0.225, 0.225},
              {0.075, 0.08, 0.095},
              {1.02, 0.92, 0.78},
              {0.19, 0.235, 0.30},
              6};
    case scenes::FilmLook::clinical:
      return {{0.72, 0.83, 0.87},
              {0.93, 0.965, 0.975},
              {0.945, 0.965, 0.965},
              {0.77, 0.86, 0.88},
              {0.72, 0.735, 0.74},
              {0.44, 0.475, 0.49},
              12};
    case scenes::FilmLook::paper:  // as good as no place at all
      return {{0.965, 0.957, 0.937},
              {0.965, 0.957, 0.937},
              {0.965, 0.957, 0.937},
              {0.965, 0.957, 0.937},
              {0.64, 0.63, 0.61},
              {0.50, 0.50, 0.50},
              14};
  }
  LIMBER_CHECK(false, int(look));
}

struct Substance {
  double translucency, scatter;  // of the body's size
  double sheen;
  double grain, wavelength;  // of the body's size
  bool woven;
};

Substance substance_of(scenes::BodyLook look) {
  switch (look) {
    case scenes::BodyLook::plain:
      return {0, 0.03, 0, 0, 0.01, false};
    case scenes::BodyLook::rubber:
      return {0.5, 0.022, 0.1, 0.06, 0.006, false};
    case scenes::BodyLook::tissue:
      return {0.8, 0.04, 0.05, 0.16, 0.02, false};
    case scenes::BodyLook::bone:
      return {0.25, 0.015, 0, 0.25, 0.008, false};
    case scenes::BodyLook::fabric:
      return {0.2, 0.02, 1, 0.5, 0.012, true};
    case scenes::BodyLook::skin:
      return {0.7, 0.03, 0.15, 0.25, 0.006, false};
  }
  LIMBER_CHECK(false, int(look));
}

}  // namespace

void set_light(render::RenderSettings& look, const scenes::FilmSpec& film) {
  const Light light = light_of(film.look);
  look.background_top_srgb = light.zenith, look.background_bottom_srgb = light.horizon;
  look.ground_srgb = light.ground, look.far_ground_srgb = light.far_ground;
  look.key_light = light.key, look.sky_light = light.sky, look.key_size_deg = light.key_size_deg;
  if (!film.background_srgb) return;
  look.background_top_srgb = look.background_bottom_srgb = *film.background_srgb;
  look.far_ground_srgb = film.background_srgb;
}

render::MeshLook look_of(const scenes::BodySpec& body, double size_m) {
  const Substance substance = substance_of(body.look);
  return {.name = body.name,
          .color_srgb = body.color_srgb,
          .roughness = body.roughness,
          .metallic = body.metallic,
          .opacity = body.opacity,
          .sheet = true,
          .translucency = substance.translucency,
          .scatter_m = substance.scatter * size_m,
          .sheen = substance.sheen,
          .grain = substance.grain,
          .grain_m = substance.wavelength * size_m,
          .woven = substance.woven};
}

}  // namespace limber::detail
