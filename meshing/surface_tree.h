// A triangle soup, and questions to it that are answered without rounding: triangles may be flat, doubled, or
// cross one another. Touching counts as meeting. Method: docs/cage.md.
#pragma once

#include <optional>
#include <vector>

#include "meshing/detail/box_tree.h"
#include "meshing/detail/triangle_pieces.h"

namespace limber::meshing {

// The sign of (b−a)×(c−a)·(d−a), exact.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Whether p lies in the closed tet (a b c d), whose volume is positive; exact.
bool tet_holds(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& p);

// All but free_share throw Interrupted once a stop signal has come: whoever asks, asks often.
class SurfaceTree {
 public:
  SurfaceTree(const Points& positions, const Triangles& triangles);  // keeps copies

  // Exact, unless both (a b c) and a triangle of the soup are flat.
  bool meets_triangle(const Vec3& a, const Vec3& b, const Vec3& c) const;
  // The solid tet, of any orientation. Never misses a meeting; says so too of some flat tets that meet
  // nothing, and of pairs that lie within one plane.
  bool meets_tet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) const;
  // Ascending.
  std::vector<int> triangles_meeting_tet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) const;
  // The same for any order of the triangles: among equally near points the lexicographically least.
  Vec3 closest_point(const Vec3& p) const;
  // Nothing when it is farther than `distance`; then it is quick to say so.
  std::optional<Vec3> closest_point_within(const Vec3& p, double distance) const;
  // Share of the way from p to q at which the soup is first met, 1 where it is not; to rounding, unlike the
  // others.
  double free_share(const Vec3& p, const Vec3& q) const;

 private:
  Points positions_;
  Triangles triangles_;
  detail::Axes axes_;
  std::vector<detail::TrianglePiece> pieces_;  // along the axes
  detail::BoxTree tree_;                       // of the pieces
};

}  // namespace limber::meshing
