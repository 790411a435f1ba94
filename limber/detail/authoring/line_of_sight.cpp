#include "limber/detail/authoring/line_of_sight.h"

#include <algorithm>
#include <vector>

#include "core/error.h"

namespace limber::detail {

double share_in_sight(const Points& points, const Vec3& toward_eye, std::span<const SurfaceMesh> hiding) {
  LIMBER_CHECK(points.rows() > 0 && toward_eye.norm() > 0, points.rows());
  // Axes with the eye at z = ∞.
  const Vec3 z = toward_eye.normalized(), x = z.unitOrthogonal();
  Eigen::Matrix3d axes;
  axes << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Points seen = points * axes.transpose();
  std::vector<bool> hidden(std::size_t(seen.rows()), false);
  const Vec3 lower = seen.colwise().minCoeff().transpose(), upper = seen.colwise().maxCoeff().transpose();
  for (const SurfaceMesh& mesh : hiding) {
    const Points corners = mesh.positions * axes.transpose();
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
      const Vec3 a = corners.row(mesh.triangles(t, 0)), ab = Vec3(corners.row(mesh.triangles(t, 1))) - a,
                 ac = Vec3(corners.row(mesh.triangles(t, 2))) - a;
      const Vec3 low = Vec3::Zero().cwiseMin(ab).cwiseMin(ac) + a,
                 high = Vec3::Zero().cwiseMax(ab).cwiseMax(ac) + a;
      if ((low.array() > upper.array()).head<2>().any() || (high.array() < lower.array()).any()) continue;
      const double area = ab.x() * ac.y() - ab.y() * ac.x();
      if (area == 0) continue;  // seen edge on
      for (Eigen::Index p = 0; p < seen.rows(); ++p) {
        const Vec3 d = Vec3(seen.row(p)) - a;
        const double s = (d.x() * ac.y() - d.y() * ac.x()) / area,
                     u = (ab.x() * d.y() - ab.y() * d.x()) / area;
        if (s >= 0 && u >= 0 && s + u <= 1 && s * ab.z() + u * ac.z() > d.z()) hidden[std::size_t(p)] = true;
      }
    }
  }
  return 1 - double(std::count(hidden.begin(), hidden.end(), true)) / double(hidden.size());
}

}  // namespace limber::detail
