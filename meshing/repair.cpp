// The steps that mend a triangle soup, in the order of docs/import.md, "Mending, in this order": weld, drop
// faces that say nothing, orient, remove flat faces, drop unused vertices.
//
// What always holds: no vertex that stays is moved, and no hole is filled. Of equals the lowest row or
// triangle wins. Questions about edges are walks over one sorted list of all sides of triangles
// (detail/edges.h): they cost n log n, and take any soup, whatever meets at an edge. Where a CornerMap is
// given, each corner that is left keeps what the file shows at its place: a triangle that goes takes its rows
// with it, one that is turned swaps two of them, and a flip interpolates its neighbour's.
#include "meshing/repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <tuple>

#include "meshing/detail/box_tree.h"
#include "meshing/detail/edges.h"
#include "meshing/winding_number.h"

namespace limber::meshing {

using detail::EdgeUse;

namespace {

Vec3 corner(const SurfaceMesh& mesh, int t, int i) { return mesh.positions.row(mesh.triangles(t, i)); }

bool collapsed(const Triangles& triangles, int t) {
  const int a = triangles(t, 0), b = triangles(t, 1), c = triangles(t, 2);
  return a == b || b == c || c == a;
}

// Keeps the triangles for which keep[t]; returns how many went.
int keep_triangles(SurfaceMesh& mesh, const std::vector<char>& keep, CornerMap* corners) {
  int kept = 0;
  for (int t = 0; t < mesh.triangles.rows(); ++t) {
    if (!keep[t]) continue;
    if (corners) {
      corners->triangle[kept] = corners->triangle[t];
      corners->weights.middleRows<3>(3 * kept) = corners->weights.middleRows<3>(3 * t).eval();
    }
    mesh.triangles.row(kept++) = mesh.triangles.row(t).eval();
  }
  const int dropped = int(mesh.triangles.rows()) - kept;
  mesh.triangles.conservativeResize(kept, 3);
  if (corners) corners->triangle.resize(kept), corners->weights.conservativeResize(3 * kept, 3);
  return dropped;
}

}  // namespace

// ---- weld ----

// Sides of no length do not count for the median, which they would make 0, and the tolerance with it.
double weld_tolerance_m(const SurfaceMesh& mesh, double relative) {
  Box box;
  std::vector<double> sides;
  for (int t = 0; t < mesh.triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      box.include(corner(mesh, t, i));
      const double side = (corner(mesh, t, i) - corner(mesh, t, (i + 1) % 3)).norm();
      if (side > 0) sides.push_back(side);
    }
  if (sides.empty()) return 0;
  const auto median = sides.begin() + std::ptrdiff_t(sides.size() / 2);
  std::nth_element(sides.begin(), median, sides.end());
  return std::min(relative * box.diagonal(), 1e-3 * *median);
}

namespace {

struct CellEntry {
  std::array<double, 3> cell;  // whole numbers, as doubles: a stray vertex may be 1e38 cells away
  int row;
};

// A point lies in each cell that the box of side tolerance_m round it touches; so two points within the
// tolerance share a cell.
void add_entries(const Vec3& p, int row, double tolerance_m, std::vector<CellEntry>& entries) {
  const double cell_m = 4 * tolerance_m;
  std::array<std::array<double, 2>, 3> range;
  for (int axis = 0; axis < 3; ++axis)
    range[axis] = {std::floor((p[axis] - tolerance_m / 2) / cell_m),
                   std::floor((p[axis] + tolerance_m / 2) / cell_m)};
  for (int which = 0; which < 8; ++which) {
    const std::array<int, 3> side{which & 1, which >> 1 & 1, which >> 2 & 1};
    bool again = false;
    for (int axis = 0; axis < 3; ++axis) again |= side[axis] == 1 && range[axis][0] == range[axis][1];
    if (!again) entries.push_back({{range[0][side[0]], range[1][side[1]], range[2][side[2]]}, row});
  }
}

}  // namespace

// First places that are exactly the same, found by sorting: so a cell of the second part holds few points
// even where a file repeats each vertex for every face. Then places within the tolerance, cell by cell.
// Groups grow together by union and find, whose root is the lowest row, so neither the order of pairs nor
// that of vertices counts.
std::vector<int> weld(const Points& positions, double tolerance_m) {
  const int n = int(positions.rows());
  UnionFind welded(n);
  const auto coordinates = [&](int v) {
    return std::tuple(positions(v, 0), positions(v, 1), positions(v, 2));
  };
  std::vector<int> places;
  for (int v = 0; v < n; ++v)
    if (positions.row(v).allFinite()) places.push_back(v);
  std::sort(places.begin(), places.end(),
            [&](int v, int w) { return std::tuple(coordinates(v), v) < std::tuple(coordinates(w), w); });
  const auto last_place = std::unique(places.begin(), places.end(), [&](int v, int w) {
    const bool same = coordinates(v) == coordinates(w);
    if (same) welded.join(v, w);
    return same;
  });
  places.erase(last_place, places.end());

  if (tolerance_m > 0) {
    std::vector<CellEntry> entries;
    entries.reserve(places.size());
    for (const int v : places) add_entries(positions.row(v), v, tolerance_m, entries);
    std::sort(entries.begin(), entries.end(), [](const CellEntry& a, const CellEntry& b) {
      return std::tie(a.cell, a.row) < std::tie(b.cell, b.row);
    });
    for (std::size_t begin = 0, end; begin < entries.size(); begin = end) {
      for (end = begin + 1; end < entries.size() && entries[end].cell == entries[begin].cell;) ++end;
      // So many places in a cell of four tolerances are one blob; comparing all pairs of them would take for
      // ever.
      const bool blob = end - begin > 1000;
      for (std::size_t i = begin; i < end; ++i)
        for (std::size_t j = i + 1; j < (blob ? std::min(i + 2, end) : end); ++j) {
          const double apart_m = (positions.row(entries[i].row) - positions.row(entries[j].row)).norm();
          if (blob || apart_m <= tolerance_m) welded.join(entries[i].row, entries[j].row);
        }
    }
  }
  std::vector<int> representative(std::size_t(n), 0);
  for (int v = 0; v < n; ++v) representative[v] = welded.root(v);
  return representative;
}

// ---- faces that say nothing ----

// Twice the area over the longest side.
double thinness(const SurfaceMesh& mesh, int t) {
  const Vec3 a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return longest > 0 && !collapsed(mesh.triangles, t) ? (b - a).cross(c - a).norm() / longest : 0;
}

int drop_collapsed(SurfaceMesh& mesh, CornerMap* corners) {
  std::vector<char> keep(std::size_t(mesh.triangles.rows()));
  for (int t = 0; t < mesh.triangles.rows(); ++t) keep[t] = !collapsed(mesh.triangles, t);
  return keep_triangles(mesh, keep, corners);
}

// Sorted by corners, then by triangle: of each set with the same corners, whichever way round, the first
// stays.
int drop_duplicates(SurfaceMesh& mesh, CornerMap* corners) {
  std::vector<std::array<int, 4>> faces;  // sorted corners, then the triangle
  for (int t = 0; t < mesh.triangles.rows(); ++t) {
    faces.push_back({mesh.triangles(t, 0), mesh.triangles(t, 1), mesh.triangles(t, 2), t});
    std::sort(faces.back().begin(), faces.back().begin() + 3);
  }
  std::sort(faces.begin(), faces.end());
  std::vector<char> keep(faces.size(), true);
  for (std::size_t i = 1; i < faces.size(); ++i)
    if (std::equal(faces[i].begin(), faces[i].begin() + 3, faces[i - 1].begin())) keep[faces[i][3]] = false;
  return keep_triangles(mesh, keep, corners);
}

namespace {

// All sides of triangles along one edge; `uses` are sorted by edge.
std::span<const EdgeUse> uses_of(const std::vector<EdgeUse>& uses, int a, int b) {
  const std::array<int, 2> wanted{std::min(a, b), std::max(a, b)};
  const auto begin =
      std::lower_bound(uses.begin(), uses.end(), wanted, [](const EdgeUse& use, const auto& edge) {
        return std::tie(use.lower, use.upper) < std::tie(edge[0], edge[1]);
      });
  auto end = begin;
  while (end != uses.end() && end->lower == wanted[0] && end->upper == wanted[1]) ++end;
  return {begin, end};
}

// t is now (a b d) and n (b c d), where n was (a c d), with the corner of a at `side`; b lies on a–c. All
// that is seen there was n's.
void carry_flip(const SurfaceMesh& mesh, int a, int b, int c, int t, int n, int side, CornerMap& corners) {
  const Vec3 pa = mesh.positions.row(a), pc = mesh.positions.row(c), pb = mesh.positions.row(b);
  const double share = std::clamp((pb - pa).dot(pc - pa) / (pc - pa).squaredNorm(), 0., 1.);
  using Row = Eigen::RowVector3d;
  const Row of_a = corners.weights.row(3 * n + side), of_c = corners.weights.row(3 * n + (side + 1) % 3),
            of_d = corners.weights.row(3 * n + (side + 2) % 3), of_b = (1 - share) * of_a + share * of_c;
  corners.triangle[t] = corners.triangle[n];
  corners.weights.middleRows<3>(3 * t) << of_a, of_b, of_d;
  corners.weights.middleRows<3>(3 * n) << of_b, of_c, of_d;
}

// One pass over the flat triangles, each with its neighbour on its longest side; returns how many were
// flipped. The flat one, b on or beside its longest side a–c, and its neighbour beyond that side make a quad,
// which is cut by its other diagonal: the neighbour is cut in two at b, and the surface stays where it is and
// watertight. Left alone are: an edge of other than two triangles, or of two that disagree about their sides;
// a neighbour that is flat itself, for the next pass; and a diagonal that is an edge already, which would
// then have too many triangles. A triangle is changed once a pass, for the list of edges is that of before.
int flip_flat(SurfaceMesh& mesh, double tolerance_m, CornerMap* corners) {
  const std::vector<EdgeUse> uses = detail::edge_uses(mesh.triangles);
  std::vector<char> changed(std::size_t(mesh.triangles.rows()), false);
  std::set<std::array<int, 2>> new_edges;
  int flipped = 0;
  for (int t = 0; t < mesh.triangles.rows(); ++t) {
    if (changed[t] || thinness(mesh, t) > tolerance_m) continue;
    int longest = 0;
    for (int side = 1; side < 3; ++side) {
      const auto length = [&](int s) { return (corner(mesh, t, s) - corner(mesh, t, (s + 1) % 3)).norm(); };
      if (length(side) > length(longest)) longest = side;
    }
    const int c = mesh.triangles(t, longest), a = mesh.triangles(t, (longest + 1) % 3),
              b = mesh.triangles(t, (longest + 2) % 3);
    const auto edge = uses_of(uses, a, c);
    if (edge.size() != 2 || edge[0].forward == edge[1].forward) continue;
    const EdgeUse& other = edge[0].triangle == t ? edge[1] : edge[0];
    const int n = other.triangle, d = mesh.triangles(n, (other.side + 2) % 3);
    const std::array<int, 2> new_edge{std::min(b, d), std::max(b, d)};
    if (changed[n] || thinness(mesh, n) <= tolerance_m || b == d) continue;
    if (!uses_of(uses, b, d).empty() || new_edges.contains(new_edge)) continue;
    // t = (c a b) and n = (a c d) cover the quad a b c d with the diagonal a–c; now with b–d.
    const Eigen::RowVector3i old_t = mesh.triangles.row(t), old_n = mesh.triangles.row(n);
    mesh.triangles.row(t) << a, b, d;
    mesh.triangles.row(n) << b, c, d;
    if (thinness(mesh, t) <= tolerance_m || thinness(mesh, n) <= tolerance_m) {
      mesh.triangles.row(t) = old_t, mesh.triangles.row(n) = old_n;
      continue;
    }
    if (corners) carry_flip(mesh, a, b, c, t, n, other.side, *corners);
    changed[t] = changed[n] = true;
    new_edges.insert(new_edge);
    ++flipped;
  }
  return flipped;
}

}  // namespace

Flattened remove_flat(SurfaceMesh& mesh, double tolerance_m, CornerMap* corners) {
  Flattened done;
  // A row of flat triangles along one side is unrolled from the outside, one a pass. What is still flat then
  // is dropped, and leaves a slit no wider than the tolerance.
  for (int pass = 0; pass < 50; ++pass) {
    const int flipped = flip_flat(mesh, tolerance_m, corners);
    if (flipped == 0) break;
    done.flipped += flipped;
  }
  std::vector<char> keep(std::size_t(mesh.triangles.rows()));
  for (int t = 0; t < mesh.triangles.rows(); ++t) keep[t] = thinness(mesh, t) > tolerance_m;
  done.dropped = keep_triangles(mesh, keep, corners);
  return done;
}

// ---- orientation ----

namespace {

// An open surface shows which side is out when it is nearly closed: its area vectors nearly cancel (their sum
// over the area is 0 for a closed surface or an open tube, 0.5 for half a sphere, 1 for a flat sheet), and,
// closed by a cone to the middle of its rim, it holds a volume (volume / area^1.5 is 0.094 for a sphere, 0.02
// for a tube fifty diameters long).
constexpr double max_open = 0.25, min_fill = 0.01;
constexpr double min_closed_volume =
    1e-9;  // likewise, of a closed one: below, a flake, and the sign is rounding

// Pieces of triangles joined over edges of exactly two triangles.
struct Pieces {
  std::vector<int> piece;       // (F) the lowest triangle of its piece
  std::vector<char> turned;     // (F) must be turned to agree with that one
  std::vector<char> one_sided;  // (F) said at the piece's lowest triangle
};

// Flood fill from the lowest triangle of each piece. Two neighbours agree when they run along their common
// edge in opposite directions. A piece in which some triangle is reached both ways round has one side only
// (Möbius). Edges of three or more triangles join nothing: across them there is no telling who continues
// whom.
Pieces agreeing_pieces(const Triangles& triangles) {
  struct Neighbour {
    int triangle = -1;
    bool agrees = false;
  };
  const std::size_t n = std::size_t(triangles.rows());
  std::vector<std::array<Neighbour, 3>> neighbours(n);
  detail::for_each_edge(detail::edge_uses(triangles), [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 2) return;
    const bool agrees = edge[0].forward != edge[1].forward;
    neighbours[edge[0].triangle][edge[0].side] = {edge[1].triangle, agrees};
    neighbours[edge[1].triangle][edge[1].side] = {edge[0].triangle, agrees};
  });
  Pieces pieces{std::vector<int>(n, -1), std::vector<char>(n, false), std::vector<char>(n, false)};
  std::vector<int> stack;
  for (int seed = 0; seed < int(n); ++seed) {
    if (pieces.piece[seed] >= 0) continue;
    pieces.piece[seed] = seed;
    stack.push_back(seed);
    while (!stack.empty()) {
      const int t = stack.back();
      stack.pop_back();
      for (const Neighbour& neighbour : neighbours[t]) {
        if (neighbour.triangle < 0) continue;
        const char turned = neighbour.agrees ? pieces.turned[t] : !pieces.turned[t];
        if (pieces.piece[neighbour.triangle] < 0) {
          pieces.piece[neighbour.triangle] = seed;
          pieces.turned[neighbour.triangle] = turned;
          stack.push_back(neighbour.triangle);
        } else if (pieces.turned[neighbour.triangle] != turned) {
          pieces.one_sided[seed] = true;
        }
      }
    }
  }
  return pieces;
}

void turn(SurfaceMesh& mesh, int t, CornerMap* corners) {
  std::swap(mesh.triangles(t, 1), mesh.triangles(t, 2));
  if (corners) corners->weights.row(3 * t + 1).swap(corners->weights.row(3 * t + 2));
}

// Turns the smaller part, by area, of each piece; leaves one-sided ones alone.
void make_pieces_agree(SurfaceMesh& mesh, const Pieces& pieces, CornerMap* corners, Orientation& done) {
  const int n = int(mesh.triangles.rows());
  std::vector<double> area_to_turn(std::size_t(n), 0.0), area_of_all(std::size_t(n), 0.0);
  for (int t = 0; t < n; ++t) {
    const double area =
        (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0)).norm();
    area_of_all[pieces.piece[t]] += area;
    if (pieces.turned[t]) area_to_turn[pieces.piece[t]] += area;
  }
  for (int t = 0; t < n; ++t) {
    const int p = pieces.piece[t];
    if (pieces.one_sided[p]) {
      done.one_sided += t == p;
    } else if (bool(pieces.turned[t]) != (2 * area_to_turn[p] > area_of_all[p])) {
      turn(mesh, t, corners);
      ++done.turned_triangles;
    }
  }
}

