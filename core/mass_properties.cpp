#include "core/mass_properties.h"

#include <algorithm>
#include <array>
#include <vector>

namespace limber {

namespace {

// Moments about a point near the body, so that nothing cancels far from zero.
class Moments {
 public:
  explicit Moments(const Vec3& origin) : origin_(origin) {}

  void add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const double volume = signed_volume(a, b, c, d);
    const Vec3 corners[] = {a - origin_, b - origin_, c - origin_, d - origin_};
    Vec3 sum = Vec3::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Vec3& corner : corners) sum += corner, squares += corner * corner.transpose();
    volume_ += volume;
    first_ += volume / 4 * sum;
    second_ += volume / 20 * (squares + sum * sum.transpose());
  }
  MassProperties properties() const {
    if (volume_ == 0) return {};
    const Vec3 center = first_ / volume_;
    const Eigen::Matrix3d about_center = second_ - volume_ * center * center.transpose();
    return {volume_, origin_ + center, about_center.trace() * Eigen::Matrix3d::Identity() - about_center};
  }

 private:
  Vec3 origin_, first_ = Vec3::Zero();
  double volume_ = 0;
  Eigen::Matrix3d second_ = Eigen::Matrix3d::Zero();
};

}  // namespace

bool is_closed(const Triangles& triangles) {
  std::vector<std::array<int, 3>> edges;  // lower vertex, higher, way
  edges.reserve(std::size_t(triangles.size()));
  for (Eigen::Index f = 0; f < triangles.rows(); ++f)
    for (int i = 0; i < 3; ++i) {
      const int from = triangles(f, i), to = triangles(f, (i + 1) % 3);
      edges.push_back({std::min(from, to), std::max(from, to), from < to ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end());
  for (std::size_t first = 0, last; first < edges.size(); first = last) {
    int sum = 0;
    for (last = first;
         last < edges.size() && edges[last][0] == edges[first][0] && edges[last][1] == edges[first][1];
         ++last)
      sum += edges[last][2];
    if (sum != 0) return false;
  }
  return true;
}

MassProperties mass_properties(const Points& points, const Triangles& triangles) {
  if (triangles.rows() == 0) return {};
  const Vec3 origin = points.row(triangles(0, 0));
  Moments moments(origin);
  for (const auto& t : triangles.rowwise())
    moments.add(origin, points.row(t[0]), points.row(t[1]), points.row(t[2]));
  return moments.properties();
}

MassProperties mass_properties(const TetMesh& mesh) {
  if (mesh.tets.rows() == 0) return {};
  Moments moments(mesh.positions.row(mesh.tets(0, 0)));
  for (const auto& t : mesh.tets.rowwise())
    moments.add(mesh.positions.row(t[0]), mesh.positions.row(t[1]), mesh.positions.row(t[2]),
                mesh.positions.row(t[3]));
  return moments.properties();
}

}  // namespace limber
