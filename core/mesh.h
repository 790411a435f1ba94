// The meshes that flow through the program, and the laws that each must keep.
#pragma once

#include <string_view>
#include <vector>

#include "core/types.h"

namespace limber {

// What is seen. Vertex 17 is row 17 from surface.ply to the last frame.
struct SurfaceMesh {
  Points positions;     // (V × 3), metres
  Triangles triangles;  // (F × 3), counter-clockwise seen from outside
};

// A closed convex surface that contains part of a model.
struct ConvexShell {
  Points vertices;      // (≤ 64 × 3) in the order of the hull builder
  Triangles triangles;  // (F × 3), counter-clockwise seen from outside
};

// What is simulated. Every tet (a b c d) has (b−a)×(c−a)·(d−a) > 0.
struct TetMesh {
  Points positions;  // (N × 3), metres
  Tets tets;         // (T × 4)
};

// Each throws InputError with `what`, the first bad element, and its numbers: a coordinate that is not
// finite, an index out of range, a triangle that names a vertex twice, a tet whose volume is not positive, no
// element at all.
void validate(const SurfaceMesh&, std::string_view what);
void validate(const TetMesh&, std::string_view what);
void validate(const ConvexShell&, std::string_view what);

struct Box {
  Vec3 lower = Vec3::Constant(1e300);
  Vec3 upper = Vec3::Constant(-1e300);
  bool empty() const { return (lower.array() > upper.array()).any(); }
  Vec3 center() const { return 0.5 * (lower + upper); }
  Vec3 size() const { return upper - lower; }
  double diagonal() const { return empty() ? 0.0 : size().norm(); }
  void include(const Vec3& p) { lower = lower.cwiseMin(p), upper = upper.cwiseMax(p); }
  void include(const Box& b) { lower = lower.cwiseMin(b.lower), upper = upper.cwiseMax(b.upper); }
};
Box bounding_box(const Points&);

// Six times the volume is (b−a)×(c−a)·(d−a).
double signed_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
double volume(const TetMesh&);
double volume(const SurfaceMesh&);  // by the divergence theorem; meaningful when closed and oriented
double area(const SurfaceMesh&);

// Faces that belong to exactly one tet, counter-clockwise seen from outside, in order of (tet, face). Indices
// are rows of positions.
Triangles boundary_triangles(const Tets&);

// The distinct vertices of some triangles, ascending.
std::vector<int> vertices_of(const Triangles&);

// The tets all of whose vertices are on the boundary, ascending. Engines that have a field of zero there
// (Drake's pressure) feel nothing in them.
std::vector<int> tets_without_interior_vertex(const Tets&);
// The same volume, without such tets: each becomes four, round a vertex in its middle, the first in its place
// and the others after all tets.
TetMesh with_interior_vertices(TetMesh);

// Unit vertex normals, (V × 3): the sum of the area vectors of the triangles round each vertex; zero where
// there are none.
Points vertex_normals(const Points&, const Triangles&);

}  // namespace limber
