#include "meshing/detail/triangle_pieces.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>

namespace limber::meshing::detail {
namespace {

using Corners = std::array<Vec3, 3>;

constexpr double much = 16;        // a box is loose whose surface is more than so many times the triangle's
constexpr double thin = 1.0 / 16;  // a box is close whose sides but one are less than so much of `smallest`
constexpr double smallest_share =
    1.0 / 256;                         // of the model's diagonal; halving goes on until boxes are that long
constexpr double pieces_a_length = 3;  // for each `smallest` that a needle is long, about
constexpr double max_pieces = 400'000;
constexpr double much_length = 64;  // of needles, in diagonals of the model: worth a look for other axes

Corners corners_of(const Points& positions, const Triangles& triangles, std::size_t f) {
  Corners corners;
  for (int k = 0; k < 3; ++k)
    corners[std::size_t(k)] = positions.row(triangles(Eigen::Index(f), k)).transpose();
  return corners;
}

Box box_of(const Corners& corners) {
  Box box;
  for (const Vec3& p : corners) box.include(p);
  return box;
}

bool box_is_loose(const Corners& t, double smallest) {
  const Vec3 s = box_of(t).size();
  const double area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
  const double middle_side = s.sum() - s.minCoeff() - s.maxCoeff();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x() > much * area && middle_side > thin * smallest;
}

std::size_t longest_edge(const Corners& corners) {
  std::size_t longest = 0;
  const auto length = [&](std::size_t k) { return (corners[k] - corners[(k + 1) % 3]).squaredNorm(); };
  for (std::size_t k = 1; k < 3; ++k)
    if (length(k) > length(longest)) longest = k;
  return longest;
}

// The sum of the diagonals of loose boxes, and of e eᵀ/|e| of those triangles' longest edges e.
struct Loose {
  double length = 0;
  Eigen::Matrix3d edges = Eigen::Matrix3d::Zero();
};

Loose loose_of(const Points& positions, const Triangles& triangles, double smallest) {
  Loose loose;
  for (std::size_t f = 0; f < std::size_t(triangles.rows()); ++f) {
    const Corners corners = corners_of(positions, triangles, f);
    if (!box_is_loose(corners, smallest)) continue;
    loose.length += box_of(corners).diagonal();
    const std::size_t k = longest_edge(corners);
    const Vec3 edge = corners[k] - corners[(k + 1) % 3];
    loose.edges += edge * edge.stableNormalized().transpose();
  }
  return loose;
}

void add(int triangle, const Box& whole, const Corners& corners, double smallest,
         std::vector<TrianglePiece>& pieces) {
  const Box box = box_of(corners);
  if (box.diagonal() <= smallest || !box_is_loose(corners, smallest)) {
    // Middles are rounded: the margin is many times what a few roundings make.
    const double margin = 1e-14 * whole.lower.cwiseAbs().cwiseMax(whole.upper.cwiseAbs()).maxCoeff();
    pieces.push_back({triangle,
                      {(box.lower.array() - margin).max(whole.lower.array()),
                       (box.upper.array() + margin).min(whole.upper.array())}});
    return;
  }
  const std::size_t longest = longest_edge(corners), next = (longest + 1) % 3;
  Corners first = corners, second = corners;
  first[next] = second[longest] = 0.5 * (corners[longest] + corners[next]);
  add(triangle, whole, first, smallest, pieces);
  add(triangle, whole, second, smallest, pieces);
}

}  // namespace

std::vector<TrianglePiece> pieces_of(const Points& positions, const Triangles& triangles, double smallest) {
  const auto count = std::size_t(triangles.rows());
  smallest = std::max(smallest, smallest_share * bounding_box(positions).diagonal());
  smallest =
      std::max(smallest, pieces_a_length * loose_of(positions, triangles, smallest).length / max_pieces);
  std::vector<TrianglePiece> pieces;
  pieces.reserve(count);
  for (std::size_t f = 0; f < count; ++f) {
    const Corners corners = corners_of(positions, triangles, f);
    add(int(f), box_of(corners), corners, smallest, pieces);
  }
  return pieces;
}

Axes::Axes(const Points& positions, const Triangles& triangles) {
  const double diagonal = bounding_box(positions).diagonal(), smallest = smallest_share * diagonal;
  const Loose here = loose_of(positions, triangles, smallest);
  if (!(here.length > much_length * diagonal)) return;
  const Eigen::Matrix3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(here.edges / here.edges.trace()).eigenvectors();
  if (!axes.allFinite()) return;
  turned_ = loose_of(positions * axes, triangles, smallest).length < 0.25 * here.length;
  if (turned_) turn_ = axes.transpose();
}

Points Axes::along(const Points& positions) const {
  return turned_ ? Points(positions * turn_.transpose()) : positions;
}

std::vector<TrianglePiece> pieces_along(const Axes& axes, const Points& positions,
                                        const Triangles& triangles) {
  const Points turned = axes.along(positions);
  std::vector<TrianglePiece> pieces = pieces_of(turned, triangles);
  const Box all = bounding_box(turned);
  const double rounding = axes.rounding(all.lower.cwiseAbs().cwiseMax(all.upper.cwiseAbs()).maxCoeff());
  for (TrianglePiece& piece : pieces)
    piece.box.lower.array() -= rounding, piece.box.upper.array() += rounding;
  return pieces;
}

std::vector<Box> boxes_of(const std::vector<TrianglePiece>& pieces) {
  std::vector<Box> boxes;
  for (const TrianglePiece& piece : pieces) boxes.push_back(piece.box);
  return boxes;
}

}  // namespace limber::meshing::detail
