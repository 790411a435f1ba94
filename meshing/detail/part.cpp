#include "meshing/detail/part.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "core/error.h"
#include "meshing/detail/edges.h"

namespace limber::meshing::detail {

namespace {

int side_of(const Plane& plane, const Vec3& p) {
  const double distance = plane.normal.dot(p) - plane.offset;
  return distance > on_plane ? 1 : distance < -on_plane ? -1 : 0;
}

Vec3 crossing(const Plane& plane, const Vec3& a, const Vec3& b) {
  const double da = plane.normal.dot(a) - plane.offset, db = plane.normal.dot(b) - plane.offset;
  return a + (da / (da - db)) * (b - a);
}

// Is the origin strictly inside the hull of the spokes? Not exactly when a plane through two of them has all
// others on one side.
bool surrounds_origin(const std::vector<Vec3>& spokes) {
  constexpr double margin = 1e-9;
  constexpr std::size_t most = 20;  // the test is cubic, and such fans are rare
  if (spokes.size() < 4 || spokes.size() > most) return false;
  bool spans = false;
  for (std::size_t i = 0; i < spokes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3 normal = spokes[i].cross(spokes[j]);
      const double length = normal.norm();
      if (length < margin) continue;
      double lowest = 0, highest = 0;
      for (const Vec3& s : spokes) {
        const double height = normal.dot(s) / length;
        lowest = std::min(lowest, height), highest = std::max(highest, height);
      }
      if (lowest > -margin || highest < margin) return false;
      spans = true;
    }
  return spans;
}

}  // namespace

InsideTest::InsideTest(const Points& positions, const Triangles& triangles)
    : winding_(positions, triangles), voxels_(std::size_t(side * side * side)) {
  for (std::atomic<Voxel>& voxel : voxels_) voxel.store(Voxel::unknown, std::memory_order_relaxed);
  const Box box = bounding_box(positions);
  voxel_ = box.size().maxCoeff() / (side - 2);
  lower_ = box.center() - Vec3::Constant(0.5 * side * voxel_);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    Box b;
    for (int k = 0; k < 3; ++k) b.include(Vec3(positions.row(triangles(t, k))));
    const Vec3 origin = positions.row(triangles(t, 0));
    const Vec3 normal = (Vec3(positions.row(triangles(t, 1))) - origin)
                            .cross(Vec3(positions.row(triangles(t, 2))) - origin)
                            .normalized();
    const Eigen::Array3i from = ((b.lower - lower_) / voxel_).array().floor().cast<int>();
    const Eigen::Array3i to = ((b.upper - lower_) / voxel_).array().floor().cast<int>();
    const double reach = 0.5 * voxel_ * normal.cwiseAbs().sum() * (1 + 1e-9);
    for (int z = std::max(from.z(), 0); z <= std::min(to.z(), side - 1); ++z)
      for (int y = std::max(from.y(), 0); y <= std::min(to.y(), side - 1); ++y)
        for (int x = std::max(from.x(), 0); x <= std::min(to.x(), side - 1); ++x) {
          const Vec3 center = lower_ + voxel_ * Vec3(x + 0.5, y + 0.5, z + 0.5);
          if (std::abs(normal.dot(center - origin)) <= reach)
            voxels_[std::size_t((z * side + y) * side + x)].store(Voxel::at_surface,
                                                                  std::memory_order_relaxed);
        }
  }
}

bool InsideTest::operator()(const Vec3& point) {
  const Eigen::Array3i at = ((point - lower_) / voxel_).array().floor().cast<int>();
  if ((at < 0).any() || (at >= side).any()) return false;
  // A surface that is turned inside out bounds a solid too.
  const auto ask = [&](const Vec3& p) { return std::abs(winding_.at(p)) > 0.5; };
  std::atomic<Voxel>& known = voxels_[std::size_t((at.z() * side + at.y()) * side + at.x())];
  Voxel voxel = known.load(std::memory_order_relaxed);
  if (voxel == Voxel::at_surface) return ask(point);
  if (voxel == Voxel::unknown) {
    voxel = ask(lower_ + voxel_ * (at.cast<double>() + 0.5).matrix()) ? Voxel::inside : Voxel::outside;
    known.store(voxel, std::memory_order_relaxed);
  }
  return voxel == Voxel::inside;
}

Cell box_cell(const Box& box) {
  Cell cell;
  for (int i = 0; i < 8; ++i)
    cell.corners.push_back({i & 1 ? box.upper.x() : box.lower.x(), i & 2 ? box.upper.y() : box.lower.y(),
                            i & 4 ? box.upper.z() : box.lower.z()});
  cell.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return cell;
}

