#include "meshing/convex_hull.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "core/progress.h"
#include "meshing/detail/orientation.h"

namespace limber::meshing {

namespace {

using Face = std::array<int, 3>;

// Four points that span a volume, the farthest apart first: a fat start keeps later tests in the quick
// filter.
std::array<int, 4> first_tetrahedron(const std::vector<Vec3>& points) {
  const auto farthest = [&](auto&& measure) {
    int best = 0;
    for (int i = 1; i < int(points.size()); ++i)
      if (measure(points[std::size_t(i)]) > measure(points[std::size_t(best)])) best = i;
    return best;
  };
  const auto at = [&](int i) -> const Vec3& { return points[std::size_t(i)]; };
  const int a = farthest([&](const Vec3& p) { return (p - at(0)).norm(); });
  const int b = farthest([&](const Vec3& p) { return (p - at(a)).norm(); });
  const Vec3 along = at(b) - at(a);
  const int c = farthest([&](const Vec3& p) { return (p - at(a)).cross(along).norm(); });
  const Vec3 normal = along.cross(at(c) - at(a));
  int d = farthest([&](const Vec3& p) { return std::abs((p - at(a)).dot(normal)); });
  for (int i = 0; i < int(points.size()) && detail::orientation(at(a), at(b), at(c), at(d)) == 0; ++i) d = i;
  if (detail::orientation(at(a), at(b), at(c), at(d)) == 0)
    throw InputError(
        fmt::format("a convex hull needs points that are not all in one plane; these {} are", points.size()));
  return {a, b, c, d};
}

// Points are put in one by one. Each that is still outside hangs on one face that sees it, so what is inside
// is not asked again (Barber, Dobkin and Huhdanpaa, The quickhull algorithm for convex hulls, 1996): a point
// above a face that goes is above one of those that come, or inside. For if it is above some face that stays,
// then, since what it sees is connected, above two that meet at the rim, and so above the new one between
// them.
std::vector<Face> hull_faces(const std::vector<Vec3>& points) {
  const auto at = [&](int i) -> const Vec3& { return points[std::size_t(i)]; };
  const auto sees = [&](const Face& f, int p) {
    return detail::orientation(at(f[0]), at(f[1]), at(f[2]), at(p)) > 0;
  };
  auto [a, b, c, d] = first_tetrahedron(points);
  if (detail::orientation(at(a), at(b), at(c), at(d)) > 0) std::swap(b, c);
  struct Seen {
    Face face;
    std::vector<int> by;  // of those outside
  };
  std::vector<Seen> faces = {{{a, b, c}, {}}, {{a, d, b}, {}}, {{b, d, c}, {}}, {{c, d, a}, {}}};
  std::vector<char> outside(points.size(), 0);
  const auto hang = [&](int p, std::size_t first_face) {
    const auto seen = std::find_if(faces.begin() + std::ptrdiff_t(first_face), faces.end(),
                                   [&](const Seen& f) { return sees(f.face, p); });
    outside[std::size_t(p)] = seen != faces.end();
    if (seen != faces.end()) seen->by.push_back(p);
  };
  for (int p = 0; p < int(points.size()); ++p) hang(p, 0);

  // Far points first: most of the others are then inside at once.
  const Vec3 center = (at(a) + at(b) + at(c) + at(d)) / 4;
  std::vector<int> order(points.size()), loose;
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
    return (at(i) - center).squaredNorm() > (at(j) - center).squaredNorm();
  });
  std::vector<std::array<int, 2>> sides;
  for (int p : order) {
    throw_if_stopped();
    if (!outside[std::size_t(p)]) continue;
    sides.clear(), loose.clear();
    std::size_t kept = 0;
    for (Seen& f : faces) {
      if (!sees(f.face, p)) {
        if (&faces[kept] != &f) faces[kept] = std::move(f);
        ++kept;
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k) sides.push_back({f.face[k], f.face[(k + 1) % 3]});
      loose.insert(loose.end(), f.by.begin(), f.by.end());
    }
    faces.resize(kept);
    // The rim: sides of visible faces whose other side is not visible. With exact signs it is one loop.
    std::vector<std::array<int, 2>> sorted = sides;
    std::sort(sorted.begin(), sorted.end());
    for (const auto& side : sides)
      if (!std::binary_search(sorted.begin(), sorted.end(), std::array<int, 2>{side[1], side[0]}))
        faces.push_back({{side[0], side[1], p}, {}});
    for (const int q : loose)
      if (q != p) hang(q, kept);
  }
  std::vector<Face> all;
  for (const Seen& f : faces) all.push_back(f.face);
  return all;
}

// A vertex inside a flat face or on a straight edge has fewer than three folded edges.
std::vector<char> extreme_vertices(const std::vector<Vec3>& points, const std::vector<Face>& faces) {
  std::map<std::array<int, 2>, int> opposite;  // directed side → third corner
  for (const Face& f : faces)
    for (std::size_t k = 0; k < 3; ++k) opposite[{f[k], f[(k + 1) % 3]}] = f[(k + 2) % 3];
  std::vector<int> folded(points.size(), 0);
  for (const auto& [side, third] : opposite) {
    const int other = opposite.at({side[1], side[0]});
    if (detail::orientation(points[std::size_t(side[0])], points[std::size_t(side[1])],
                            points[std::size_t(third)], points[std::size_t(other)]) != 0)
      ++folded[std::size_t(side[0])];
  }
  std::vector<char> extreme(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) extreme[v] = folded[v] >= 3;
  return extreme;
}

}  // namespace

ConvexShell convex_hull(const Points& positions) {
  std::vector<Vec3> points;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) points.push_back(positions.row(i));
  if (points.size() < 4)
    throw InputError(fmt::format("a convex hull needs at least 4 points, not {}", points.size()));
  std::vector<Face> faces;
  for (bool all_extreme = false; !all_extreme;) {
    faces = hull_faces(points);
    const std::vector<char> extreme = extreme_vertices(points, faces);
    std::vector<char> used(points.size(), 0);
    for (const Face& f : faces)
      for (int v : f) used[std::size_t(v)] = 1;
    all_extreme = true;
    std::vector<Vec3> remaining;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (used[v] && !extreme[v]) all_extreme = false;
      if (extreme[v]) remaining.push_back(points[v]);
    }
    if (!all_extreme) {
      points = remaining;
      continue;
    }
    std::vector<int> row(points.size(), -1);
    for (std::size_t v = 0, next = 0; v < points.size(); ++v)
      if (extreme[v]) row[v] = int(next++);
    for (Face& f : faces) {
      for (int& v : f) v = row[std::size_t(v)];
      std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
    }
    points = remaining;
  }
  std::sort(faces.begin(), faces.end());
  ConvexShell shell;
  shell.vertices.resize(Eigen::Index(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v) shell.vertices.row(Eigen::Index(v)) = points[v].transpose();
  shell.triangles.resize(Eigen::Index(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    shell.triangles.row(Eigen::Index(f)) << faces[f][0], faces[f][1], faces[f][2];
  return shell;
}

}  // namespace limber::meshing
