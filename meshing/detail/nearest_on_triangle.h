#pragma once

#include "core/types.h"

namespace limber::meshing::detail {

// Of a point and the nearest of the triangle (a b c), which may be flat. Ericson, "Real-Time Collision
// Detection" (2005), 5.1.5.
inline Vec3 nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  // Where s / (s + r) is of no length: the start.
  const auto share = [](double s, double r) { return s + r > 0 ? s / (s + r) : 0; };
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

}  // namespace limber::meshing::detail
