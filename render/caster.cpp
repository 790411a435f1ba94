#include "render/caster.h"

#include <array>
#include <cmath>
#include <map>

#include "core/error.h"

namespace limber::render {

namespace {

Caster clustered(const SurfaceMesh& fine, double cell_m) {
  struct Cluster {
    Vec3 sum = Vec3::Zero();
    int count = 0;
    Eigen::Index nearest = -1;
  };
  std::map<std::array<int, 3>, int> number;
  std::vector<int> cluster_of;
  std::vector<Cluster> clusters;
  const Vec3 corner = bounding_box(fine.positions).lower;
  for (Eigen::Index v = 0; v < fine.positions.rows(); ++v) {
    const Vec3 place = fine.positions.row(v);
    const Eigen::Vector3i cell = ((place - corner) / cell_m).cast<int>();
    const int c = number.try_emplace({cell.x(), cell.y(), cell.z()}, int(clusters.size())).first->second;
    if (c == int(clusters.size())) clusters.emplace_back();
    clusters[std::size_t(c)].sum += place, ++clusters[std::size_t(c)].count;
    cluster_of.push_back(c);
  }
  const auto from_middle = [&](const Cluster& c, Eigen::Index v) {
    return (Vec3(fine.positions.row(v)) - c.sum / c.count).squaredNorm();
  };
  for (Eigen::Index v = 0; v < fine.positions.rows(); ++v) {
    Cluster& c = clusters[std::size_t(cluster_of[std::size_t(v)])];
    if (c.nearest < 0 || from_middle(c, v) < from_middle(c, c.nearest)) c.nearest = v;
  }
  Caster caster{{}, Triangles(fine.triangles.rows(), 3)};
  for (const Cluster& c : clusters) caster.vertices.push_back(c.nearest);
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < fine.triangles.rows(); ++t) {
    const auto at = [&](int i) { return cluster_of[std::size_t(fine.triangles(t, i))]; };
    if (at(0) != at(1) && at(1) != at(2) && at(2) != at(0))
      caster.triangles.row(kept++) << at(0), at(1), at(2);
  }
  caster.triangles.conservativeResize(kept, 3);
  return caster;
}

}  // namespace

Points Caster::positions(const Points& fine) const {
  Points picked(Eigen::Index(vertices.size()), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i) picked.row(Eigen::Index(i)) = fine.row(vertices[i]);
  return picked;
}

Caster coarse_caster(const SurfaceMesh& fine, int triangles) {
  LIMBER_CHECK(triangles > 0 && fine.triangles.rows() > 0, triangles, fine.triangles.rows());
  // A square of a cell's size holds about two triangles.
  double cell_m = std::sqrt(2 * area(fine) / triangles);
  LIMBER_CHECK(cell_m > 0, cell_m);
  for (;; cell_m *= 1.1)
    if (Caster caster = clustered(fine, cell_m); caster.triangles.rows() <= triangles) return caster;
}

}  // namespace limber::render
