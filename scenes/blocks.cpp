// Solids of axis-aligned blocks: a grid of all their faces says what is solid; the cage cuts it into cells,
// the surface is the boundary of a finer one, rounded.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "core/error.h"
#include "scenes/detail/five_tets.h"
#include "scenes/detail/surface_builder.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

constexpr int bevel_steps = 3;  // from the face to the middle of a rounded edge

std::vector<double> distinct(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double tolerance = 1e-9 * (values.back() - values.front());
  const auto same = [&](double a, double b) { return b - a <= tolerance; };
  values.erase(std::unique(values.begin(), values.end(), same), values.end());
  return values;
}

// Cells between lines, and which of them are solid.
struct Grid {
  std::array<std::vector<double>, 3> lines;
  std::vector<char> flags;  // x-fastest

  int cells(int axis) const { return int(lines[std::size_t(axis)].size()) - 1; }
  double line(int axis, int i) const { return lines[std::size_t(axis)][std::size_t(i)]; }
  Vec3 point(const std::array<int, 3>& at) const { return {line(0, at[0]), line(1, at[1]), line(2, at[2])}; }
  bool solid(const std::array<int, 3>& cell) const {
    for (int a = 0; a < 3; ++a)
      if (cell[std::size_t(a)] < 0 || cell[std::size_t(a)] >= cells(a)) return false;
    return flags[index(cell)];
  }
  std::size_t index(const std::array<int, 3>& cell) const {
    return (std::size_t(cell[2]) * std::size_t(cells(1)) + std::size_t(cell[1])) * std::size_t(cells(0)) +
           std::size_t(cell[0]);
  }
  template <class Visit>
  void for_each_cell(const Visit& visit) const {
    for (int k = 0; k < cells(2); ++k)
      for (int j = 0; j < cells(1); ++j)
        for (int i = 0; i < cells(0); ++i) visit(std::array{i, j, k});
  }
};

bool contains(const std::vector<Box>& boxes, const Vec3& p) {
  return std::any_of(boxes.begin(), boxes.end(), [&](const Box& b) {
    return (p.array() > b.lower.array()).all() && (p.array() < b.upper.array()).all();
  });
}

Grid grid_of(const BlocksModel& model, std::array<std::vector<double>, 3> lines) {
  Grid grid{std::move(lines), {}};
  grid.for_each_cell([&](const std::array<int, 3>& cell) {
    const Vec3 middle = (grid.point(cell) + grid.point({cell[0] + 1, cell[1] + 1, cell[2] + 1})) / 2;
    grid.flags.push_back(contains(model.solids, middle) && !contains(model.holes, middle));
  });
  return grid;
}

Box bounds_of(const BlocksModel& model) {
  Box bounds;
  for (const Box& solid : model.solids) bounds.include(solid);
  return bounds;
}

// At the faces of solids and holes, as far as the solids reach.
Grid coarse_grid(const BlocksModel& model) {
  const Box bounds = bounds_of(model);
  std::array<std::vector<double>, 3> lines;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> faces;
    for (const auto* boxes : {&model.solids, &model.holes})
      for (const Box& box : *boxes)
        for (const double x : {box.lower[a], box.upper[a]})
          if (x >= bounds.lower[a] && x <= bounds.upper[a]) faces.push_back(x);
    lines[std::size_t(a)] = distinct(std::move(faces));
  }
  return grid_of(model, std::move(lines));
}

using Cell = std::array<int, 3>;

Cell moved(Cell cell, int axis, int by) {
  cell[std::size_t(axis)] += by;
  return cell;
}

// Whether somewhere at that line the solid ends towards higher (lower) coordinates.
bool ends_at(const Grid& grid, int axis, int line, bool towards_higher) {
  bool ends = false;
  grid.for_each_cell([&](const Cell& cell) {
    if (cell[std::size_t(axis)] != (towards_higher ? line - 1 : line)) return;
    ends |= grid.solid(cell) && !grid.solid(moved(cell, axis, towards_higher ? 1 : -1));
  });
  return ends;
}