// ---- which side is out ----

// Triangles whose sides are judged together.
struct Solid {
  std::vector<int> triangles;
  Box box;
  double volume = 0, area = 0;
  Vec3 area_vector = Vec3::Zero();
  bool closed = false;
};

// Closed means: as many triangles run along each edge of the group one way as the other. Directions count,
// and not faces: two cubes with a common edge have an edge of four triangles, and are closed. group (F);
// answers (by group).
std::vector<char> balanced_groups(const std::vector<EdgeUse>& uses, const std::vector<int>& group,
                                  int groups) {
  std::vector<char> balanced(std::size_t(groups), true);
  std::vector<std::array<int, 2>> along;  // group, direction
  detail::for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    along.clear();
    for (const EdgeUse& use : edge) along.push_back({group[use.triangle], use.forward ? 1 : -1});
    std::sort(along.begin(), along.end());
    for (std::size_t begin = 0, end; begin < along.size(); begin = end) {
      int balance = 0;
      for (end = begin; end < along.size() && along[end][0] == along[begin][0]; ++end)
        balance += along[end][1];
      if (balance != 0) balanced[along[begin][0]] = false;
    }
  });
  return balanced;
}

// The middle of the rim, of edges that an odd number of its triangles have; of the box, when the solid is
// closed.
Vec3 rim_center(const SurfaceMesh& mesh, const Solid& solid) {
  if (solid.closed) return solid.box.center();
  Triangles own(Eigen::Index(solid.triangles.size()), 3);
  for (std::size_t i = 0; i < solid.triangles.size(); ++i)
    own.row(Eigen::Index(i)) = mesh.triangles.row(solid.triangles[i]);
  Vec3 sum = Vec3::Zero();
  int rim_edges = 0;
  detail::for_each_edge(detail::edge_uses(own), [&](std::span<const EdgeUse> edge) {
    if (edge.size() % 2 == 0) return;
    sum += 0.5 * (mesh.positions.row(edge[0].lower) + mesh.positions.row(edge[0].upper));
    ++rim_edges;
  });
  return rim_edges > 0 ? Vec3(sum / rim_edges) : solid.box.center();
}

