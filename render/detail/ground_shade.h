// How much of the key light and of the sky reaches each place of the ground, from what is above it. On the
// CPU, in height bands: cells are covered by what casts there, each band is blurred in proportion to its
// height, and the bands are added. A penumbra so widens with the height of what casts it, as under a light of
// finite size.
#pragma once

#include <span>
#include <vector>

#include "core/mesh.h"
#include "render/detail/drawn_mesh.h"

namespace limber::render::detail {

struct GroundFrame {  // ground coordinates: u = x·point, v = y·point, height = up·point − height_m
  Eigen::Matrix<double, 2, 3> plane_from_world;
  Vec3 up;
  double height_m;
};
GroundFrame ground_frame(const Vec3& up, double height_m);

struct ShadeMap {
  Eigen::Vector2d lower;  // ground coordinates of the map's corner
  double cell_m = 1;
  int columns = 1, rows = 1;
  std::vector<float> blocked;  // (rows × columns) 0: all light arrives, 1: none
};

// A mesh, and how much of a ray of light it holds back: 1 all.
struct GroundCaster {
  const DrawnMesh* mesh;
  float blocks = 1;
  // Triangles whose middle has n·p + d < 0 for a plane (n, d) cast nothing.
  std::span<const Eigen::Vector4d> planes = {};
};

// Rays arrive from `toward_light` (above the horizon). What is at height h is blurred by the average of
// Gaussians with the deviations spreads[i] × h metres. The map is large enough for `stage` and its longer
// side has about `cells` cells; at its border it fades out. Of two casters that cover a cell at a height, the
// darker counts.
ShadeMap shade_ground(std::span<const GroundCaster> casters, const GroundFrame&, const Vec3& toward_light,
                      std::span<const double> spreads, const Box& stage, int cells);

}  // namespace limber::render::detail