// The lines of `coarse` with others between: no farther apart than triangle_m, and where an edge is rounded
// spaced so that they become even steps of the arc.
std::vector<double> surface_lines(const Grid& coarse, int axis, double bevel, double longest) {
  const auto along_arc = [&](int step) {
    return bevel * (1 - std::tan(std::numbers::pi / 4 * step / bevel_steps));
  };
  std::vector<double> lines;
  for (int i = 0; i < coarse.cells(axis); ++i) {
    const bool starts = bevel > 0 && ends_at(coarse, axis, i, false);
    const bool ends = bevel > 0 && ends_at(coarse, axis, i + 1, true);
    const double lower = coarse.line(axis, i), upper = coarse.line(axis, i + 1);
    const double from = starts ? lower + bevel : lower, to = ends ? upper - bevel : upper;
    for (int step = bevel_steps; starts && step > 0; --step) lines.push_back(lower + along_arc(step));
    const int n = pieces(to - from, longest);
    for (int piece = 0; piece <= n; ++piece) lines.push_back(from + (to - from) * piece / n);
    for (int step = 1; ends && step <= bevel_steps; ++step) lines.push_back(upper - along_arc(step));
  }
  return distinct(std::move(lines));
}

// Takes the points of the solid's boundary inwards, to a ball of some radius round the nearest point of the
// solid eroded by a cube: that rounds edges and leaves faces where they are.
class Rounding {
 public:
  Rounding(const BlocksModel& model, const Grid& coarse)
      : inset_m_(1e-6 * bounds_of(model).diagonal()), depth_m_(std::max(model.bevel_m, inset_m_)) {
    std::array<std::vector<double>, 3> lines;
    for (std::size_t a = 0; a < 3; ++a)
      for (const double line : coarse.lines[a])
        for (const double x : {line - depth_m_, line, line + depth_m_}) lines[a].push_back(x);
    for (auto& values : lines) values = distinct(std::move(values));
    const Grid bands = grid_of(model, std::move(lines));
    eroded_ = bands;
    bands.for_each_cell([&](const Cell& cell) {
      for (int n = 0; n < 27; ++n)
        if (!bands.solid({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1}))
          eroded_.flags[bands.index(cell)] = 0;
    });
  }

  Vec3 operator()(const Vec3& p) const {
    // In a corner that points inwards several cores are equally near: each moves the point along its own
    // axis.
    struct Core {
      double distance_m;
      Vec3 shift;
    };
    std::vector<Core> cores;
    Cell around{};
    for (int a = 0; a < 3; ++a) {
      const auto& lines = eroded_.lines[std::size_t(a)];
      around[std::size_t(a)] = int(std::upper_bound(lines.begin(), lines.end(), p[a]) - lines.begin()) - 1;
    }
    for (int n = 0; n < 125; ++n) {  // a band is as wide as the core is deep, so it is at most two cells away
      const Cell cell{around[0] + n % 5 - 2, around[1] + n / 5 % 5 - 2, around[2] + n / 25 - 2};
      if (!eroded_.solid(cell)) continue;
      const Vec3 upper = eroded_.point({cell[0] + 1, cell[1] + 1, cell[2] + 1});
      const Vec3 core = p.cwiseMax(eroded_.point(cell)).cwiseMin(upper);
      const double distance = (p - core).norm();
      cores.push_back({distance, (p - core) * ((depth_m_ - inset_m_) / distance - 1)});
    }
    LIMBER_CHECK(!cores.empty(), p.x(), p.y(), p.z());
    const auto nearest = std::min_element(
        cores.begin(), cores.end(), [](const Core& a, const Core& b) { return a.distance_m < b.distance_m; });
    Vec3 shift = Vec3::Zero();
    for (const Core& core : cores)
      if (core.distance_m <= nearest->distance_m + 1e-6 * depth_m_)
        for (int a = 0; a < 3; ++a)
          if (std::abs(core.shift[a]) > std::abs(shift[a])) shift[a] = core.shift[a];
    return p + shift;
  }

