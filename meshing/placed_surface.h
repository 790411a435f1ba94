// A surface whose vertices move while its triangles stay: a tree over them that is built once and fitted anew
// to each place, and what is asked of it there. docs/seen.md.
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "meshing/detail/triangle_bvh.h"

namespace limber::meshing {

// A box in single precision that holds the one in double, and is larger by less than 1e-6 of its coordinates.
struct OuterBox {
  using Four = float __attribute__((vector_size(16)));
  Four lower, upper;  // x, y, z and 0
  operator Box() const {
    return {{double(lower[0]), double(lower[1]), double(lower[2])},
            {double(upper[0]), double(upper[1]), double(upper[2])}};
  }
};
inline bool meet(const OuterBox& a, const OuterBox& b) {
  using Two = long long __attribute__((vector_size(16)));
  const Two apart = Two((a.lower > b.upper) | (b.lower > a.upper));
  return (apart[0] | apart[1]) == 0;
}
// Of each node of the tree, where vertex v of the triangles is at row v.
std::vector<OuterBox> boxes_of(const detail::TriangleBvh&, const Triangles& in_order_of_leaves,
                               const Points&);

// What stays. Any triangle soup will do: open, doubled, passing through itself.
struct SurfaceShape {
  SurfaceShape(const Points& rest, const Triangles&);

  Triangles triangles;       // in the order of the tree's leaves
  detail::TriangleBvh tree;  // built at rest
  int vertices;
  // Each edge and vertex is asked for once, by one of its triangles: bit k of a row is the edge from corner k
  // to corner k + 1.
  std::vector<std::uint8_t> own_edges;
  std::vector<int> triangle_from_vertex;         // the largest at rest, −1: none
  std::vector<int> first_neighbour, neighbours;  // of vertex v: neighbours[first_neighbour[v] … [v + 1])
  std::vector<int> vertex_of_component;          // the first of each piece that edges join
  Box box;                                       // at rest
  double size_m() const { return box.size().maxCoeff(); }
};

// Where it is. The shape must outlive it. Safe to ask from many threads.
class PlacedSurface {
 public:
  PlacedSurface(const SurfaceShape&, Points positions);  // (V × 3) for the shape's vertices

  const SurfaceShape& shape() const { return *shape_; }
  const Points& positions() const { return positions_; }
  const std::vector<OuterBox>& boxes() const { return boxes_; }  // of the nodes of shape().tree
  const Box& box() const { return box_; }                        // of the triangles; empty without any
  Vec3 vertex(int v) const { return positions_.row(v); }
  std::array<Vec3, 3> corners(int triangle) const {
    const auto t = shape_->triangles.row(triangle);
    return {vertex(t[0]), vertex(t[1]), vertex(t[2])};
  }

  // How often the surface winds round the point, as meshing/winding_number.h says, far groups as single
  // dipoles: within 0.05 of exact.
  double winding(const Vec3& point) const;
  // Of the nearest triangle, and how far that is. Where it is no farther than `above`, any that is as near
  // will do, and then it is quick to say so. The point itself where there is no triangle.
  Vec3 closest_point(const Vec3& point, double above = 0) const;
  double distance(const Vec3& point, double above = 0) const {
    return (closest_point(point, above) - point).norm();
  }
  // Places within: of triangles all over it and one of each component, halfway from its middle to what is
  // straight behind it. What lies behind nothing has none.
  const std::vector<Vec3>& inner_places() const;

 private:
  // Of a node's area vector ∫ n dA as a dipole: where it stands and how far its triangles reach from there.
  struct Dipole {
    Vec3 center = Vec3::Zero(), area_vector = Vec3::Zero();
    double area = 0, squared_radius = 0;
  };
  void make_dipoles() const;
  // How far it is from the point to the first triangle along that direction, of length 1, that it leaves the
  // inside by; infinite where it meets none.
  double way_out(const Vec3& from, const Vec3& direction) const;

  const SurfaceShape* shape_;
  Points positions_;
  std::vector<OuterBox> boxes_;
  Box box_;
  mutable std::once_flag dipoles_asked_;
  mutable std::vector<Dipole> dipoles_;  // made when the first winding number is asked for
  mutable std::once_flag inner_places_asked_;
  mutable std::vector<Vec3> inner_places_;
};

}  // namespace limber::meshing
