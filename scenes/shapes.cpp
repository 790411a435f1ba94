#include "scenes/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

#include "scenes/detail/surface_builder.h"
#include "scenes/models.h"

namespace limber::scenes {

namespace {

constexpr int arc_steps = 6;  // segments of a quarter circle of a rounded edge

// Coordinates of the grid lines of a box along one axis: even inside, and over a bevel spaced so that
// make_box turns them into even steps of the arc.
std::vector<double> grid_lines(double size, double bevel, double longest) {
  std::vector<double> lines;
  const double inner = size / 2 - bevel;
  const int steps = arc_steps / 2;
  if (bevel > 0)
    for (int i = steps; i > 0; --i)
      lines.push_back(-inner - bevel * std::tan(std::numbers::pi / 4 * i / steps));
  const int n = inner > 0 ? pieces(2 * inner, longest) : 0;
  for (int i = 0; i <= n; ++i) lines.push_back(n == 0 ? 0 : inner * (2.0 * i / n - 1));
  if (bevel > 0)
    for (int i = 1; i <= steps; ++i)
      lines.push_back(inner + bevel * std::tan(std::numbers::pi / 4 * i / steps));
  return lines;
}

Vec3 rounded(const Vec3& p, const Vec3& inner, double bevel) {
  if (bevel == 0) return p;
  const Vec3 core = p.cwiseMax(-inner).cwiseMin(inner);
  return core + bevel * (p - core).normalized();
}

}  // namespace

SurfaceMesh make_box(const BoxModel& box) {
  std::array<std::vector<double>, 3> lines;
  for (int i = 0; i < 3; ++i) lines[std::size_t(i)] = grid_lines(box.size_m[i], box.bevel_m, box.triangle_m);
  const Vec3 inner = (box.size_m / 2).array() - box.bevel_m;
  SurfaceBuilder builder;
  std::map<std::array<int, 3>, int> vertex_from_lines;
  for (int axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto count = [&](int a) { return int(lines[std::size_t(a)].size()) - 1; };
      const auto vertex = [&](int i, int j) {
        std::array<int, 3> at{};
        at[std::size_t(axis)] = upper ? count(axis) : 0, at[std::size_t(u)] = i, at[std::size_t(v)] = j;
        const auto [entry, is_new] = vertex_from_lines.try_emplace(at, int(builder.positions.size()));
        if (is_new)
          builder.add(rounded(
              {lines[0][std::size_t(at[0])], lines[1][std::size_t(at[1])], lines[2][std::size_t(at[2])]},
              inner, box.bevel_m));
        return entry->second;
      };
      for (int i = 0; i < count(u); ++i)
        for (int j = 0; j < count(v); ++j) {
          const int a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1), d = vertex(i, j + 1);
          if (upper)
            builder.quad(a, b, c, d, (i + j) % 2);
          else
            builder.quad(a, d, c, b, (i + j) % 2);
        }
    }
  return builder.mesh();
}

namespace {

using Vec2 = Eigen::Vector2d;

// A rectangle about the origin with half sizes `half` and corners of radius `corner`; how far `p` is outside.
double outside_of(const Vec2& p, const Vec2& half, double corner) {
  const Vec2 q = p.cwiseAbs() - half + Vec2::Constant(corner);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - corner;
}

// Where the ray from `center` along `ray` leaves that rectangle (center is inside).
Vec2 leave_rectangle(const Vec2& center, const Vec2& ray, const Vec2& half, double corner) {
  double in = 0, out = half.norm() * 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (in + out) / 2;
    (outside_of(center + middle * ray, half, corner) < 0 ? in : out) = middle;
  }
  return center + in * ray;
}

// Unit rays from the hole's centre, counter-clockwise: dense enough along the rim, with one at every corner
// of rim and hole.
std::vector<Vec2> rays_to_rim(const Hole& hole, const Vec2& half, double bevel, double longest) {
  const std::array<Vec2, 4> corner{Vec2(half[0], -half[1]), half, Vec2(-half[0], half[1]), -half};
  std::vector<Vec2> rays;
  for (std::size_t side = 0; side < 4; ++side) {
    const Vec2 from = corner[side], to = corner[(side + 1) % 4];
    const double length = (to - from).norm();
    const Vec2 along = (to - from) / length;
    std::vector<double> stops{0, bevel, length - bevel, length};
    if (!hole.round)
      for (const Vec2& diagonal : {Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1), Vec2(-1, -1)}) {
        const Vec2 hit = leave_rectangle(hole.center_m, diagonal, half, 0);
        const double at = (hit - from).dot(along);
        const double off = std::abs((hit - from).dot(Vec2(-along[1], along[0])));
        if (off < 1e-9 * length && at > 0 && at < length) stops.push_back(at);
      }
    std::sort(stops.begin(), stops.end());
    for (std::size_t s = 0; s + 1 < stops.size(); ++s) {
      const double piece = stops[s + 1] - stops[s];
      if (piece < 1e-6 * length) continue;
      const int n = std::max(pieces(piece, longest), piece <= bevel ? arc_steps / 2 : 1);
      for (int i = 0; i < n; ++i)
        rays.push_back((from + (stops[s] + piece * i / n) * along - hole.center_m).normalized());
    }
  }
  return rays;
}

// One ring of the plate's surface: between the hole's outline (0) and the rim (1), moved inwards, at a
// height.
struct Station {
  double from_hole_to_rim, inset, height;
};

