#include "limber/detail/film/pane.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::detail {

namespace {

constexpr int corner_points = 8, outline_points = 4 * corner_points;

// Round (x, y) of [−1, 1]², counter-clockwise.
std::vector<Eigen::Vector2d> outline(const Eigen::Vector2d& half, double radius) {
  std::vector<Eigen::Vector2d> points;
  for (int corner = 0; corner < 4; ++corner)
    for (int i = 0; i < corner_points; ++i) {
      const double angle = (corner + double(i) / (corner_points - 1)) * std::numbers::pi / 2;
      const Eigen::Vector2d sign(corner == 0 || corner == 3 ? 1 : -1, corner < 2 ? 1 : -1);
      points.push_back(sign.cwiseProduct((half.array() - radius).matrix()) +
                       radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  return points;
}

}  // namespace

std::vector<double> faded(const std::vector<bool>& touching, int frames) {
  std::vector<double> shares(touching.size(), 0);
  for (int f = 0; f < int(touching.size()); ++f) {
    if (!touching[std::size_t(f)]) continue;
    for (int k = std::max(0, f - frames); k <= std::min(int(touching.size()) - 1, f + frames); ++k)
      shares[std::size_t(k)] = std::max(shares[std::size_t(k)], 1 - std::abs(double(k - f)) / (frames + 1));
  }
  return shares;
}

Pane pane_behind(const Box& body, const Box& bounds, const Wall& wall, double margin_m, double rim_m) {
  const int x = (wall.axis + 1) % 3, y = (wall.axis + 2) % 3;
  Box wanted = body;
  wanted.lower.array() -= margin_m, wanted.upper.array() += margin_m;
  wanted.lower = wanted.lower.cwiseMax(bounds.lower).cwiseMin(bounds.upper);
  wanted.upper = wanted.upper.cwiseMin(bounds.upper).cwiseMax(wanted.lower);
  const Eigen::Vector2d middle(wanted.center()[x], wanted.center()[y]),
      half(0.5 * wanted.size()[x], 0.5 * wanted.size()[y]);
  const double place = wall.upper ? bounds.upper[wall.axis] : bounds.lower[wall.axis];
  const auto put = [&](const Eigen::Vector2d& point, Points& points, Eigen::Index row) {
    points(row, x) = middle.x() + point.x(), points(row, y) = middle.y() + point.y();
    points(row, wall.axis) = place;
  };
  const double radius = std::min(margin_m, half.minCoeff()), rim = std::min(rim_m, 0.5 * radius);
  const std::vector<Eigen::Vector2d> outer = outline(half, radius),
                                     inner = outline((half.array() - rim).matrix(), radius - rim);
  Pane pane{Points(outline_points + 1, 3), Points(2 * outline_points, 3)};
  put({0, 0}, pane.glass, outline_points);
  for (Eigen::Index i = 0; i < outline_points; ++i) {
    put(outer[std::size_t(i)], pane.glass, i);
    put(outer[std::size_t(i)], pane.rim, i);
    put(inner[std::size_t(i)], pane.rim, outline_points + i);
  }
  return pane;
}

Triangles pane_triangles() {
  Triangles triangles(outline_points, 3);
  for (int i = 0; i < outline_points; ++i) triangles.row(i) << outline_points, i, (i + 1) % outline_points;
  return triangles;
}

Triangles rim_triangles() {
  Triangles triangles(2 * outline_points, 3);
  for (int i = 0; i < outline_points; ++i) {
    const int next = (i + 1) % outline_points;
    triangles.row(2 * i) << i, next, outline_points + i;
    triangles.row(2 * i + 1) << outline_points + i, next, outline_points + next;
  }
  return triangles;
}

}  // namespace limber::detail
