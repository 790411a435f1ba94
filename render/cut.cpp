// A cap: the loops in which a plane meets a surface, filled by a sweep.
//
// A vertex on the plane counts as above it, so each triangle that has vertices on both sides gives one
// segment between two of its edges, and segments of a closed surface join to loops whatever its shape. The
// sweep goes up the plane from one height of a segment's end to the next; between two such heights segments
// do not end, and from left to right the winding number says where inside is. So a fold, a hole or a piece
// within a piece is no special case. Where surfaces pass through themselves segments may cross between two
// heights, and the cap is off there by less than that strip.
#include "render/cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>
#include <vector>

namespace limber::render {

namespace {

std::uint64_t key_of(int a, int b) {
  return std::uint64_t(std::uint32_t(std::min(a, b))) << 32 | std::uint32_t(std::max(a, b));
}

struct Loops {
  std::vector<Eigen::Vector2d> points;
  std::vector<std::array<int, 2>> segments;  // from, to
};

// In the plane's own coordinates.
Loops loops_of(const Points& positions, const Triangles& triangles, const Eigen::Vector4d& plane,
               const Eigen::Matrix<double, 2, 3>& plane_from_world) {
  const Eigen::VectorXd height = (positions * plane.head<3>()).array() + plane[3];
  Loops loops;
  std::unordered_map<std::uint64_t, int> point_of_edge;
  const auto point_on = [&](int a, int b) {
    const auto [at, fresh] = point_of_edge.try_emplace(key_of(a, b), int(loops.points.size()));
    if (fresh) {
      if (a > b) std::swap(a, b);  // the same point for both triangles, to the bit
      const double share = height[a] / (height[a] - height[b]);
      const Vec3 place = positions.row(a) + share * (positions.row(b) - positions.row(a));
      loops.points.push_back(plane_from_world * place);
    }
    return at->second;
  };
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    int leaves = -1, enters = -1;
    for (int i = 0; i < 3; ++i) {
      const int a = triangles(t, i), b = triangles(t, (i + 1) % 3);
      if (height[a] >= 0 && height[b] < 0) leaves = point_on(a, b);
      if (height[a] < 0 && height[b] >= 0) enters = point_on(a, b);
    }
    if (leaves >= 0) loops.segments.push_back({leaves, enters});
  }
  return loops;
}

// A segment that goes up or down, its lower end first.
struct Side {
  int low, high;  // points
  int winding;    // +1: it went up
};

struct Crossing {
  double x;
  int side;   // −1: a point
  int point;  // −1: a side passes here
  auto operator<=>(const Crossing&) const = default;
};

}  // namespace

bool has_inside(const Triangles& triangles) {
  std::unordered_map<std::uint64_t, int> passed;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      const int a = triangles(t, i), b = triangles(t, (i + 1) % 3);
      passed[key_of(a, b)] += a < b ? 1 : -1;
    }
  return std::all_of(passed.begin(), passed.end(), [](const auto& edge) { return edge.second == 0; });
}