namespace {

using EdgeKey = std::uint64_t;
EdgeKey edge_key(int a, int b) { return EdgeKey(std::min(a, b)) << 32 | EdgeKey(std::max(a, b)); }

// The part of the cell where sign × (normal·x − offset) ≤ 0. Empty when nothing of it is strictly there.
// `section` gets the corners on the plane.
Cell clip(const Cell& cell, const Plane& plane, int sign, std::vector<Vec3>& section) {
  std::vector<int> sides, row(cell.corners.size(), -1);
  Cell kept;
  bool any = false;
  for (const Vec3& p : cell.corners) sides.push_back(sign * side_of(plane, p));
  for (std::size_t i = 0; i < sides.size(); ++i) {
    any = any || sides[i] < 0;
    if (sides[i] > 0) continue;
    row[i] = int(kept.corners.size());
    kept.corners.push_back(cell.corners[i]);
  }
  if (!any) return {};
  std::vector<int> rim;  // corners on the plane
  for (std::size_t i = 0; i < sides.size(); ++i)
    if (sides[i] == 0) rim.push_back(row[i]);
  std::unordered_map<EdgeKey, int> crossings;
  for (const auto& face : cell.faces) {
    std::vector<int> loop;
    bool below = false;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const int a = face[i], b = face[(i + 1) % face.size()];
      const int sa = sides[std::size_t(a)], sb = sides[std::size_t(b)];
      below = below || sa < 0;
      if (sa <= 0) loop.push_back(row[std::size_t(a)]);
      if (sa * sb >= 0) continue;
      const auto [it, is_new] = crossings.try_emplace(edge_key(a, b), int(kept.corners.size()));
      if (is_new) {
        kept.corners.push_back(crossing(plane, cell.corners[std::size_t(std::min(a, b))],
                                        cell.corners[std::size_t(std::max(a, b))]));
        rim.push_back(it->second);
      }
      loop.push_back(it->second);
    }
    if (below && loop.size() >= 3) kept.faces.push_back(loop);
  }
  Vec3 center = Vec3::Zero();
  for (int i : rim) {
    section.push_back(kept.corners[std::size_t(i)]);
    center += kept.corners[std::size_t(i)] / double(rim.size());
  }
  if (rim.size() >= 3) {  // the new face, its corners by their angle
    const Vec3 u = plane.normal.unitOrthogonal(), v = plane.normal.cross(u);
    std::vector<std::pair<double, int>> around;
    for (int i : rim) {
      const Vec3 d = kept.corners[std::size_t(i)] - center;
      around.emplace_back(sign * std::atan2(v.dot(d), u.dot(d)), i);
    }
    std::sort(around.begin(), around.end());
    kept.faces.emplace_back();
    for (const auto& [angle, i] : around) kept.faces.back().push_back(i);
  }
  return kept;
}

void add_polygon(Polygons& polygons, const std::vector<int>& loop, int triangle) {
  polygons.corners.insert(polygons.corners.end(), loop.begin(), loop.end());
  polygons.first.push_back(int(polygons.corners.size()));
  polygons.triangle.push_back(triangle);
}

}  // namespace

Vec3 area_vector(const Model& model, const Polygons& polygons, int polygon) {
  const auto corner = [&](int k) -> const Vec3& {
    return model.points[std::size_t(polygons.corners[std::size_t(k)])];
  };
  const int begin = polygons.first[std::size_t(polygon)], end = polygons.first[std::size_t(polygon) + 1];
  Vec3 sum = Vec3::Zero();
  for (int k = begin + 1; k + 1 < end; ++k)
    sum += 0.5 * (corner(k) - corner(begin)).cross(corner(k + 1) - corner(begin));
  return sum;
}

Model make_model(const Points& positions, const Triangles& triangles) {
  Model model;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) model.points.push_back(positions.row(v));
  model.buried.assign(model.points.size(), 0);
  std::vector<std::vector<int>> neighbours(model.points.size());
  for_each_edge(edge_uses(triangles), [&](std::span<const EdgeUse> uses) {
    neighbours[std::size_t(uses[0].lower)].push_back(uses[0].upper);
    neighbours[std::size_t(uses[0].upper)].push_back(uses[0].lower);
  });
  std::vector<Vec3> spokes;
  for (std::size_t v = 0; v < model.points.size(); ++v) {
    spokes.clear();
    for (int n : neighbours[v]) spokes.push_back(model.points[std::size_t(n)] - model.points[v]);
    model.buried[v] = surrounds_origin(spokes);
  }
  return model;
}

