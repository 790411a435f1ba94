// A model cut by planes into parts. A part is the surface inside its cells: the triangles clipped by the
// cuts. The hull of the solid in a cell needs no caps: an extreme point of it lies on the surface, or is a
// corner of the cell inside the solid. All in a frame where the model's bounding box has a diagonal of
// about 1.
#pragma once

#include <array>
#include <atomic>
#include <utility>
#include <vector>

#include "meshing/detail/growing_hull.h"
#include "meshing/winding_number.h"

namespace limber::meshing::detail {

// Points of the plane have normal·x = offset; "below" is less. A point closer than on_plane is on both sides.
struct Plane {
  Vec3 normal = Vec3::UnitZ();
  double offset = 0;
};
constexpr double on_plane = 1e-9;
// What the hull of a part may lack while cuts are looked for, as a share of its thickness.
constexpr double search_tolerance = 1e-4;

// Is a point inside the solid? Asked for places near each other again and again: a grid remembers the answer
// of voxels that the surface does not enter; in the others the winding number is asked each time. Several
// threads may ask; what they learn of a voxel is the same.
class InsideTest {
 public:
  InsideTest(const Points&, const Triangles&);
  bool operator()(const Vec3& point);

 private:
  enum class Voxel : char { unknown, inside, outside, at_surface };
  static constexpr int side = 48;
  WindingNumber winding_;
  Vec3 lower_;
  double voxel_ = 0;
  std::vector<std::atomic<Voxel>> voxels_;
};

// A convex polytope; each face is a loop of corners.
struct Cell {
  std::vector<Vec3> corners;
  std::vector<std::vector<int>> faces;
};
Cell box_cell(const Box&);

// Convex polygons, each a piece of one triangle of the model.
struct Polygons {
  std::vector<int> first = {0};  // polygon i has corners[first[i]] … corners[first[i+1]−1]
  std::vector<int> corners;      // rows of Model::points
  std::vector<int> triangle;     // one a polygon
  int count() const { return int(triangle.size()); }
};

struct Part {
  Polygons surface;
  std::vector<Cell> cells;
  std::vector<Vec3> corners_inside;  // corners of the cells that lie inside the solid
  // Of its convex hull, to within search_tolerance: the corners, all points when that is flat;
  // the volume.
  std::vector<Vec3> hull;
  double hull_volume = 0;
};

// The points that parts share: both sides of a cut name the same row.
struct Model {
  std::vector<Vec3> points;
  // A vertex in the hull of its neighbours can be left out of every hull of a part: whatever a cut takes of
  // the neighbours, it puts a point on the way to them.
  std::vector<char> buried;
};

Model make_model(const Points&, const Triangles&);
// Its length is the polygon's area.
Vec3 area_vector(const Model&, const Polygons&, int polygon);
Part whole(const Model&, const Triangles&);
// {below, above}. New points are added to the model.
std::pair<Part, Part> cut(Model&, const Part&, const Plane&, InsideTest&);
// Puts two parts together again.
Part unite(const Part&, const Part&);
// Rows of Model::points that the part's surface uses, ascending.
std::vector<int> points_of(const Part&);
// The points whose hull is the part's, the farthest from its middle first: most others then fall into the
// hull at the first look.
std::vector<Vec3> hull_candidates(const Model&, const Part&);
// By the distance from the middle of their box.
void sort_far_first(std::vector<Vec3>&);
// Columns from the least spread to the largest.
Eigen::Matrix3d principal_axes(const std::vector<Vec3>&);
// A hull that may leave points out by `share` of their extent along the first principal axis.
GrowingHull rough_hull(std::vector<Vec3> points, double share);

}  // namespace limber::meshing::detail
