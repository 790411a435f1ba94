#include "tools/check_cage/shells.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace check {
namespace {

using Exact = std::array<mpq_class, 3>;

Exact exact(const Point& p) { return {mpq_class(p[0]), mpq_class(p[1]), mpq_class(p[2])}; }

struct Face {
  Corners corners;
  Point normal;  // outwards, of length one
  double offset;
  Exact exact_normal;
  mpq_class exact_offset;

  double above(const Point& p) const { return dot(normal, p) - offset; }
};

struct Shell {
  Box box;
  std::vector<Face> faces;
  std::vector<Point> points;
};

Shell shell_of(const Surface& surface) {
  Shell shell{box_of(surface.points), {}, surface.points};
  for (const Triangle& t : surface.triangles) {
    Face face;
    for (std::size_t k = 0; k < 3; ++k) face.corners[k] = surface.points[std::size_t(t[k])];
    const Exact a = exact(face.corners[0]), b = exact(face.corners[1]), c = exact(face.corners[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
      face.exact_normal[k] = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]);
    }
    for (std::size_t k = 0; k < 3; ++k) face.exact_offset += face.exact_normal[k] * a[k];
    // Rounded from the exact one, so that it is right for thin faces too.
    const Point n{face.exact_normal[0].get_d(), face.exact_normal[1].get_d(), face.exact_normal[2].get_d()};
    const double size = length(n);
    face.normal = size > 0 ? (1 / size) * n : Point{};
    face.offset = dot(face.normal, face.corners[0]);
    shell.faces.push_back(std::move(face));
  }
  return shell;
}

bool is_convex(const Surface& surface, const Shell& shell) {
  std::map<std::pair<int, int>, int> uses;
  for (const Triangle& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : uses) {
    const auto twin = uses.find({edge.second, edge.first});
    if (count != 1 || twin == uses.end()) return false;
  }
  for (const Face& face : shell.faces)
    for (const Point& p : shell.points)
      if (orientation(face.corners[0], face.corners[1], face.corners[2], p) > 0) return false;
  return true;
}

bool holds(const Shell& shell, const Point& p) {
  for (std::size_t k = 0; k < 3; ++k)
    if (p[k] < shell.box.lower[k] || p[k] > shell.box.upper[k]) return false;
  return std::all_of(shell.faces.begin(), shell.faces.end(), [&](const Face& f) {
    return orientation(f.corners[0], f.corners[1], f.corners[2], p) <= 0;
  });
}

// A corner of a piece: exactly, and rounded.
struct Corner {
  Exact exact;
  Point rounded;
};
using Piece = std::vector<Corner>;

// 1 above the face's plane, 0 on it, −1 below. `near` is what a rounded corner may be off, and more.
int side(const Face& face, const Corner& c, double near) {
  if (const double above = face.above(c.rounded); std::abs(above) > near) return above > 0 ? 1 : -1;
  mpq_class value = -face.exact_offset;
  for (std::size_t k = 0; k < 3; ++k) value += face.exact_normal[k] * c.exact[k];
  return sgn(value);
}

Corner between(const Face& face, const Corner& p, const Corner& q) {
  mpq_class a = -face.exact_offset, b = a;
  for (std::size_t k = 0; k < 3; ++k)
    a += face.exact_normal[k] * p.exact[k], b += face.exact_normal[k] * q.exact[k];
  const mpq_class t = a / (a - b);
  Corner c;
  for (std::size_t k = 0; k < 3; ++k) {
    c.exact[k] = p.exact[k] + t * (q.exact[k] - p.exact[k]);
    c.rounded[k] = c.exact[k].get_d();
  }
  return c;
}

// Adds what of a convex piece lies outside a shell, as convex pieces with an area, to `outside`.
void subtract(Piece piece, const Shell& shell, double near, std::vector<Piece>& outside) {
  const Piece whole = piece;
  std::vector<Piece> cut_off;
  for (const Face& face : shell.faces) {
    std::vector<int> sides;
    for (const Corner& c : piece) sides.push_back(side(face, c, near));
    if (std::none_of(sides.begin(), sides.end(), [](int s) { return s > 0; })) continue;
    if (std::none_of(sides.begin(), sides.end(), [](int s) { return s < 0; })) {
      // Nothing of it reaches inside, and so nothing of the whole does: no need to keep it in pieces.
      outside.push_back(whole);
      return;
    }
    Piece above, below;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const std::size_t j = (i + 1) % piece.size();
      if (sides[i] >= 0) above.push_back(piece[i]);
      if (sides[i] <= 0) below.push_back(piece[i]);
      if (sides[i] * sides[j] < 0) {
        above.push_back(between(face, piece[i], piece[j]));
        below.push_back(above.back());
      }
    }
    cut_off.push_back(std::move(above));
    piece = std::move(below);
  }
  std::move(cut_off.begin(), cut_off.end(), std::back_inserter(outside));
}

bool flat(const Corners& c) {
  const Exact a = exact(c[0]), b = exact(c[1]), d = exact(c[2]);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
    if ((b[u] - a[u]) * (d[v] - a[v]) != (b[v] - a[v]) * (d[u] - a[u])) return false;
  }
  return true;
}

