#include "meshing/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "meshing/detail/tet_faces.h"

namespace limber::meshing {

namespace {

constexpr double degrees = 180 / std::numbers::pi;

// Of the six dihedrals; none where a face has no area.
std::optional<std::array<double, 6>> dihedral_cosines(const Vec3& a, const Vec3& b, const Vec3& c,
                                                      const Vec3& d) {
  const Vec3 ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  const std::array<Vec3, 4> normal{bc.cross(bd), ad.cross(ac), ab.cross(ad), ac.cross(ab)};  // outwards
  std::array<double, 6> cosines;
  std::size_t edge = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) {
      const double length = std::sqrt(normal[i].squaredNorm() * normal[j].squaredNorm());
      if (!(length > 0)) return {};
      cosines[edge++] = std::clamp(-normal[i].dot(normal[j]) / length, -1.0, 1.0);
    }
  return cosines;
}

}  // namespace

DihedralRange dihedral_range(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto cosines = dihedral_cosines(a, b, c, d);
  if (!cosines) return {0, 180};
  const auto [least, most] = std::minmax_element(cosines->begin(), cosines->end());
  return {std::acos(*most) * degrees, std::acos(*least) * degrees};
}

std::array<double, 6> dihedral_angles(const std::array<Vec3, 4>& p) {
  std::array<double, 6> angles{};
  if (const auto cosines = dihedral_cosines(p[0], p[1], p[2], p[3]))
    for (std::size_t i = 0; i < 6; ++i) angles[i] = std::acos((*cosines)[i]) * degrees;
  return angles;
}

double smallest_height(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  const double twice_largest_area =
      std::sqrt(std::max({ab.cross(ac).squaredNorm(), ab.cross(ad).squaredNorm(), ac.cross(ad).squaredNorm(),
                          bc.cross(bd).squaredNorm()}));
  return twice_largest_area > 0 ? std::abs(ab.cross(ac).dot(ad)) / twice_largest_area : 0;
}

bool keeps_limits(const TetLimits& limits, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  if (!(signed_volume(a, b, c, d) > 0)) return false;
  const DihedralRange range = dihedral_range(a, b, c, d);
  return range.min_deg >= limits.dihedrals.min_deg && range.max_deg <= limits.dihedrals.max_deg &&
         smallest_height(a, b, c, d) >= limits.min_height_m;
}

TetQuality measure_quality(const TetMesh& mesh) {
  TetQuality q;
  q.tets = int(mesh.tets.rows());
  q.vertices = int(mesh.positions.rows());
  q.boundary_triangles = int(boundary_triangles(mesh.tets).rows());
  const std::vector<int> lowest = detail::components(mesh.tets);
  for (int t = 0; t < q.tets; ++t) q.components += lowest[t] == t;
  q.volume_m3 = volume(mesh);
  if (q.tets == 0) return q;
  q.min_dihedral_deg = 180;
  q.min_volume_m3 = q.min_height_m = 1e300;
  std::vector<double> smallest;
  for (int t = 0; t < q.tets; ++t) {
    std::array<Vec3, 4> p;
    for (int k = 0; k < 4; ++k) p[k] = mesh.positions.row(mesh.tets(t, k));
    const DihedralRange range = dihedral_range(p[0], p[1], p[2], p[3]);
    smallest.push_back(range.min_deg);
    q.min_dihedral_deg = std::min(q.min_dihedral_deg, range.min_deg);
    q.max_dihedral_deg = std::max(q.max_dihedral_deg, range.max_deg);
    q.min_height_m = std::min(q.min_height_m, smallest_height(p[0], p[1], p[2], p[3]));
    q.min_volume_m3 = std::min(q.min_volume_m3, signed_volume(p[0], p[1], p[2], p[3]));
  }
  q.share_under_5_deg =
      double(std::count_if(smallest.begin(), smallest.end(), [](double x) { return x < 5; })) / q.tets;
  std::nth_element(smallest.begin(), smallest.begin() + q.tets / 2, smallest.end());
  q.median_min_dihedral_deg = smallest[q.tets / 2];
  return q;
}

}  // namespace limber::meshing
