#include "tools/check_cage/solid.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace check {
namespace {

std::vector<Box> boxes_of(const Surface& surface) {
  std::vector<Box> boxes;
  for (const Triangle& t : surface.triangles) {
    boxes.emplace_back();
    for (int v : t) boxes.back().add(surface.points[std::size_t(v)]);
  }
  return boxes;
}

bool is_closed(const Surface& surface) {
  std::map<std::pair<int, int>, int> balance;
  for (const Triangle& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (a != b) balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

// Directions spread over the sphere by the golden angle, none along an axis.
std::vector<Point> directions(int count) {
  std::vector<Point> out;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.07) / count, angle = 0.7 + i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    out.push_back({r * std::cos(angle), r * std::sin(angle), z});
  }
  return out;
}

// Ericson, Real-Time Collision Detection, 2005, section 5.1.5: by the region of the triangle's plane.
double distance_to(const Point& p, const Corners& t) {
  const Point ab = t[1] - t[0], ac = t[2] - t[0], n = cross(ab, ac), ap = p - t[0];
  const double area = dot(n, n);
  if (area > 0) {
    const double v = dot(cross(ap, ac), n) / area, w = dot(cross(ab, ap), n) / area;
    if (v >= 0 && w >= 0 && v + w <= 1) return std::abs(dot(ap, n)) / std::sqrt(area);
  }
  double least = 1e300;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point edge = t[(k + 1) % 3] - t[k], to = p - t[k];
    const double squared = dot(edge, edge);
    const double s = squared > 0 ? std::clamp(dot(to, edge) / squared, 0.0, 1.0) : 0;
    least = std::min(least, length(to - s * edge));
  }
  return least;
}

}  // namespace

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Point operator*(double s, const Point& a) { return {s * a[0], s * a[1], s * a[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Point& a) { return std::sqrt(dot(a, a)); }

Solid::Solid(Surface surface)
    : surface_(std::move(surface)), grid_(boxes_of(surface_)), closed_(is_closed(surface_)) {}

Corners Solid::corners(std::size_t triangle) const {
  const Triangle& t = surface_.triangles[triangle];
  return {surface_.points[std::size_t(t[0])], surface_.points[std::size_t(t[1])],
          surface_.points[std::size_t(t[2])]};
}

double Solid::area() const {
  double two = 0;
  for (std::size_t i = 0; i < surface_.triangles.size(); ++i) {
    const Corners c = corners(i);
    two += length(cross(c[1] - c[0], c[2] - c[0]));
  }
  return two / 2;
}

double Solid::volume() const {
  double six = 0;
  const Point origin = grid_.box().lower;
  for (std::size_t i = 0; i < surface_.triangles.size(); ++i) {
    const Corners c = corners(i);
    six += dot(c[0] - origin, cross(c[1] - origin, c[2] - origin));
  }
  return six / 6;
}

Solid::Crossings Solid::crossings(const Point& from, const Point& direction) const {
  Crossings sum;
  grid_.for_each_along(from, direction, [&](int i) {
    const Corners c = corners(std::size_t(i));
    const Point a = c[0] - from, b = c[1] - from, d = c[2] - from;
    const double u = dot(direction, cross(a, b)), v = dot(direction, cross(b, d)),
                 w = dot(direction, cross(d, a));
    const bool outwards = u > 0 && v > 0 && w > 0, inwards = u < 0 && v < 0 && w < 0;
    // Behind the start where the start lies on the side to which the ray leaves.
    if (!(outwards || inwards) || (dot(a, cross(b, d)) > 0) != outwards) return;
    ++sum.all;
    sum.outwards_less_inwards += outwards ? 1 : -1;
  });
  return sum;
}

bool Solid::inside(const Point& p) const {
  static const std::vector<Point> three = directions(3), nine = directions(9);
  if (closed_) {
    std::array<int, 3> n;
    for (std::size_t i = 0; i < 3; ++i) n[i] = crossings(p, three[i]).outwards_less_inwards;
    std::sort(n.begin(), n.end());
    return n[1] != 0;
  }
  std::size_t odd = 0;
  for (const Point& direction : nine) odd += crossings(p, direction).all % 2 == 1;
  return 2 * odd > nine.size();
}

double Solid::distance(const Point& p) const {
  for (double reach = grid_.cell();; reach *= 2) {
    Box box;
    box.add(p - Point{reach, reach, reach});
    box.add(p + Point{reach, reach, reach});
    double least = 1e300;
    grid_.for_each_meeting(box,
                           [&](int i) { least = std::min(least, distance_to(p, corners(std::size_t(i)))); });
    if (least <= reach) return least;
    if (reach > 1e6 * (grid_.box().diagonal() + length(p - grid_.box().lower) + 1e-300)) return least;
  }
}

}  // namespace check
