#include "meshing/detail/proxy.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <vector>

namespace limber::meshing::detail {

namespace {

constexpr int most_vertices = 3000;

// The cluster of each vertex: numbers in the order of first use.
std::vector<int> clusters(const Points& positions, double cell, int& count) {
  std::map<std::array<long, 3>, int> number;
  std::vector<int> cluster;
  const Vec3 lower = bounding_box(positions).lower;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    std::array<long, 3> at;
    for (int k = 0; k < 3; ++k) at[std::size_t(k)] = long(std::floor((positions(v, k) - lower[k]) / cell));
    cluster.push_back(number.try_emplace(at, int(number.size())).first->second);
  }
  count = int(number.size());
  return cluster;
}

}  // namespace

Proxy make_proxy(const SurfaceMesh& mesh) {
  if (mesh.positions.rows() <= most_vertices) return {mesh, 0};
  double fine = 0, coarse = bounding_box(mesh.positions).diagonal();
  int count = 0;
  for (double cell = coarse / 32; coarse > 1.03 * fine;
       cell = fine > 0 ? 0.5 * (fine + coarse) : 0.5 * coarse) {
    clusters(mesh.positions, cell, count);
    (count > most_vertices ? fine : coarse) = cell;
  }
  const std::vector<int> cluster = clusters(mesh.positions, coarse, count);

  Proxy proxy;
  proxy.cell = coarse;
  proxy.mesh.positions = Points::Zero(count, 3);
  std::vector<double> members(std::size_t(count), 0.0);
  for (std::size_t v = 0; v < cluster.size(); ++v) {
    proxy.mesh.positions.row(cluster[v]) += mesh.positions.row(Eigen::Index(v));
    members[std::size_t(cluster[v])] += 1;
  }
  for (int c = 0; c < count; ++c) proxy.mesh.positions.row(c) /= members[std::size_t(c)];
  std::vector<std::array<int, 3>> kept;
  std::set<std::array<int, 3>> seen;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    std::array<int, 3> corners;
    for (int k = 0; k < 3; ++k) corners[std::size_t(k)] = cluster[std::size_t(mesh.triangles(t, k))];
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[0] == corners[2]) continue;
    if (seen.insert(corners).second) kept.push_back(corners);
  }
  proxy.mesh.triangles.resize(Eigen::Index(kept.size()), 3);
  for (std::size_t t = 0; t < kept.size(); ++t)
    proxy.mesh.triangles.row(Eigen::Index(t)) << kept[t][0], kept[t][1], kept[t][2];
  return proxy;
}

}  // namespace limber::meshing::detail