// Volume and area vector, V = Σ det(a − p, b − p, c − p) / 6 and Σ (b − a) × (c − a) / 2, over the triangles
// (a, b, c). The apex p is on or near the solid: seen from far away, a flake of two opposite triangles gets a
// sign from rounding. Of an open solid it is the middle of the rim, and the volume that of the solid closed
// by a cone.
void measure(const SurfaceMesh& mesh, Solid& solid) {
  for (const int t : solid.triangles)
    for (int i = 0; i < 3; ++i) solid.box.include(corner(mesh, t, i));
  const Vec3 apex = rim_center(mesh, solid);
  for (const int t : solid.triangles) {
    const Vec3 a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
    solid.volume += signed_volume(apex, a, b, c);
    const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
    solid.area_vector += area_vector;
    solid.area += area_vector.norm();
  }
}

// A closed piece is a solid; the open pieces of a component are one together (two boxes with a common wall,
// whose edges have three triangles). Groups are numbered by their piece, or n + their component; one-sided
// pieces are in none.
std::vector<Solid> solids_of(const SurfaceMesh& mesh, const Pieces& pieces) {
  const int n = int(mesh.triangles.rows());
  std::vector<int> group(std::size_t(n), 0);
  std::vector<char> group_closed;
  {
    const std::vector<EdgeUse> uses = detail::edge_uses(mesh.triangles);
    const std::vector<char> piece_closed = balanced_groups(uses, pieces.piece, n);
    const std::vector<int> component = detail::components(mesh.triangles, uses);
    for (int t = 0; t < n; ++t) group[t] = piece_closed[pieces.piece[t]] ? pieces.piece[t] : n + component[t];
    group_closed = balanced_groups(uses, group, 2 * n);
  }
  std::vector<int> size(2 * std::size_t(n), 0), solid_of_group(2 * std::size_t(n), -1);
  for (int t = 0; t < n; ++t)
    if (!pieces.one_sided[pieces.piece[t]]) ++size[group[t]];
  std::vector<Solid> solids;
  for (int g = 0; g < 2 * n; ++g) {
    if (size[g] == 0) continue;
    solid_of_group[g] = int(solids.size());
    solids.emplace_back();
    solids.back().closed = group_closed[g];
    solids.back().triangles.reserve(std::size_t(size[g]));
  }
  for (int t = 0; t < n; ++t)
    if (!pieces.one_sided[pieces.piece[t]]) solids[solid_of_group[group[t]]].triangles.push_back(t);
  for (Solid& solid : solids) measure(mesh, solid);
  return solids;
}