std::vector<int> points_of(const Part& part) {
  std::vector<int> points = part.surface.corners;
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::vector<Vec3> hull_candidates(const Model& model, const Part& part) {
  std::vector<Vec3> candidates = part.corners_inside;
  for (int p : points_of(part))
    if (!model.buried[std::size_t(p)]) candidates.push_back(model.points[std::size_t(p)]);
  sort_far_first(candidates);
  return candidates;
}

void sort_far_first(std::vector<Vec3>& points) {
  Box box;
  for (const Vec3& p : points) box.include(p);
  const Vec3 center = box.center();
  std::stable_sort(points.begin(), points.end(), [&](const Vec3& a, const Vec3& b) {
    return (a - center).squaredNorm() > (b - center).squaredNorm();
  });
}

Eigen::Matrix3d principal_axes(const std::vector<Vec3>& points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / double(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) spread += (p - mean) * (p - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

GrowingHull rough_hull(std::vector<Vec3> points, double share) {
  const Vec3 thin = principal_axes(points).col(0);
  double low = 1e300, high = -1e300;
  for (const Vec3& p : points) low = std::min(low, thin.dot(p)), high = std::max(high, thin.dot(p));
  sort_far_first(points);
  GrowingHull hull(share * std::max(high - low, 0.0));
  hull.add(points);
  return hull;
}

namespace {

void find_hull(const Model& model, Part& part) {
  const GrowingHull hull = rough_hull(hull_candidates(model, part), search_tolerance);
  part.hull = hull.vertices();
  part.hull_volume = hull.volume();
}

}  // namespace

Part whole(const Model& model, const Triangles& triangles) {
  Part part;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    add_polygon(part.surface, {triangles(t, 0), triangles(t, 1), triangles(t, 2)}, int(t));
  Box box;
  for (const Vec3& p : model.points) box.include(p);
  box.lower.array() -= 0.1, box.upper.array() += 0.1;  // its corners are outside the solid
  part.cells = {box_cell(box)};
  find_hull(model, part);
  return part;
}

namespace {

constexpr double nudge = 1e-6;

Vec3 mean(const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / double(points.size());
}

}  // namespace

std::pair<Part, Part> cut(Model& model, const Part& part, const Plane& plane, InsideTest& inside) {
  Part below, above;
  std::unordered_map<EdgeKey, int> crossings;
  std::vector<int> lower, upper;
  for (int i = 0; i < part.surface.count(); ++i) {
    const int begin = part.surface.first[std::size_t(i)], end = part.surface.first[std::size_t(i) + 1];
    const int* corners = part.surface.corners.data() + begin;
    const int count = end - begin;
    lower.clear(), upper.clear();
    bool any_below = false, any_above = false;
    for (int k = 0; k < count; ++k) {
      const int a = corners[k], b = corners[(k + 1) % count];
      const int sa = side_of(plane, model.points[std::size_t(a)]);
      const int sb = side_of(plane, model.points[std::size_t(b)]);
      any_below = any_below || sa < 0;
      any_above = any_above || sa > 0;
      if (sa <= 0) lower.push_back(a);
      if (sa >= 0) upper.push_back(a);
      if (sa == 0) model.buried[std::size_t(a)] = 0;  // its neighbours beyond the plane leave no trace
      if (sa * sb >= 0) continue;
      const auto [it, is_new] = crossings.try_emplace(edge_key(a, b), int(model.points.size()));
      if (is_new) {
        model.points.push_back(crossing(plane, model.points[std::size_t(std::min(a, b))],
                                        model.points[std::size_t(std::max(a, b))]));
        model.buried.push_back(0);
      }
      lower.push_back(it->second), upper.push_back(it->second);
    }
    const int triangle = part.surface.triangle[std::size_t(i)];
    if (!any_below && !any_above) {  // in the plane: with the solid that it bounds
      const bool faces_up = area_vector(model, part.surface, i).dot(plane.normal) > 0;
      add_polygon(faces_up ? below.surface : above.surface, lower, triangle);
    }
    if (any_below) add_polygon(below.surface, lower, triangle);
    if (any_above) add_polygon(above.surface, upper, triangle);
  }
  for (const Vec3& p : part.corners_inside) {
    const int side = side_of(plane, p);
    if (side <= 0) below.corners_inside.push_back(p);
    if (side >= 0) above.corners_inside.push_back(p);
  }
  for (const Cell& cell : part.cells) {
    std::vector<Vec3> section, same_section;
    Cell low = clip(cell, plane, 1, section), high = clip(cell, plane, -1, same_section);
    if (!low.corners.empty() && !high.corners.empty()) {
      // A corner may lie on the surface, with solid on one side of the cut alone: of a part in the middle of
      // the solid that no surface enters, all do.
      const Vec3 middle_of_low = mean(low.corners), middle_of_high = mean(high.corners);
      for (const Vec3& p : section) {
        if (inside(p + nudge * (middle_of_low - p))) below.corners_inside.push_back(p);
        if (inside(p + nudge * (middle_of_high - p))) above.corners_inside.push_back(p);
      }
    }
    if (!low.corners.empty()) below.cells.push_back(std::move(low));
    if (!high.corners.empty()) above.cells.push_back(std::move(high));
  }
  find_hull(model, below);
  find_hull(model, above);
  return {std::move(below), std::move(above)};
}

Part unite(const Part& a, const Part& b) {
  Part united = a;
  for (int i = 0; i < b.surface.count(); ++i)
    add_polygon(united.surface,
                {b.surface.corners.begin() + b.surface.first[std::size_t(i)],
                 b.surface.corners.begin() + b.surface.first[std::size_t(i) + 1]},
                b.surface.triangle[std::size_t(i)]);
  united.cells.insert(united.cells.end(), b.cells.begin(), b.cells.end());
  united.corners_inside.insert(united.corners_inside.end(), b.corners_inside.begin(), b.corners_inside.end());
  united.hull.insert(united.hull.end(), b.hull.begin(), b.hull.end());
  const GrowingHull hull = rough_hull(united.hull, search_tolerance);
  united.hull = hull.vertices();
  united.hull_volume = hull.volume();
  return united;
}

}  // namespace limber::meshing::detail
