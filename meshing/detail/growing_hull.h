// A convex hull that takes points one after another and always knows its volume: what the search for cuts
// asks for millions of times. In floating point, for models of size about 1; what must be exact is done again
// in convex_hull.h.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

class GrowingHull {
 public:
  // Points closer than `tolerance` to the hull change nothing.
  explicit GrowingHull(double tolerance = insert_distance);
  void clear();  // keeps the memory
  double tolerance() const { return tolerance_; }
  //  Until four points span a volume all wait.
  void add(std::span<const Vec3> points);
  void add(const Vec3& point) { add(std::span<const Vec3>(&point, 1)); }
  bool holds(const Vec3& point) const;  // within the tolerance; false while flat
  bool flat() const { return faces_.empty(); }
  double volume() const { return volume_; }
  // The hull's corners in the order of their arrival; while flat, all points so far.
  std::vector<Vec3> vertices() const;
  // (F × 4) unit normal and offset: normal·x + offset ≤ 0 inside. Slivers, whose plane is noise, are left
  // out.
  Eigen::Matrix<double, Eigen::Dynamic, 4> planes() const;

  static constexpr double insert_distance = 2e-8;
  static constexpr double flat_distance = 1e-7;  // thinner is flat

 private:
  struct Face {
    std::array<int, 3> vertex;     // vertex[0] = −1: free
    std::array<int, 3> neighbour;  // across the side from vertex[k] to vertex[k+1]
    double twice_area;
    double noise;  // a distance below this has no certain sign
  };
  bool start();  // a tetrahedron from the waiting points
  void insert(Vec3 point);
  int new_face(int a, int b, int c);
  double distance(int face, const Vec3& p) const;
  // The first block of planes with one that p is beyond, as the row of its first plane; nx_.size(): none.
  std::size_t block_beyond(const Vec3& p) const;
  // Exact: points of a cut lie in one plane, and a hull whose faces disagree about them by rounding comes
  // apart.
  bool visible(int face, const Vec3& p) const;

  double tolerance_, jitter_;
  std::vector<Vec3> points_, waiting_;
  std::vector<Face> faces_;
  std::vector<double> nx_, ny_, nz_, offset_;  // unit plane of each face, in whole blocks; a free row is
                                               // nowhere visible
  std::vector<int> free_;
  double volume_ = 0;
  // Scratch of insert.
  std::vector<int> visible_, rim_face_, rim_side_;
  std::vector<int> rim_from_vertex_;  // a vertex → its rim side in this insertion
  std::vector<int> mark_;
  std::vector<std::array<int, 3>> rim_;  // from vertex, to vertex, the face beyond
  int stamp_ = 0;
};

}  // namespace limber::meshing::detail
