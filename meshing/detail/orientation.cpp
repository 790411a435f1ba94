#include "meshing/detail/orientation.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <cmath>

namespace limber::meshing::detail {

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // Shewchuk's first filter (Adaptive precision floating-point arithmetic, 1997) answers nearly always.
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double xy = u.x() * v.y(), yx = u.y() * v.x(), yz = u.y() * v.z(), zy = u.z() * v.y(),
               zx = u.z() * v.x(), xz = u.x() * v.z();
  const double determinant = (yz - zy) * w.x() + (zx - xz) * w.y() + (xy - yx) * w.z();
  const double size = (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) +
                      (std::abs(zx) + std::abs(xz)) * std::abs(w.y()) +
                      (std::abs(xy) + std::abs(yx)) * std::abs(w.z());
  if (std::abs(determinant) > 8e-16 * size && size > 1e-250) return determinant > 0 ? 1 : -1;

  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto point = [](const Vec3& p) { return Kernel::Point_3(p.x(), p.y(), p.z()); };
  return int(CGAL::orientation(point(a), point(b), point(c), point(d)));
}

}  // namespace limber::meshing::detail
