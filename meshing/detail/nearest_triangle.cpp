#include "meshing/detail/nearest_triangle.h"

namespace limber::meshing::detail {

namespace {

constexpr int leaf_size = 4;
constexpr double slack = 1.04;  // of squared distances

double squared_distance(const Box& box, const Vec3& p) {
  return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).squaredNorm();
}

// Where s / (s + r) is of no length: the start.
double share(double s, double r) { return s + r > 0 ? s / (s + r) : 0; }

}  // namespace

Vec3 nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double ab_ap = ab.dot(ap), ac_ap = ac.dot(ap);
  if (ab_ap <= 0 && ac_ap <= 0) return a;
  const Vec3 bp = p - b;
  const double ab_bp = ab.dot(bp), ac_bp = ac.dot(bp);
  if (ab_bp >= 0 && ac_bp <= ab_bp) return b;
  const double beyond_ab = ab_ap * ac_bp - ab_bp * ac_ap;
  if (beyond_ab <= 0 && ab_ap >= 0 && ab_bp <= 0) return a + share(ab_ap, -ab_bp) * ab;
  const Vec3 cp = p - c;
  const double ab_cp = ab.dot(cp), ac_cp = ac.dot(cp);
  if (ac_cp >= 0 && ab_cp <= ac_cp) return c;
  const double beyond_ac = ab_cp * ac_ap - ab_ap * ac_cp;
  if (beyond_ac <= 0 && ac_ap >= 0 && ac_cp <= 0) return a + share(ac_ap, -ac_cp) * ac;
  const double beyond_bc = ab_bp * ac_cp - ab_cp * ac_bp;
  if (beyond_bc <= 0 && ac_bp - ab_bp >= 0 && ab_cp - ac_cp >= 0)
    return b + share(ac_bp - ab_bp, ab_cp - ac_cp) * (c - b);
  const double all = beyond_ab + beyond_ac + beyond_bc;
  return a + (beyond_ac / all) * ab + (beyond_ab / all) * ac;
}

NearestTriangle::NearestTriangle(const Points& positions, const Triangles& triangles)
    : bvh_(build_triangle_bvh(positions, triangles, leaf_size)) {
  corners_.reserve(bvh_.order.size());
  for (int t : bvh_.order)
    corners_.push_back(
        {positions.row(triangles(t, 0)), positions.row(triangles(t, 1)), positions.row(triangles(t, 2))});
}

NearestTriangle::Nearest NearestTriangle::at(const Vec3& p, double bound, double exact) const {
  Nearest best{bound, -1};
  if (bvh_.nodes.empty()) return best;
  struct Pending {
    double squared_distance;
    int node;
  };
  std::array<Pending, 64> stack;  // median splits: the depth is below 32
  std::size_t depth = 0;
  stack[depth++] = {squared_distance(bvh_.nodes[0].box, p), 0};
  while (depth > 0) {
    const Pending top = stack[--depth];
    if (top.squared_distance * (best.squared_distance > exact ? slack : 1) > best.squared_distance) continue;
    const auto& node = bvh_.nodes[std::size_t(top.node)];
    if (node.leaf()) {
      for (int i = node.begin; i < node.end; ++i) {
        const auto& [a, b, c] = corners_[std::size_t(i)];
        const double d = (nearest_on_triangle(a, b, c, p) - p).squaredNorm();
        const int triangle = bvh_.order[std::size_t(i)];
        if (d < best.squared_distance || (d == best.squared_distance && triangle < best.triangle))
          best = {d, triangle};
      }
      continue;
    }
    Pending near{squared_distance(bvh_.nodes[std::size_t(node.left)].box, p), node.left};
    Pending far{squared_distance(bvh_.nodes[std::size_t(node.right)].box, p), node.right};
    if (far.squared_distance < near.squared_distance) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return best;
}

}  // namespace limber::meshing::detail