// Whether the sign of its volume can be trusted to say which way it faces.
bool shows_its_outside(const Solid& s) {
  if (s.closed) return std::abs(s.volume) > min_closed_volume * s.area * std::sqrt(s.area);
  return s.area_vector.norm() < max_open * s.area &&
         std::abs(s.volume) > min_fill * s.area * std::sqrt(s.area);
}

// What the first `count` solids say of a point: their winding number there, and the last of them that has it
// inside, or −1.
struct Surroundings {
  double winding_number = 0;
  int innermost = -1;
};

// Solids, and quick answers to which of them lie round a point. A solid that was asked about stays as it is.
class Nest {
 public:
  Nest(const SurfaceMesh& mesh, const std::vector<Solid>& solids)
      : mesh_(mesh),
        solids_(solids),
        tree_(boxes_of(solids)),
        asked_(solids.size(), 0),
        quick_(solids.size()) {}

  // Of the first `count` solids, by their winding numbers (van Oosterom and Strackee 1983); only those whose
  // boxes hold the point are asked. They are taken in order, so `innermost` is the smallest of those round
  // the point.
  Surroundings around(const Vec3& p, int count) {
    std::vector<int> near;
    tree_.any([&](const Box& box) { return !holds(box, p); },
              [&](int i) {
                if (i < count && holds(solids_[i].box, p)) near.push_back(i);
                return false;
              });
    std::sort(near.begin(), near.end());
    Surroundings around;
    for (const int i : near) {
      const double number = winding_number(i, p);
      around.winding_number += number;
      if (std::abs(number) >= 0.5) around.innermost = i;
    }
    return around;
  }