 private:
  double inset_m_, depth_m_;
  Grid eroded_;
};

// Whether those of `cells` that are solid (or those that are not) can be reached from one another by faces.
bool hang_together(const Grid& grid, const std::vector<Cell>& cells, bool solid) {
  std::set<Cell> left;
  for (const Cell& cell : cells)
    if (grid.solid(cell) == solid) left.insert(cell);
  if (left.empty()) return true;
  std::vector<Cell> front{*left.begin()};
  left.erase(left.begin());
  while (!front.empty()) {
    const Cell cell = front.back();
    front.pop_back();
    for (int n = 0; n < 6; ++n)
      if (const auto at = left.find(moved(cell, n / 2, n % 2 ? 1 : -1)); at != left.end()) {
        front.push_back(*at);
        left.erase(at);
      }
  }
  return left.empty();
}

// Each solid cell becomes five tets; neighbours are cut in the two mirrored ways and share their faces.
TetMesh cut_in_tets(const Grid& grid) {
  const auto node = [&](int i, int j, int k) {
    return (k * (grid.cells(1) + 1) + j) * (grid.cells(0) + 1) + i;
  };
  std::vector<Eigen::Vector4i> tets;
  std::vector<int> row(std::size_t(node(0, 0, grid.cells(2) + 1)), -1);
  grid.for_each_cell([&](const Cell& cell) {
    if (!grid.solid(cell)) return;
    const auto [i, j, k] = cell;
    for (const auto& corners : five_tets[(i + j + k) % 2]) {
      Eigen::Vector4i tet;
      std::array<Vec3, 4> p;
      for (int c = 0; c < 4; ++c) {
        const Cell at{i + (corners[c] & 1), j + (corners[c] >> 1 & 1), k + (corners[c] >> 2)};
        tet[c] = node(at[0], at[1], at[2]);
        p[std::size_t(c)] = grid.point(at);
        row[std::size_t(tet[c])] = 0;
      }
      if (signed_volume(p[0], p[1], p[2], p[3]) < 0) std::swap(tet[2], tet[3]);
      tets.push_back(tet);
    }
  });
  int used = 0;
  for (int& r : row)
    if (r == 0) r = used++;
  TetMesh cage{Points(used, 3), Tets(tets.size(), 4)};
  for (int k = 0; k <= grid.cells(2); ++k)
    for (int j = 0; j <= grid.cells(1); ++j)
      for (int i = 0; i <= grid.cells(0); ++i)
        if (const int r = row[std::size_t(node(i, j, k))]; r >= 0)
          cage.positions.row(r) = grid.point({i, j, k});
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int c = 0; c < 4; ++c) cage.tets(Eigen::Index(t), c) = row[std::size_t(tets[t][c])];
  return cage;
}

// No cell longer than cell_m, and two at least through each solid: a single layer locks in bending.
Grid cage_grid(const BlocksModel& model, double cell_m) {
  const Grid coarse = coarse_grid(model);
  std::array<std::vector<double>, 3> lines;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> made{coarse.line(a, 0)};
    for (int i = 0; i < coarse.cells(a); ++i) {
      const double lower = coarse.line(a, i), upper = coarse.line(a, i + 1);
      const bool thinnest = std::any_of(model.solids.begin(), model.solids.end(), [&](const Box& solid) {
        int thin = 0;
        solid.size().minCoeff(&thin);
        return thin == a &&
               std::abs(solid.lower[a] - lower) + std::abs(solid.upper[a] - upper) < 1e-9 * (upper - lower);
      });
      const int n = std::max(thinnest ? 2 : 1, pieces(upper - lower, cell_m));
      for (int piece = 1; piece <= n; ++piece)
        made.push_back(piece == n ? upper : lower + (upper - lower) * piece / n);
    }
    lines[std::size_t(a)] = std::move(made);
  }
  return grid_of(model, std::move(lines));
}

}  // namespace