bool is_covered(const Corners& triangle, const std::vector<Shell>& shells, double near) {
  Box box;
  for (const Point& p : triangle) box.add(p);
  std::vector<Piece> left{{{exact(triangle[0]), triangle[0]},
                           {exact(triangle[1]), triangle[1]},
                           {exact(triangle[2]), triangle[2]}}};
  for (const Shell& shell : shells) {
    bool apart = false;
    for (std::size_t k = 0; k < 3; ++k)
      apart = apart || box.lower[k] > shell.box.upper[k] || box.upper[k] < shell.box.lower[k];
    if (apart) continue;
    std::vector<Piece> next;
    for (Piece& piece : left) subtract(std::move(piece), shell, near, next);
    left = std::move(next);
    if (left.empty()) return true;
  }
  return false;
}

void measure_overshoot(const Solid& solid, const std::vector<Shell>& shells, std::size_t samples,
                       ShellFacts& facts) {
  double area = 0;
  for (const Shell& shell : shells)
    for (const Face& f : shell.faces)
      area += length(cross(f.corners[1] - f.corners[0], f.corners[2] - f.corners[0])) / 2;
  const double diagonal = solid.grid().box().diagonal(), step = area / double(samples);
  std::vector<double> distances;
  double passed = 0;
  std::size_t taken = 0;
  for (std::size_t s = 0; s < shells.size(); ++s)
    for (const Face& f : shells[s].faces) {
      const Point u = f.corners[1] - f.corners[0], v = f.corners[2] - f.corners[0];
      for (passed += length(cross(u, v)) / 2; (double(taken) + 0.5) * step < passed; ++taken) {
        // The plastic number's sequence fills a square evenly (Roberts 2018); folded over to the triangle.
        double a = std::fmod(0.5 + 0.7548776662466927 * double(taken), 1.0);
        double b = std::fmod(0.5 + 0.5698402909980532 * double(taken), 1.0);
        if (a + b > 1) a = 1 - a, b = 1 - b;
        const Point p = f.corners[0] + a * u + b * v;
        const bool buried = std::any_of(shells.begin(), shells.end(), [&](const Shell& other) {
          return &other != &shells[s] &&
                 std::all_of(other.faces.begin(), other.faces.end(),
                             [&](const Face& g) { return g.above(p) < -1e-9 * diagonal; });
        });
        if (!buried) distances.push_back(solid.distance(p) / diagonal);
      }
    }
  facts.samples = distances.size();
  if (distances.empty()) return;
  std::sort(distances.begin(), distances.end());
  for (double d : distances) facts.mean_overshoot += d / double(distances.size());
  facts.percentile_99_overshoot = distances[distances.size() * 99 / 100];
  facts.max_overshoot = distances.back();
}

}  // namespace

ShellFacts judge_shells(const Solid& solid, const std::vector<Surface>& surfaces, std::size_t samples) {
  ShellFacts facts;
  facts.shells = surfaces.size();
  std::vector<Shell> shells;
  Box all = solid.grid().box();
  for (const Surface& surface : surfaces) {
    shells.push_back(shell_of(surface));
    all.add(shells.back().box.lower), all.add(shells.back().box.upper);
    facts.max_vertices = std::max(facts.max_vertices, surface.points.size());
    facts.shells_not_convex += !is_convex(surface, shells.back());
    for (const Face& f : shells.back().faces) {
      const Point o = shells.back().points[0];
      facts.sum_of_volumes += dot(f.corners[0] - o, cross(f.corners[1] - o, f.corners[2] - o)) / 6;
    }
  }
  double farthest = 0;
  for (const Point& p : {all.lower, all.upper})
    for (double x : p) farthest = std::max(farthest, std::abs(x));
  // Far above the rounding of a normal, an offset and a corner.
  const double near = 1e-9 * farthest;

  std::vector<int> home(solid.surface().points.size(), -1);  // a shell that holds the vertex
  for (std::size_t v = 0; v < home.size(); ++v) {
    for (std::size_t s = 0; s < shells.size() && home[v] < 0; ++s)
      if (holds(shells[s], solid.surface().points[v])) home[v] = int(s);
    facts.vertices_uncovered += home[v] < 0;
  }
  for (std::size_t i = 0; i < solid.surface().triangles.size(); ++i) {
    const Triangle& t = solid.surface().triangles[i];
    const Corners corners = solid.corners(i);
    const bool lost =
        home[std::size_t(t[0])] < 0 || home[std::size_t(t[1])] < 0 || home[std::size_t(t[2])] < 0;
    const bool in_one = std::any_of(t.begin(), t.end(), [&](int v) {
      const int s = home[std::size_t(v)];
      return s >= 0 && std::all_of(corners.begin(), corners.end(),
                                   [&](const Point& p) { return holds(shells[std::size_t(s)], p); });
    });
    if (lost)
      ++facts.triangles_uncovered;
    else if (!in_one && !flat(corners))
      facts.triangles_uncovered += !is_covered(corners, shells, near);
  }
  measure_overshoot(solid, shells, samples, facts);
  return facts;
}

}  // namespace check
