#include "meshing/detail/triangulate.h"

#include <algorithm>
#include <cmath>

namespace limber::meshing::detail {

namespace {

using Vec2 = Eigen::Vector2d;
constexpr std::size_t max_corners_to_clip = 5'000;

double turn(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// The polygon seen from the tip of its area vector (Newell), along the coordinate axis nearest to it: no
// rounding. Empty when it has no area.
std::vector<Vec2> flattened(const Points& positions, const std::vector<int>& corners) {
  const Vec3 origin = positions.row(corners[0]);
  Vec3 area = Vec3::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    area += (Vec3(positions.row(corners[i])) - origin).cross(Vec3(positions.row(corners[i + 1])) - origin);
  int axis = 0;
  if (!(area.cwiseAbs().maxCoeff(&axis) > 0)) return {};
  const int u = (axis + (area[axis] > 0 ? 1 : 2)) % 3, v = (axis + (area[axis] > 0 ? 2 : 1)) % 3;
  std::vector<Vec2> flat;
  for (const int c : corners) flat.emplace_back(positions(c, u), positions(c, v));
  return flat;
}

// Corners left to cut, as a ring.
struct Ring {
  explicit Ring(int n) : next(std::size_t(n)), previous(std::size_t(n)) {
    for (int i = 0; i < n; ++i) next[i] = (i + 1) % n, previous[i] = (i + n - 1) % n;
  }
  void remove(int i) { next[previous[i]] = next[i], previous[next[i]] = previous[i]; }
  std::vector<int> next, previous;
};

// No reflex corner lies in the triangle. A corner at the same place as one of the triangle's is let pass, so
// that the two sides of a double edge do not block each other.
bool is_ear(int i, const Ring& ring, const std::vector<Vec2>& flat) {
  const Vec2 &a = flat[ring.previous[i]], &b = flat[i], &c = flat[ring.next[i]];
  if (!(turn(a, b, c) > 0)) return false;
  for (int j = ring.next[ring.next[i]]; j != ring.previous[i]; j = ring.next[j]) {
    const Vec2& p = flat[j];
    if (turn(flat[ring.previous[j]], p, flat[ring.next[j]]) > 0) continue;
    if (p == a || p == b || p == c) continue;
    if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
  }
  return true;
}

}  // namespace

void triangulate(const Points& positions, std::span<const int> given,
                 std::vector<std::array<int, 3>>& triangles) {
  if (given.size() == 3) return triangles.push_back({given[0], given[1], given[2]});
  std::vector<int> corners;
  for (std::size_t i = 0; i < given.size(); ++i)
    if (positions.row(given[i]) != positions.row(given[(i + given.size() - 1) % given.size()]))
      corners.push_back(given[i]);
  const int n = int(corners.size());
  if (n < 3) return triangles.push_back({given[0], given[0], given[1]});
  const auto fan = [&] {
    for (int i = 1; i + 1 < n; ++i) triangles.push_back({corners[0], corners[i], corners[i + 1]});
  };
  if (n == 3 || corners.size() > max_corners_to_clip) return fan();
  const std::vector<Vec2> flat = flattened(positions, corners);
  if (flat.empty()) return fan();

  Ring ring(n);
  int left = n, i = 1, misses = 0;
  while (left > 3 && misses < left) {
    if (is_ear(i, ring, flat)) {
      triangles.push_back({corners[ring.previous[i]], corners[i], corners[ring.next[i]]});
      ring.remove(i);
      --left, misses = 0;
      i = ring.next[ring.next[i]];  // not the neighbour: alternate corners give fewer slivers than a fan
    } else {
      ++misses, i = ring.next[i];
    }
  }
  // One triangle; or more, when a whole round found no ear: then the polygon crosses itself, and any cut will
  // do.
  for (const int apex = ring.previous[i]; ring.next[i] != apex; i = ring.next[i])
    triangles.push_back({corners[apex], corners[i], corners[ring.next[i]]});
}

}  // namespace limber::meshing::detail