std::string fault_of(const BlocksModel& model) {
  const Grid grid = coarse_grid(model);
  std::vector<Cell> all;
  grid.for_each_cell([&](const Cell& cell) { all.push_back(cell); });
  if (std::none_of(all.begin(), all.end(), [&](const Cell& cell) { return grid.solid(cell); }))
    return "the holes leave nothing of the solids";
  if (!hang_together(grid, all, true)) return "the solids do not hang together by faces";
  for (int k = 0; k <= grid.cells(2); ++k)
    for (int j = 0; j <= grid.cells(1); ++j)
      for (int i = 0; i <= grid.cells(0); ++i) {
        std::vector<Cell> round;
        for (int c = 0; c < 8; ++c) round.push_back({i - (c & 1), j - (c >> 1 & 1), k - (c >> 2)});
        if (!hang_together(grid, round, true) || !hang_together(grid, round, false))
          return fmt::format("at ({:g}, {:g}, {:g}) solids or holes meet only in an edge or a corner",
                             grid.line(0, i), grid.line(1, j), grid.line(2, k));
      }
  double narrowest = grid.line(0, 1) - grid.line(0, 0);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < grid.cells(a); ++i)
      narrowest = std::min(narrowest, grid.line(a, i + 1) - grid.line(a, i));
  if (model.bevel_m > narrowest / 2)
    return fmt::format("bevel_m is {:g}, more than half of the {:g} m between two faces", model.bevel_m,
                       narrowest);
  return "";
}

SurfaceMesh make_blocks(const BlocksModel& model) {
  const Grid coarse = coarse_grid(model);
  std::array<std::vector<double>, 3> lines;
  for (int a = 0; a < 3; ++a)
    lines[std::size_t(a)] = surface_lines(coarse, a, model.bevel_m, model.triangle_m);
  const Grid fine = grid_of(model, std::move(lines));
  const Rounding rounded(model, coarse);
  SurfaceBuilder builder;
  Grid corners = fine;  // its cells stand for the points of `fine`
  for (auto& values : corners.lines) values.push_back(values.back());
  std::vector<int> vertex_of(
      std::size_t(corners.cells(0)) * std::size_t(corners.cells(1)) * std::size_t(corners.cells(2)), -1);
  const auto vertex = [&](const Cell& at) {
    int& v = vertex_of[corners.index(at)];
    if (v < 0) v = builder.add(rounded(fine.point(at)));
    return v;
  };
  fine.for_each_cell([&](const Cell& cell) {
    if (!fine.solid(cell)) return;
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) {
        if (fine.solid(moved(cell, axis, upper ? 1 : -1))) continue;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const Cell at = moved(cell, axis, upper ? 1 : 0);
        const int a = vertex(at), b = vertex(moved(at, u, 1)), c = vertex(moved(moved(at, u, 1), v, 1)),
                  d = vertex(moved(at, v, 1));
        const bool other_diagonal = (cell[0] + cell[1] + cell[2]) % 2;
        if (upper)
          builder.quad(a, b, c, d, other_diagonal);
        else
          builder.quad(a, d, c, b, other_diagonal);
      }
  });
  return builder.mesh();
}

TetMesh make_blocks_cage(const BlocksModel& model, double cell_m) {
  return cut_in_tets(cage_grid(model, cell_m));
}

TetMesh make_box_cage(const Vec3& size_m, const Eigen::Vector3i& cells) {
  LIMBER_CHECK((size_m.array() > 0).all() && (cells.array() > 0).all(), size_m.x(), size_m.y(), size_m.z(),
               cells.x(), cells.y(), cells.z());
  Grid grid;
  for (int a = 0; a < 3; ++a)
    for (int at = 0; at <= cells[a]; ++at)
      grid.lines[std::size_t(a)].push_back(size_m[a] * (2.0 * at - cells[a]) / (2.0 * cells[a]));
  grid.flags.assign(std::size_t(cells.prod()), 1);
  return cut_in_tets(grid);
}

}  // namespace limber::scenes
