// The point of a segment or triangle that is nearest to another point, and of two of them the nearest pair.
#pragma once

#include <algorithm>
#include <array>

#include "core/types.h"

namespace limber::meshing::detail {

using Corners3 = std::array<Vec3, 3>;

inline Vec3 closest_on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 ab = b - a;
  const double length = ab.squaredNorm();
  return length > 0 ? Vec3(a + std::clamp((p - a).dot(ab) / length, 0.0, 1.0) * ab) : a;
}

inline Vec3 closest_on_triangle(const Corners3& t, const Vec3& p) {
  const Vec3 u = t[1] - t[0], v = t[2] - t[0], w = p - t[0];
  const Vec3 n = u.cross(v);
  const double area = n.squaredNorm();
  if (area > 0) {
    const double beta = w.cross(v).dot(n) / area, gamma = u.cross(w).dot(n) / area;
    if (beta >= 0 && gamma >= 0 && beta + gamma <= 1) return t[0] + beta * u + gamma * v;
  }
  Vec3 best = closest_on_segment(t[0], t[1], p);
  for (const Vec3& q : {closest_on_segment(t[1], t[2], p), closest_on_segment(t[2], t[0], p)})
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  return best;
}

struct Nearest {
  double squared_distance = 1e300;
  Vec3 on_a = Vec3::Zero(), on_b = Vec3::Zero();
  void include(const Vec3& a, const Vec3& b) {
    if (const double d = (a - b).squaredNorm(); d < squared_distance) *this = {d, a, b};
  }
};

// Of the segments a b and c d; Lumelsky 1985.
inline void include_segments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, Nearest& nearest) {
  const Vec3 u = b - a, v = d - c, w = c - a;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
  const double det = uu * vv - uv * uv;
  const double s = det > 0 ? std::clamp((uw * vv - vw * uv) / det, 0.0, 1.0) : 0;
  const Vec3 on_b = closest_on_segment(c, d, a + s * u);
  nearest.include(closest_on_segment(a, b, on_b), on_b);
}

// Of two triangles that do not pass through one another.
inline void include_triangles(const Corners3& a, const Corners3& b, Nearest& nearest) {
  for (int i = 0; i < 3; ++i) {
    nearest.include(a[i], closest_on_triangle(b, a[i]));
    nearest.include(closest_on_triangle(a, b[i]), b[i]);
    for (int k = 0; k < 3; ++k) include_segments(a[i], a[(i + 1) % 3], b[k], b[(k + 1) % 3], nearest);
  }
}

}  // namespace limber::meshing::detail
