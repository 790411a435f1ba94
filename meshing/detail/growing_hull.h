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
    double normal[3], offset;  // its unit plane; of a free one such that nothing is beyond
    double twice_area;
    double noise;                  // a distance below this has no certain sign
    std::array<int, 3> vertex;     // vertex[0] = −1: free
    std::array<int, 3> neighbour;  // across the side from vertex[k] to vertex[k+1]
    int mark;                      // 2 × the insertion that saw it, or 1 more: that did not
    double distance(const Vec3& p) const {
      return normal[0] * p.x() + normal[1] * p.y() + normal[2] * p.z() + offset;
    }
  };
  // A side of the visible part: from a vertex to another, and the face beyond it.
  struct Rim {
    int from, to, beyond;
  };
  bool start();  // a tetrahedron from the waiting points
  void insert(Vec3 point);
  void keep_point(const Vec3&);
  // A face of each two of `corners` that follow one another, and of `apex`; their numbers become `made_`.
  void new_faces(std::span<const int> corners, int apex);
  // The first face from `first` on that p is more than `least` beyond, by a distance that is accepted; the
  // number of faces: none.
  template <class Accept>
  int first_beyond(int first, const Vec3& p, double least, const Accept&) const;
  // Exact: points of a cut lie in one plane, and a hull whose faces disagree about them by rounding comes
  // apart.
  bool visible(const Face&, const Vec3& p, double distance) const;

  double tolerance_, jitter_;
  std::vector<Vec3> points_, waiting_;
  std::vector<Face> faces_;
  // The planes of faces rounded, in blocks: of each block the x of its normals, then y, z, and the offsets.
  std::vector<float> rough_;
  double reach_ = 0;  // no point has coordinates whose magnitudes sum to more
  std::vector<int> free_;
  double volume_ = 0;
  // Scratch of insert.
  std::vector<int> visible_, made_, loop_;
  std::vector<Rim> rim_, beyond_;
  std::vector<int> rim_from_vertex_;  // a vertex → its rim side in this insertion
  int stamp_ = 0;
  std::vector<double> columns_[3];  // of the loop's points
};

}  // namespace limber::meshing::detail