SurfaceMesh cap_of(const Points& positions, const Triangles& triangles, const Eigen::Vector4d& plane) {
  const Vec3 normal = plane.head<3>().normalized(), x_axis = normal.unitOrthogonal(),
             y_axis = x_axis.cross(normal);  // x × y = −normal
  Eigen::Matrix<double, 2, 3> plane_from_world;
  plane_from_world << x_axis.transpose(), y_axis.transpose();
  const Loops loops = loops_of(positions, triangles, plane, plane_from_world);

  std::vector<double> heights;
  for (const Eigen::Vector2d& p : loops.points) heights.push_back(p.y());
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  const auto line_of = [&](int point) {
    return std::size_t(
        std::lower_bound(heights.begin(), heights.end(), loops.points[std::size_t(point)].y()) -
        heights.begin());
  };
  std::vector<Side> sides;
  std::vector<std::vector<int>> begins(heights.size());  // sides, by the line of their lower end
  for (const auto& [from, to] : loops.segments) {
    const double rise = loops.points[std::size_t(to)].y() - loops.points[std::size_t(from)].y();
    if (rise == 0) continue;
    begins[line_of(rise > 0 ? from : to)].push_back(int(sides.size()));
    sides.push_back(rise > 0 ? Side{from, to, 1} : Side{to, from, -1});
  }
  std::vector<std::vector<int>> points_of_line(heights.size());
  for (std::size_t p = 0; p < loops.points.size(); ++p) points_of_line[line_of(int(p))].push_back(int(p));

  const auto x_of = [&](const Side& side, double y) {
    const Eigen::Vector2d &low = loops.points[std::size_t(side.low)],
                          &high = loops.points[std::size_t(side.high)];
    return low.x() + (high.x() - low.x()) * ((y - low.y()) / (high.y() - low.y()));
  };
  std::vector<Eigen::Vector2d> corners;
  std::vector<std::array<int, 3>> made;
  // What lies on a line, from left to right, and which corner of the cap it is.
  struct Line {
    std::vector<Crossing> crossings;
    std::vector<int> corner;  // of each; −1: none yet
    double y = 0;
  };
  const auto line_at = [&](std::size_t k, const std::vector<int>& passing) {
    Line line;
    line.y = heights[k];
    for (const int p : points_of_line[k]) line.crossings.push_back({loops.points[std::size_t(p)].x(), -1, p});
    for (const int s : passing) line.crossings.push_back({x_of(sides[std::size_t(s)], line.y), s, -1});
    std::sort(line.crossings.begin(), line.crossings.end());
    line.corner.assign(line.crossings.size(), -1);
    return line;
  };
  const auto place_on = [&](const Line& line, int side, int end) {
    const auto is_it = [&](const Crossing& c) { return c.side == side || (c.point == end && c.side < 0); };
    return std::find_if(line.crossings.begin(), line.crossings.end(), is_it) - line.crossings.begin();
  };
  const auto corner_at = [&](Line& line, std::ptrdiff_t i) {
    int& corner = line.corner[std::size_t(i)];
    if (corner < 0) {
      corner = int(corners.size());
      corners.emplace_back(line.crossings[std::size_t(i)].x, line.y);
    }
    return corner;
  };
  // Between two lines: triangles from the left to the right, with all that lies on either line in between.
  const auto fill = [&](Line& below, Line& above, int left, int right) {
    const Side &l = sides[std::size_t(left)], &r = sides[std::size_t(right)];
    auto [b, b_end] = std::minmax({place_on(below, left, l.low), place_on(below, right, r.low)});
    auto [a, a_end] = std::minmax({place_on(above, left, l.high), place_on(above, right, r.high)});
    while (b < b_end || a < a_end) {
      const double next_below = b < b_end ? below.crossings[std::size_t(b + 1)].x : INFINITY,
                   next_above = a < a_end ? above.crossings[std::size_t(a + 1)].x : INFINITY;
      const int lower = corner_at(below, b), upper = corner_at(above, a);
      if (next_below <= next_above)
        made.push_back({lower, corner_at(below, ++b), upper});
      else
        made.push_back({lower, corner_at(above, ++a), upper});
    }
  };

  std::vector<int> active;  // sides in the strip below the line
  Line below;
  for (std::size_t k = 0; k < heights.size(); ++k) {
    std::vector<int> passing = active;
    std::erase_if(passing, [&](int s) {
      return loops.points[std::size_t(sides[std::size_t(s)].high)].y() == heights[k];
    });
    Line line = line_at(k, passing);
    std::vector<std::pair<double, int>> across;  // the strip, half way up
    for (const int s : active) across.emplace_back(x_of(sides[std::size_t(s)], 0.5 * (below.y + line.y)), s);
    std::sort(across.begin(), across.end());
    int winding = 0, left = -1;
    for (const auto& [x, s] : across) {
      if (winding == 0) left = s;
      winding += sides[std::size_t(s)].winding;
      if (winding == 0) fill(below, line, left, s);
    }
    active = std::move(passing);
    active.insert(active.end(), begins[k].begin(), begins[k].end());
    below = std::move(line);
  }

  SurfaceMesh cap{Points(Eigen::Index(corners.size()), 3), Triangles(Eigen::Index(made.size()), 3)};
  const Vec3 origin = -plane[3] / plane.head<3>().norm() * normal;
  for (std::size_t c = 0; c < corners.size(); ++c)
    cap.positions.row(Eigen::Index(c)) =
        (origin + corners[c].x() * x_axis + corners[c].y() * y_axis).transpose();
  for (std::size_t t = 0; t < made.size(); ++t)
    cap.triangles.row(Eigen::Index(t)) << made[t][0], made[t][1], made[t][2];
  return cap;
}