 private:
  static bool holds(const Box& box, const Vec3& p) {
    return (p.array() >= box.lower.array()).all() && (p.array() <= box.upper.array()).all();
  }
  static std::vector<Box> boxes_of(const std::vector<Solid>& solids) {
    std::vector<Box> boxes;
    for (const Solid& solid : solids) boxes.push_back(solid.box);
    return boxes;
  }

  double winding_number(int i, const Vec3& p) {
    const std::vector<int>& triangles = solids_[i].triangles;
    if (++asked_[i] <= 16) {  // a tree costs about as much
      double number = 0;
      for (const int t : triangles)
        number += solid_angle_share(corner(mesh_, t, 0), corner(mesh_, t, 1), corner(mesh_, t, 2), p);
      return number;
    }
    if (!quick_[i]) {
      Triangles own(Eigen::Index(triangles.size()), 3);
      for (std::size_t k = 0; k < triangles.size(); ++k)
        own.row(Eigen::Index(k)) = mesh_.triangles.row(triangles[k]);
      quick_[i] = std::make_unique<WindingNumber>(mesh_.positions, own);
    }
    return quick_[i]->at(p);
  }

  const SurfaceMesh& mesh_;
  const std::vector<Solid>& solids_;
  detail::BoxTree tree_;
  std::vector<int> asked_;
  std::vector<std::unique_ptr<WindingNumber>> quick_;
};

}  // namespace

