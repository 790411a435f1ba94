// Finds the tet of a point: by walking from a tet nearby, or from anywhere through a tree of boxes.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::ffd::detail {

using Weights4 = Eigen::Vector4d;

class TetLocator {
 public:
  explicit TetLocator(const TetMesh&);  // the mesh must outlive it

  // Of a point in a tet, or its extrapolation when it is outside. They sum to 1.
  Weights4 weights(int tet, const Vec3& p) const;
  // A weight this far below zero still counts as inside: rounding on a face.
  static constexpr double tolerance = 1e-9;
  static bool inside(const Weights4& w) { return w.minCoeff() >= -tolerance; }

  // Through faces from tet to tet, towards p. −1 when that leaves the mesh.
  int walk(int from, const Vec3& p) const;

  struct Nearest {
    int tet = -1;
    double distance2 = 1e300;             // squared; 0 inside
    Weights4 weights = Weights4::Zero();  // of the tet's point nearest to p
  };
  // Of equally near ones the tet that has p deepest inside, then the first.
  Nearest nearest(const Vec3& p) const;

 private:
  struct Tet {
    double to_weights[9];  // row-major inverse of (a−d, b−d, c−d)
    Vec3 d;
    int across[4];  // the tet beyond the face opposite to corner k, −1 outside
  };
  struct Node {
    Box box;
    int first, count;  // of order_; count 0: an inner node, its children are first and first + 1
  };
  void link_neighbours();
  void split(int node, int first, int count);
  Vec3 corner(int tet, int k) const { return mesh_.positions.row(mesh_.tets(tet, k)); }
  Nearest nearest_in(int tet, const Vec3& p) const;

  const TetMesh& mesh_;
  std::vector<Tet> tets_;
  std::vector<int> order_;
  std::vector<Node> nodes_;  // [0] is the root
};

}  // namespace limber::ffd::detail