SurfaceMesh clipped(SurfaceMesh mesh, std::span<const Eigen::Vector4d> planes) {
  for (const Eigen::Vector4d& plane : planes) {
    const Eigen::VectorXd height = (mesh.positions * plane.head<3>()).array() + plane[3];
    if (height.size() == 0 || height.minCoeff() >= 0) continue;
    std::vector<Vec3> points;
    std::vector<int> point_of_vertex(std::size_t(height.size()), -1);
    std::unordered_map<std::uint64_t, int> point_of_edge;
    const auto kept = [&](int v) {
      int& point = point_of_vertex[std::size_t(v)];
      if (point < 0) point = int(points.size()), points.push_back(mesh.positions.row(v));
      return point;
    };
    const auto point_on = [&](int a, int b) {
      const auto [at, fresh] = point_of_edge.try_emplace(key_of(a, b), int(points.size()));
      if (fresh) {
        if (a > b) std::swap(a, b);
        const double share = height[a] / (height[a] - height[b]);
        points.push_back(mesh.positions.row(a) + share * (mesh.positions.row(b) - mesh.positions.row(a)));
      }
      return at->second;
    };
    std::vector<std::array<int, 3>> made;
    for (const auto t : mesh.triangles.rowwise()) {
      std::array<int, 4> corner;
      int corners = 0;
      for (int i = 0; i < 3; ++i) {
        const int a = t[i], b = t[(i + 1) % 3];
        if (height[a] >= 0) corner[std::size_t(corners++)] = kept(a);
        if ((height[a] >= 0) != (height[b] >= 0)) corner[std::size_t(corners++)] = point_on(a, b);
      }
      for (int i = 2; i < corners; ++i)
        made.push_back({corner[0], corner[std::size_t(i - 1)], corner[std::size_t(i)]});
    }
    mesh = {Points(Eigen::Index(points.size()), 3), Triangles(Eigen::Index(made.size()), 3)};
    for (std::size_t p = 0; p < points.size(); ++p)
      mesh.positions.row(Eigen::Index(p)) = points[p].transpose();
    for (std::size_t t = 0; t < made.size(); ++t)
      mesh.triangles.row(Eigen::Index(t)) << made[t][0], made[t][1], made[t][2];
  }
  return mesh;
}

Points rim_of(const SurfaceMesh& mesh) {
  std::map<std::pair<int, int>, int> triangles_of_edge;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i)
      ++triangles_of_edge[std::minmax({mesh.triangles(t, i), mesh.triangles(t, (i + 1) % 3)})];
  std::erase_if(triangles_of_edge, [](const auto& edge) { return edge.second != 1; });
  Points ends(2 * Eigen::Index(triangles_of_edge.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [edge, one] : triangles_of_edge) {
    ends.row(row++) = mesh.positions.row(edge.first);
    ends.row(row++) = mesh.positions.row(edge.second);
  }
  return ends;
}

SurfaceMesh cut_coarsely(const SurfaceMesh& mesh, std::span<const Eigen::Vector4d> planes) {
  std::vector<SurfaceMesh> parts{mesh};
  for (const Eigen::Vector4d& plane : planes) parts.push_back(cap_of(mesh.positions, mesh.triangles, plane));
  Eigen::Index points = 0, triangles = 0;
  for (const SurfaceMesh& part : parts) points += part.positions.rows(), triangles += part.triangles.rows();
  SurfaceMesh left{Points(points, 3), Triangles(triangles, 3)};
  points = triangles = 0;
  for (const SurfaceMesh& part : parts) {
    left.positions.middleRows(points, part.positions.rows()) = part.positions;
    for (Eigen::Index t = 0; t < part.triangles.rows(); ++t) {
      Vec3 middle = Vec3::Zero();
      for (int i = 0; i < 3; ++i) middle += part.positions.row(part.triangles(t, i)).transpose() / 3;
      const double slack = 1e-9 * (1 + middle.norm());  // a cap lies in its own plane
      if (std::all_of(planes.begin(), planes.end(), [&](const Eigen::Vector4d& plane) {
            return plane.dot(middle.homogeneous()) >= -slack;
          }))
        left.triangles.row(triangles++) = part.triangles.row(t).array() + int(points);
    }
    points += part.positions.rows();
  }
  left.triangles.conservativeResize(triangles, 3);
  return left;
}

}  // namespace limber::render
