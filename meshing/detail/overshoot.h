// How far shells stand off the model that they enclose.
#pragma once

#include <array>
#include <vector>

#include "core/mesh.h"
#include "meshing/detail/box_tree.h"
#include "meshing/detail/triangle_pieces.h"

namespace limber::meshing::detail {

// Distance from a point to the nearest point of a triangle soup.
class SurfaceDistance {
 public:
  SurfaceDistance(const Points&, const Triangles&);
  double at(const Vec3& point) const;

 private:
  Axes axes_;
  std::vector<TrianglePiece> pieces_;  // along the axes
  BoxTree tree_;                       // of the pieces
  std::vector<std::array<Vec3, 3>> corners_;
};

// The planes of a shell: (F × 4), unit normal and offset: normal·x + offset ≤ 0 inside. Slivers, whose plane
// is noise, are left out.
Eigen::Matrix<double, Eigen::Dynamic, 4> planes_of(const ConvexShell&);

// Points spread evenly over the shells' faces, `per_area` to a unit of area and always the same; those inside
// another shell are left out, so what remains is on the boundary of the union. {row of shells, point}
struct BoundarySample {
  int shell;
  Vec3 point;
};
std::vector<BoundarySample> boundary_samples(const std::vector<ConvexShell>&, double per_area);

}  // namespace limber::meshing::detail
