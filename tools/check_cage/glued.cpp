#include <algorithm>
#include <map>
#include <numeric>

#include "tools/check_cage/cage.h"

namespace check {
namespace {

struct HalfSpace {
  Point normal;  // inwards
  double offset;
  double depth(const Point& p) const { return dot(normal, p) - offset; }
};
using Inside = std::array<HalfSpace, 4>;

Inside inside_of(const std::array<Point, 4>& p) {
  Inside planes;
  for (std::size_t k = 0; k < 4; ++k) {
    const Point &a = p[(k + 1) % 4], &b = p[(k + 2) % 4], &c = p[(k + 3) % 4];
    Point n = cross(b - a, c - a);
    if (dot(n, p[k] - a) < 0) n = -1.0 * n;
    planes[k] = {n, dot(n, a)};
  }
  return planes;
}

// The part of a polygon (or, with two corners, of a segment) in the tet.
std::vector<Point> clipped(std::vector<Point> polygon, const Inside& tet) {
  for (const HalfSpace& plane : tet) {
    std::vector<Point> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Point &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double a = plane.depth(p), b = plane.depth(q);
      if (a >= 0) kept.push_back(p);
      if ((a < 0) != (b < 0)) kept.push_back(p + (a / (a - b)) * (q - p));
    }
    polygon = std::move(kept);
  }
  return polygon;
}

struct Sample {
  Point at, normal;
  int triangle;  // of those in the tet
};

struct InTet {
  const Solid& solid;
  Inside planes;
  std::vector<int> triangles;  // rows of the surface
  std::vector<int> parent;     // joins them to pieces, then to bodies
  std::vector<Sample> samples;

  int root(int i) {
    while (parent[std::size_t(i)] != i) i = parent[std::size_t(i)];
    return i;
  }
  void join(int i, int j) { parent[std::size_t(std::max(root(i), root(j)))] = std::min(root(i), root(j)); }
  bool one_body() {
    return std::all_of(triangles.begin(), triangles.end(),
                       [&, i = 0](int) mutable { return root(i++) == root(0); });
  }

  void join_over_edges() {
    std::map<std::pair<int, int>, int> first_at;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const Triangle& t = solid.surface().triangles[std::size_t(triangles[i])];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [found, is_new] = first_at.try_emplace(std::minmax(t[k], t[(k + 1) % 3]), int(i));
        if (is_new || root(found->second) == root(int(i))) continue;
        const auto& points = solid.surface().points;
        if (!clipped({points[std::size_t(t[k])], points[std::size_t(t[(k + 1) % 3])]}, planes).empty())
          join(found->second, int(i));
      }
    }
  }

  // The spans of the chord between hits of the surface, of which the ends belong to triangles `first` and
  // `last` (−1: the chord ends at the tet's wall).
  void join_along(const Point& from, const Point& to, int first, int last) {
    std::vector<std::pair<double, int>> hits{{0, first}};
    if (last >= 0) hits.push_back({1, last});
    const Point way = to - from;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (int(i) == first || int(i) == last) continue;
      const Corners c = solid.corners(std::size_t(triangles[i]));
      const Point a = c[0] - from, b = c[1] - from, d = c[2] - from;
      const double u = dot(way, cross(a, b)), v = dot(way, cross(b, d)), w = dot(way, cross(d, a));
      if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) || u + v + w == 0) continue;
      const double t = dot(a, cross(b, d)) / (u + v + w);
      if (t >= 0 && t <= 1) hits.push_back({t, int(i)});
    }
    std::sort(hits.begin(), hits.end());
    for (std::size_t h = 1; h < hits.size(); ++h) {
      if (root(hits[h - 1].second) == root(hits[h].second)) continue;
      const double middle = (hits[h - 1].first + hits[h].first) / 2;
      const bool same_place = hits[h].first - hits[h - 1].first < 1e-12;
      if (same_place || solid.inside(from + middle * way)) join(hits[h - 1].second, hits[h].second);
    }
  }

  void join_along_normals() {
    for (const Sample& s : samples)
      for (double side : {-1.0, 1.0}) {
        const Point direction = side * s.normal;
        double reach = 1e300;
        for (const HalfSpace& plane : planes)
          if (const double speed = dot(plane.normal, direction); speed < 0)
            reach = std::min(reach, std::max(0.0, plane.depth(s.at)) / -speed);
        if (reach > 0 && reach < 1e300) join_along(s.at, s.at + reach * direction, s.triangle, -1);
      }
  }

  void join_across() {
    struct Pair {
      double distance;
      std::size_t a, b;
      bool operator<(const Pair& o) const {
        return std::tie(distance, a, b) < std::tie(o.distance, o.a, o.b);
      }
    };
    std::map<std::pair<int, int>, std::vector<Pair>> pairs;  // of samples, by pieces
    for (std::size_t a = 0; a < samples.size(); ++a)
      for (std::size_t b = a + 1; b < samples.size(); ++b)
        if (const int p = root(samples[a].triangle), q = root(samples[b].triangle); p != q)
          pairs[std::minmax(p, q)].push_back({length(samples[a].at - samples[b].at), a, b});
    constexpr std::size_t chords = 16;
    for (auto& [pieces, of_pieces] : pairs) {
      const std::size_t n = std::min(chords, of_pieces.size());
      std::partial_sort(of_pieces.begin(), of_pieces.begin() + std::ptrdiff_t(n), of_pieces.end());
      for (std::size_t i = 0; i < n; ++i) {
        const Sample &a = samples[of_pieces[i].a], &b = samples[of_pieces[i].b];
        if (root(a.triangle) != root(b.triangle)) join_along(a.at, b.at, a.triangle, b.triangle);
      }
    }
  }
};

}  // namespace

GluedFacts find_glued(const Solid& solid, const TetMesh& mesh) {
  GluedFacts facts;
  for (const Tet& tet : mesh.tets) {
    std::array<Point, 4> corners;
    Box box;
    for (std::size_t k = 0; k < 4; ++k) box.add(corners[k] = mesh.points[std::size_t(tet[k])]);
    InTet in{solid, inside_of(corners), {}, {}, {}};
    std::vector<int> near;
    solid.grid().for_each_meeting(box, [&](int i) { near.push_back(i); });
    std::sort(near.begin(), near.end());
    for (int i : near) {
      const Corners c = solid.corners(std::size_t(i));
      const std::vector<Point> part = clipped({c[0], c[1], c[2]}, in.planes);
      if (part.empty()) continue;
      Point middle{};
      for (const Point& p : part) middle = middle + (1.0 / double(part.size())) * p;
      const Point n = cross(c[1] - c[0], c[2] - c[0]);
      if (const double area = length(n); area > 0)
        in.samples.push_back({middle, (1 / area) * n, int(in.triangles.size())});
      in.triangles.push_back(i);
    }
    if (in.triangles.empty()) continue;
    ++facts.tets_at_surface;
    in.parent.resize(in.triangles.size());
    std::iota(in.parent.begin(), in.parent.end(), 0);
    in.join_over_edges();
    if (in.one_body()) continue;
    // Thinned where there are many: the pairs are compared one by one.
    constexpr std::size_t most = 400;
    for (std::size_t step = in.samples.size() / most + 1, i = 0;
         step > 1 && i < most && i * step < in.samples.size(); ++i)
      in.samples[i] = in.samples[i * step];
    if (in.samples.size() > most) in.samples.resize(in.samples.size() / (in.samples.size() / most + 1));
    in.join_along_normals();
    if (!in.one_body()) in.join_across();
    facts.tets_glued += !in.one_body();
  }
  return facts;
}

}  // namespace check
