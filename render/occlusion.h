// How much of the sky each point of a coarse surface does not see: for Renderer::set_occlusion, after the
// values went from the coarse to the fine surface by the binding's weights.
#pragma once

#include <optional>
#include <span>

#include "core/mesh.h"

namespace limber::render {

struct Ground {
  Vec3 up = {0, 0, 1};
  double height_m = 0;  // along up; what is below hides nothing and is hidden itself
};

struct Occluder {
  const Points& positions;
  const Triangles& triangles;
};

// For each point (rows of points, with unit normals), the share of the cosine-weighted hemisphere over it
// that the triangles and the ground hide: 0 … 1. Surfaces may be wound either way and pass through one
// another. The directions are fixed in the world, so a resting scene does not flicker. What is smaller than
// one of the `cells` along the box round all triangles is lost, and points are taken as far off their
// surface. The renderer darkens the light of its own ground below bodies already: leave that ground out.
// Figures: docs/rendering.md.
Eigen::VectorXd sky_occlusion(const Points& points, const Points& normals, std::span<const Occluder>,
                              const std::optional<Ground>& = {}, int cells = 150);

}  // namespace limber::render
