#include "meshing/detail/triangle_pieces.h"

#include <algorithm>
#include <array>

namespace limber::meshing::detail {
namespace {

using Corners = std::array<Vec3, 3>;

constexpr double much = 16;  // a box is loose whose surface is more than so many times the triangle's
constexpr double smallest_share =
    1.0 / 256;                         // of the model's diagonal; halving goes on until boxes are that long
constexpr double pieces_a_length = 3;  // for each `smallest` that a needle is long, about
constexpr double most_pieces = 1'500'000;

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

bool box_is_loose(const Corners& t) {
  const Vec3 s = box_of(t).size();
  const double area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x() > much * area;
}

void add(int triangle, const Box& whole, const Corners& corners, double smallest,
         std::vector<TrianglePiece>& pieces) {
  const Box box = box_of(corners);
  if (box.diagonal() <= smallest || !box_is_loose(corners)) {
    // Middles are rounded: the margin is many times what a few roundings make.
    const double margin = 1e-14 * whole.lower.cwiseAbs().cwiseMax(whole.upper.cwiseAbs()).maxCoeff();
    pieces.push_back({triangle,
                      {(box.lower.array() - margin).max(whole.lower.array()),
                       (box.upper.array() + margin).min(whole.upper.array())}});
    return;
  }
  std::size_t longest = 0;
  const auto length = [&](std::size_t k) { return (corners[k] - corners[(k + 1) % 3]).squaredNorm(); };
  for (std::size_t k = 1; k < 3; ++k)
    if (length(k) > length(longest)) longest = k;
  const std::size_t next = (longest + 1) % 3;
  Corners first = corners, second = corners;
  first[next] = second[longest] = 0.5 * (corners[longest] + corners[next]);
  add(triangle, whole, first, smallest, pieces);
  add(triangle, whole, second, smallest, pieces);
}

}  // namespace

std::vector<TrianglePiece> pieces_of(const Points& positions, const Triangles& triangles) {
  const auto count = std::size_t(triangles.rows());
  double length = 0;
  for (std::size_t f = 0; f < count; ++f)
    if (const Corners corners = corners_of(positions, triangles, f); box_is_loose(corners))
      length += box_of(corners).diagonal();
  const double smallest =
      std::max(smallest_share * bounding_box(positions).diagonal(), pieces_a_length * length / most_pieces);
  std::vector<TrianglePiece> pieces;
  pieces.reserve(count);
  for (std::size_t f = 0; f < count; ++f) {
    const Corners corners = corners_of(positions, triangles, f);
    add(int(f), box_of(corners), corners, smallest, pieces);
  }
  return pieces;
}

}  // namespace limber::meshing::detail
