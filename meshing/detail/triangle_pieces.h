// Long thin triangles that lie askew have boxes full of nothing: a tree of such boxes is no better than a
// list (of a rod with 4,000 triangles as long as itself, each question to the tree asked all of them). They
// are halved until their boxes are close: the early split clipping of Ernst and Greiner 2007. Where most lie
// one way, axes along them do better: there each has one box, as thin as all of them together.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

struct TrianglePiece {
  int triangle;
  Box box;  // of a part of it; the boxes of all its pieces cover it, whatever the rounding
};

// In the order of the triangles; most have one piece, with the triangle's own box. None that is halved has a
// diagonal below half of `smallest`; less is taken for it than 1/256 of the whole diagonal, or what would
// make more than some 500,000 pieces besides one a triangle, at no time.
std::vector<TrianglePiece> pieces_of(const Points& positions, const Triangles&, double smallest = 0);

// Axes for boxes: the world's, or others along which the triangles need far fewer pieces.
class Axes {
 public:
  Axes(const Points& positions, const Triangles&);
  bool turned() const { return turned_; }
  Vec3 along(const Vec3& p) const { return turned_ ? Vec3(turn_ * p) : p; }
  Points along(const Points& positions) const;
  // More than a point's coordinates along turned axes are off, if its own are not above `largest`.
  double rounding(double largest) const { return turned_ ? 1e-14 * largest : 0; }

 private:
  Eigen::Matrix3d turn_ = Eigen::Matrix3d::Identity();  // its rows are the axes
  bool turned_ = false;
};

// Pieces whose boxes lie along the axes, wide enough for what rounding does to a point that is turned.
std::vector<TrianglePiece> pieces_along(const Axes&, const Points& positions, const Triangles&);
std::vector<Box> boxes_of(const std::vector<TrianglePiece>&);

}  // namespace limber::meshing::detail