// First the triangles of each piece are made to agree, then whole solids to face outward, from the largest to
// the smallest volume. Neither a test of the whole model ("volume < 0, so turn all") nor one of each
// component will do: the first is wrong for nests, the second for a nest that is inside out.
Orientation orient(SurfaceMesh& mesh, CornerMap* corners) {
  Orientation done;
  const Pieces pieces = agreeing_pieces(mesh.triangles);
  make_pieces_agree(mesh, pieces, corners, done);

  std::vector<Solid> solids = solids_of(mesh, pieces);
  if (solids.empty()) return done;
  const auto sheets = std::stable_partition(solids.begin(), solids.end(), shows_its_outside);
  // The outermost first: what is right about an inner one depends on it.
  std::stable_sort(solids.begin(), sheets,
                   [](const Solid& a, const Solid& b) { return std::abs(a.volume) > std::abs(b.volume); });
  const int judged = int(sheets - solids.begin());
  Nest nest(mesh, solids);
  std::vector<char> turned(solids.size(), false);
  double area = 0, turned_area = 0;
  for (int i = 0; i < int(solids.size()); ++i) {
    area += solids[i].area;
    if (i >= judged) continue;
    const int t = solids[i].triangles[0];
    const Vec3 on_it = (corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) / 3;
    const Surroundings around = nest.around(on_it, i);
    if (around.innermost >= 0) done.inner.push_back(on_it);
    // In a model that is inside out as a whole, an inner component is turned with the one round it.
    turned[i] = around.innermost >= 0 && turned[around.innermost];
    if ((solids[i].volume < 0) != bool(turned[i])) {
      if (around.winding_number >= 0.5)
        ++done.cavities;
      else
        turned[i] = !turned[i];
    }
    if (!turned[i]) continue;
    turned_area += solids[i].area;
    for (const int triangle : solids[i].triangles) turn(mesh, triangle, corners);
  }
  // A sheet does not show its outside; it goes with the larger part of the model.
  if (2 * turned_area > area)
    for (int i = judged; i < int(solids.size()); ++i) {
      turned[i] = true;
      for (const int triangle : solids[i].triangles) turn(mesh, triangle, corners);
    }
  done.turned_components = int(std::count(turned.begin(), turned.end(), true));
  return done;
}

// ---- the rest ----

int drop_unused(SurfaceMesh& mesh) {
  const std::vector<int> used = vertices_of(mesh.triangles);
  std::vector<int> new_row(std::size_t(mesh.positions.rows()), -1);
  Points kept(Eigen::Index(used.size()), 3);
  for (std::size_t i = 0; i < used.size(); ++i) {
    new_row[used[i]] = int(i);
    kept.row(Eigen::Index(i)) = mesh.positions.row(used[i]);
  }
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) mesh.triangles(t, c) = new_row[mesh.triangles(t, c)];
  const int dropped = int(mesh.positions.rows()) - int(used.size());
  mesh.positions = std::move(kept);
  return dropped;
}

}  // namespace limber::meshing