std::vector<Station> stations_round(double thickness, double bevel, double widest_face, double longest) {
  std::vector<Station> up;  // along the hole's wall from below to above, without the face
  const double flat = thickness - 2 * bevel;
  const auto arc = [&](int i, double sign) {
    const double angle = std::numbers::pi / 2 * i / arc_steps;
    return Station{0, bevel * (1 - std::cos(angle)), sign * (flat / 2 + bevel * std::sin(angle))};
  };
  if (bevel > 0)
    for (int i = arc_steps; i > 0; --i) up.push_back(arc(i, -1));
  const int n = flat > 0 ? pieces(flat, longest) : 0;
  for (int i = 0; i <= n; ++i) up.push_back({0, 0, n == 0 ? 0 : flat * (double(i) / n - 0.5)});
  if (bevel > 0)
    for (int i = 1; i <= arc_steps; ++i) up.push_back(arc(i, 1));

  std::vector<Station> all = up;
  const int m = pieces(widest_face, longest);
  for (int i = 1; i < m; ++i) all.push_back({double(i) / m, bevel, thickness / 2});
  for (auto s = up.rbegin(); s != up.rend(); ++s) all.push_back({1, s->inset, s->height});
  for (int i = m - 1; i > 0; --i) all.push_back({double(i) / m, bevel, -thickness / 2});
  return all;
}

Vec2 on_hole(const Hole& hole, const Vec2& ray, double inset) {
  const double reach = hole.size_m / 2 + inset;
  return hole.center_m + ray * (hole.round ? reach : reach / ray.cwiseAbs().maxCoeff());
}

}  // namespace

SurfaceMesh make_plate(const PlateModel& plate) {
  if (!plate.hole) return make_box(plate.box);
  const Hole& hole = *plate.hole;
  const auto [u, v] = plate_plane(plate.box.size_m);
  const int w = 3 - u - v;
  const double bevel = plate.box.bevel_m, longest = plate.box.triangle_m;
  const Vec2 half(plate.box.size_m[u] / 2, plate.box.size_m[v] / 2);
  const std::vector<Vec2> rays = rays_to_rim(hole, half, bevel, longest);

  const auto on_rim = [&](const Vec2& ray, double inset) {
    return leave_rectangle(hole.center_m, ray, half.array() - inset, bevel - inset);
  };
  double widest_face = 0;
  for (const Vec2& ray : rays)
    widest_face = std::max(widest_face, (on_rim(ray, bevel) - on_hole(hole, ray, bevel)).norm());
  const std::vector<Station> stations = stations_round(plate.box.size_m[w], bevel, widest_face, longest);

  SurfaceBuilder builder;
  for (const Vec2& ray : rays)
    for (const Station& s : stations) {
      const Vec2 flat =
          (1 - s.from_hole_to_rim) * on_hole(hole, ray, s.inset) + s.from_hole_to_rim * on_rim(ray, s.inset);
      Vec3 p;
      p[u] = flat[0], p[v] = flat[1], p[w] = s.height;
      builder.add(p);
    }
  const int rings = int(stations.size()), n = int(rays.size());
  const bool mirrored = w == 1;  // x, z, y is a left-handed frame
  for (int r = 0; r < n; ++r)
    for (int s = 0; s < rings; ++s) {
      const int r1 = (r + 1) % n, s1 = (s + 1) % rings;
      const int a = r * rings + s, b = r1 * rings + s, c = r1 * rings + s1, d = r * rings + s1;
      if (mirrored)
        builder.quad(a, b, c, d, (r + s) % 2);
      else
        builder.quad(a, d, c, b, (r + s) % 2);
    }
  return builder.mesh();
}

SurfaceMesh make_sphere(const SphereModel& sphere) {
  const double g = std::numbers::phi;
  SurfaceBuilder builder;
  for (const double s : {-1.0, 1.0})
    for (const double t : {-g, g}) {
      builder.add(Vec3(0, s, t).normalized());
      builder.add(Vec3(s, t, 0).normalized());
      builder.add(Vec3(t, 0, s).normalized());
    }
  const auto corners = builder.positions;
  const double edge = 2 / std::sqrt(1 + g * g);  // of the icosahedron in the unit sphere
  for (int a = 0; a < 12; ++a)
    for (int b = a + 1; b < 12; ++b)
      for (int c = b + 1; c < 12; ++c) {
        const auto p = [&](int i) { return corners[std::size_t(i)]; };
        const double longest = std::max({(p(a) - p(b)).norm(), (p(b) - p(c)).norm(), (p(c) - p(a)).norm()});
        if (longest > 1.01 * edge) continue;
        const bool outward = p(a).cross(p(b)).dot(p(c)) > 0;
        builder.triangles.emplace_back(a, outward ? b : c, outward ? c : b);
      }

  const double radius = sphere.diameter_m / 2;
  // Projected to the sphere, the middle edges come out longest: by 1.18 in the limit.
  for (double longest = edge * radius; longest > sphere.triangle_m; longest /= 2) {
    std::map<std::pair<int, int>, int> middle_of;
    const auto middle = [&](int a, int b) {
      const auto [entry, is_new] = middle_of.try_emplace(std::minmax(a, b), int(builder.positions.size()));
      if (is_new)
        builder.add((builder.positions[std::size_t(a)] + builder.positions[std::size_t(b)]).normalized());
      return entry->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (const Eigen::Vector3i& t : builder.triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
    }
    builder.triangles = std::move(finer);
  }
  for (Vec3& p : builder.positions) p *= radius;
  return builder.mesh();
}

}  // namespace limber::scenes
