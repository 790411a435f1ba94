#include "meshing/detail/sample_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "core/threads.h"
#include "meshing/detail/point_grid.h"
#include "meshing/detail/spot_falls.h"
#include "meshing/detail/surface_spots.h"

namespace limber::meshing::detail {

namespace {

constexpr double probes_a_disc = 1.5, candidates_a_disc = 5;  // a square of the least spacing
constexpr int max_candidates = 400'000;
const double crease_cosine = std::cos(std::numbers::pi / 6), corner_cosine = std::cos(std::numbers::pi / 6);

std::vector<SurfaceSpot> first_of(const SurfaceSpots& sequence, int count) {
  std::vector<SurfaceSpot> spots(static_cast<std::size_t>(count));
  parallel_for_many(count, [&](int i) { spots[std::size_t(i)] = sequence.at(std::uint32_t(i)); });
  return spots;
}

// How far apart samples may be, by how far the surface falls away below the tangent plane.
class SpacingMap {
 public:
  SpacingMap(std::vector<SurfaceSpot> spots, const Box& box, const SampleSpacing& limits)
      : limits_(limits),
        spots_(std::move(spots)),
        grid_(box, 0.5 * limits.max_flat_m),
        fine_grid_(box, limits.min_m) {
    std::vector<std::pair<int, int>> order;
    for (const SurfaceSpot& s : spots_) order.emplace_back(grid_.cell_of(s.position), int(order.size()));
    std::sort(order.begin(), order.end());  // neighbours in space are neighbours in memory
    std::vector<SurfaceSpot> sorted;
    cells_.resize(std::size_t(grid_.cells()));
    for (const auto& [cell, i] : order) {
      Cell& of = cells_[std::size_t(cell)];
      if (of.begin == of.end) of.begin = int(sorted.size());
      sorted.push_back(spots_[std::size_t(i)]);
      of.end = int(sorted.size());
      of.box.include(sorted.back().position), of.normals.include(sorted.back().normal);
    }
    spots_ = std::move(sorted);
    blocks_ = SpotBlocks(spots_);
    for (const SurfaceSpot& s : spots_) fine_grid_.add(s.position);
    parallel_for_many(int(cells_.size()), [&](int c) { find_near(cells_[std::size_t(c)]); });

    std::vector<Vec3> smooth(spots_.size());
    spacing_.resize(spots_.size());
    for_all([&](std::size_t i) {
      Vec3 sum = spots_[i].normal;
      fine_grid_.any_within(spots_[i].position, limits_.min_m, [&](int n, double) {
        const Vec3& normal = spots_[std::size_t(n)].normal;
        if (normal.dot(spots_[i].normal) > same_side) sum += normal;
        return false;
      });
      smooth[i] = sum.normalized();
    });
    parallel_for_many(int(cells_.size()), [&](int c) {
      const Cell& cell = cells_[std::size_t(c)];
      for (int i = cell.begin; i < cell.end; ++i)
        spacing_[std::size_t(i)] =
            measured_in(cell, {spots_[std::size_t(i)].position, smooth[std::size_t(i)]});
    });
  }

  // That of the nearest spot on this side of the surface.
  double at(const SurfaceSpot& p) const {
    double nearest = 1e300, spacing = 0;
    for (const double radius : {limits_.min_m, 2 * limits_.min_m}) {
      fine_grid_.any_within(p.position, radius, [&](int n, double squared_distance) {
        if (squared_distance < nearest && spots_[std::size_t(n)].normal.dot(p.normal) > same_side)
          nearest = squared_distance, spacing = spacing_[std::size_t(n)];
        return false;
      });
      if (spacing > 0) break;
    }
    return spacing > 0 ? spacing : measured(p);
  }

 private:
  template <class Body>
  void for_all(Body body) const {
    parallel_for_many(int(spots_.size()), [&](int i) { body(std::size_t(i)); });
  }

  struct Near {
    int cell;
    double distance_m;  // at least
  };
  struct Cell {
    int begin = 0, end = 0;
    Box box, normals;        // round its spots' positions, and their normals
    std::vector<Near> near;  // those with spots no farther than the largest spacing, nearest first
  };
  static constexpr double rounding = 1e-9;

  void find_near(Cell& cell) const {
    if (cell.begin == cell.end) return;
    const Vec3 middle = 0.5 * (cell.box.lower + cell.box.upper);
    grid_.any_cell(middle, limits_.max_flat_m + 0.5 * cell.box.diagonal(), [&](int index) {
      const Cell& other = cells_[std::size_t(index)];
      if (other.begin == other.end) return false;
      const Vec3 apart =
          (other.box.lower - cell.box.upper).cwiseMax(cell.box.lower - other.box.upper).cwiseMax(0);
      if (const double distance = (1 - rounding) * apart.norm(); distance <= limits_.max_flat_m)
        cell.near.push_back({index, distance});
      return false;
    });
    std::stable_sort(cell.near.begin(), cell.near.end(),
                     [](const Near& a, const Near& b) { return a.distance_m < b.distance_m; });
  }

  // The spacing of one place, cell by cell. In whatever order these come, it is the same.
  class Measure {
   public:
    Measure(const SpacingMap& map, const SurfaceSpot& at) : map_(map), at_(at) {}

    // Nothing so far away changes anything: no point falls by more than it is away.
    bool is_done_at(double distance_m) const {
      return falls_.bend_m >= flat_ && 2 * map_.limits_.missed_m * distance_m >= falls_.min_squared_m2;
    }

    void look_at(const Cell& cell) {
      // No point of the cell falls farther, or is nearer; most cells of what is flat change nothing.
      const Vec3 middle = 0.5 * (cell.box.lower + cell.box.upper), half = 0.5 * cell.box.size();
      const double max_fall = (1 + rounding) * (std::abs((at_.position - middle).dot(at_.normal)) +
                                                half.dot(at_.normal.cwiseAbs())),
                   nearest =
                       (1 - rounding) * ((at_.position - middle).cwiseAbs() - half).cwiseMax(0).squaredNorm();
      if (nearest > farthest_ ||
          ((falls_.bend_m >= flat_ || max_fall < flat_) &&
           max_fall * falls_.min_squared_m2 <= 2 * map_.limits_.missed_m * std::max(nearest, least_)))
        return;
      const Vec3 most =
          (cell.normals.lower.cwiseProduct(at_.normal)).cwiseMax(cell.normals.upper.cwiseProduct(at_.normal));
      if (most.sum() <= same_side - rounding) return;  // all are of another side
      // Spots beside them in a block change nothing that those of their own cells do not.
      falls_ = map_.blocks_.falls_from(at_, cell.begin, cell.end, {farthest_, least_, map_.limits_.missed_m},
                                       falls_);
    }

    double spacing_m() const {
      return falls_.bend_m < flat_ ? map_.limits_.max_flat_m
                                   : std::max(map_.limits_.min_m, std::sqrt(falls_.min_squared_m2));
    }

   private:
    const SpacingMap& map_;
    const SurfaceSpot& at_;
    const double flat_ = 0.1 * map_.limits_.missed_m, least_ = map_.limits_.min_m * map_.limits_.min_m,
                 farthest_ = map_.limits_.max_flat_m * map_.limits_.max_flat_m;
    Falls falls_{map_.limits_.max_m * map_.limits_.max_m, 0};
  };

  double measured_in(const Cell& home, const SurfaceSpot& at) const {
    Measure measure(*this, at);
    for (const Near& near : home.near) {
      if (measure.is_done_at(near.distance_m)) break;
      measure.look_at(cells_[std::size_t(near.cell)]);
    }
    return measure.spacing_m();
  }

  double measured(const SurfaceSpot& at) const {
    Measure measure(*this, at);
    grid_.any_cell(at.position, limits_.max_flat_m, [&](int index) {
      const Cell& cell = cells_[std::size_t(index)];
      if (cell.begin < cell.end) measure.look_at(cell);
      return false;
    });
    return measure.spacing_m();
  }

  SampleSpacing limits_;
  std::vector<SurfaceSpot> spots_;  // by the cells of grid_
  SpotBlocks blocks_;               // the same
  std::vector<Cell> cells_;
  std::vector<double> spacing_;
  PointGrid grid_, fine_grid_;
};

// Corners that stick out, then points of the creases that do.
std::vector<SurfaceSpot> spots_that_stick_out(const SurfaceMesh& surface, const std::vector<char>& seen,
                                              double step) {
  struct Side {
    int a, b, triangle, apex;
  };
  std::vector<Side> sides;
  for (int f = 0; f < surface.triangles.rows(); ++f)
    for (int k = 0; k < 3 && seen[std::size_t(f)]; ++k) {
      const int a = surface.triangles(f, k), b = surface.triangles(f, (k + 1) % 3);
      sides.push_back({std::min(a, b), std::max(a, b), f, surface.triangles(f, (k + 2) % 3)});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
    return std::tie(s.a, s.b, s.triangle) < std::tie(t.a, t.b, t.triangle);
  });
  const auto position = [&](int v) { return Vec3(surface.positions.row(v)); };
  const auto normal_of = [&](int f) {
    const Vec3 a = position(surface.triangles(f, 0));
    return Vec3(
        (position(surface.triangles(f, 1)) - a).cross(position(surface.triangles(f, 2)) - a).normalized());
  };

  struct Crease {
    int a, b;
    Vec3 normal;
  };
  std::vector<Crease> creases;
  for (std::size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i; end < sides.size() && sides[end].a == sides[i].a && sides[end].b == sides[i].b;) ++end;
    if (end - i != 2) continue;
    const Side &s = sides[i], &t = sides[i + 1];
    const Vec3 n = normal_of(s.triangle), m = normal_of(t.triangle);
    if (n.dot(m) < crease_cosine && (position(t.apex) - position(s.a)).dot(n) < 0 && (n + m).norm() > 1e-3)
      creases.push_back({s.a, s.b, (n + m).normalized()});
  }

  struct End {
    int vertex, crease;
    Vec3 away;
  };
  std::vector<End> ends;
  for (int c = 0; c < int(creases.size()); ++c) {
    const Vec3 along =
        (position(creases[std::size_t(c)].b) - position(creases[std::size_t(c)].a)).normalized();
    ends.push_back({creases[std::size_t(c)].a, c, along});
    ends.push_back({creases[std::size_t(c)].b, c, -along});
  }
  std::stable_sort(ends.begin(), ends.end(), [](const End& s, const End& t) { return s.vertex < t.vertex; });
  std::vector<SurfaceSpot> spots;
  for (std::size_t i = 0, end; i < ends.size(); i = end) {
    Vec3 normal = Vec3::Zero();
    for (end = i; end < ends.size() && ends[end].vertex == ends[i].vertex; ++end)
      normal += creases[std::size_t(ends[end].crease)].normal;
    const bool runs_through = end - i == 2 && ends[i].away.dot(ends[i + 1].away) < -corner_cosine;
    if (!runs_through && normal.norm() > 1e-3)
      spots.push_back({position(ends[i].vertex), normal.normalized()});
  }
  for (const Crease& c : creases) {
    const Vec3 a = position(c.a), along = position(c.b) - a;
    const int points = int(std::min(1e4, std::ceil(along.norm() / step)));
    for (int k = 0; k < points; ++k) spots.push_back({a + (k + 0.5) / points * along, c.normal});
  }
  return spots;
}

// The vertices of what is seen, with its normals there.
std::vector<SurfaceSpot> seen_vertices(const SurfaceMesh& surface, const std::vector<char>& seen) {
  Triangles triangles(surface.triangles.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < triangles.rows(); ++f)
    if (seen[std::size_t(f)]) triangles.row(count++) = surface.triangles.row(f);
  const Points normals = vertex_normals(surface.positions, triangles.topRows(count));
  std::vector<SurfaceSpot> spots;
  for (Eigen::Index v = 0; v < normals.rows(); ++v)
    if (const Vec3 n = normals.row(v); n.norm() > 0) spots.push_back({surface.positions.row(v), n});
  return spots;
}

// Of each candidate's share of the surface, to the nearest sample of its side.
void share_area(std::span<const SurfaceSpot> candidates, double area, const PointGrid& grid, double reach,
                std::vector<SurfaceSample>& samples) {
  std::vector<int> nearest(candidates.size());
  parallel_for_many(int(candidates.size()), [&](int i) {
    const SurfaceSpot& spot = candidates[std::size_t(i)];
    int found = -1;
    for (double radius = reach; found < 0; radius *= 2) {
      double least = 1e300;
      grid.any_within(spot.position, radius, [&](int n, double squared_distance) {
        const bool other_side = samples[std::size_t(n)].normal.dot(spot.normal) < 0;
        const double cost = squared_distance + (other_side ? radius * radius : 0);
        if (cost < least || (cost == least && n < found)) least = cost, found = n;
        return false;
      });
    }
    nearest[std::size_t(i)] = found;
  });
  // Each sample counts as a candidate too: none stands for nothing.
  const double share = area / double(candidates.size() + samples.size());
  for (SurfaceSample& s : samples) s.area_m2 = share;
  for (int n : nearest) samples[std::size_t(n)].area_m2 += share;
}

constexpr std::size_t judged_at_once = 64;  // more would be judged in vain, since others rule them out

constexpr int planes = 13;
// The normal, and those that lean from it by 15 and by 30 degrees.
Eigen::Matrix<double, 3, planes> normals_about(const Vec3& normal) {
  Eigen::Matrix<double, 3, planes> all;
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  all.col(0) = normal;
  for (int k = 0; k < planes - 1; ++k) {
    const double lean = (k % 2 + 1) * std::numbers::pi / 12, around = k / 2 * std::numbers::pi / 3;
    all.col(k + 1) = std::cos(lean) * normal + std::sin(lean) * (std::cos(around) * u + std::sin(around) * v);
  }
  return all;
}

// Tips: vertices that a plane would have inside by more than may be missed when it rests on the samples about
// them. They are narrower than the spacing, or spacings that had to grow passed over them. Those farthest
// inside come first; no more than `most` samples in all.
template <class Hidden>
void add_tips(const std::vector<SurfaceSpot>& vertices, double scale, const SpacingMap& map,
              const SampleSpacing& spacing, const Hidden& is_hidden, PointGrid& grid,
              std::vector<SurfaceSample>& samples, int most) {
  constexpr double all_round = 2;  // spacings within which there are samples on every side
  const double missed = 2 * spacing.missed_m;
  std::vector<double> reach(vertices.size()), depth(vertices.size());
  const auto depth_now = [&](std::size_t v) {
    const SurfaceSpot& spot = vertices[v];
    const auto normals = normals_about(spot.normal);
    Eigen::Array<double, planes, 1> above = Eigen::Array<double, planes, 1>::Constant(1e300);
    grid.any_within(spot.position, reach[v], [&](int n, double) {
      const SurfaceSample& s = samples[std::size_t(n)];
      if (s.normal.dot(spot.normal) > same_side)
        above = above.min((normals.transpose() * (spot.position - s.position)).array());
      return false;
    });
    return above.maxCoeff();
  };
  parallel_for_many(int(vertices.size()), [&](int v) {
    reach[std::size_t(v)] = std::max(all_round, scale) * map.at(vertices[std::size_t(v)]);
    depth[std::size_t(v)] = depth_now(std::size_t(v));
  });
  std::vector<std::size_t> tips;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (depth[v] > missed) tips.push_back(v);
  std::stable_sort(tips.begin(), tips.end(),
                   [&](std::size_t a, std::size_t b) { return depth[a] > depth[b]; });
  // Many are judged at once, and again where a sample has come since: that can but rule them out.
  std::vector<char> taken(tips.size());
  for (std::size_t begin = 0, end; begin < tips.size(); begin = end) {
    end = std::min(tips.size(), begin + judged_at_once);
    parallel_for(int(end - begin), [&](int i) {
      const std::size_t v = tips[begin + std::size_t(i)];
      taken[begin + std::size_t(i)] = depth_now(v) > missed && !is_hidden(vertices[v]);
    });
    bool changed = false;
    for (std::size_t i = begin; i < end; ++i) {
      if (int(samples.size()) >= most) return;
      if (!taken[i] || (changed && !(depth_now(tips[i]) > missed))) continue;
      const SurfaceSpot& spot = vertices[tips[i]];
      grid.add(spot.position);
      samples.push_back({spot.position, spot.normal, 0});
      changed = true;
    }
  }
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const SurfaceMesh& surface, const SeenSurface& seen,
                                          const WindingNumber& winding, const SampleSpacing& spacing,
                                          int most, int most_tips) {
  if (!(seen.area_m2 > 0)) return {};
  const Box box = bounding_box(surface.positions);
  const SurfaceSpots sequence(seen);
  const double discs = seen.area_m2 / (spacing.min_m * spacing.min_m);
  const int probes = int(std::clamp(probes_a_disc * discs, 1000.0, 0.25 * max_candidates)),
            candidates = int(std::clamp(candidates_a_disc * discs, 4000.0, 1.0 * max_candidates));
  const SpacingMap map(first_of(sequence, probes), box, spacing);

  std::vector<SurfaceSpot> spots = spots_that_stick_out(surface, seen.seen, spacing.min_m / 3);
  const std::size_t sticking_out = spots.size();
  const std::vector<SurfaceSpot> spread = first_of(sequence, candidates);
  spots.insert(spots.end(), spread.begin(), spread.end());
  std::vector<double> wanted(spots.size());
  parallel_for_many(int(spots.size()),
                    [&](int i) { wanted[std::size_t(i)] = map.at(spots[std::size_t(i)]); });

  // What is not on a piece that was judged itself, or where pieces may be hidden in part, is judged where it
  // is taken.
  const std::size_t doubtful =
      std::all_of(seen.pieces.begin(), seen.pieces.end(), [](const SurfacePiece& p) { return p.seen; })
          ? sticking_out
          : spots.size();
  enum : char { unknown, yes, no };
  std::vector<char> judgements(doubtful, unknown);
  const auto hidden_here = [&](const SurfaceSpot& spot) {
    return !parts_inside_from_outside(winding, spot.position, spot.normal, spacing.offset_m);
  };
  const auto is_hidden = [&](std::size_t i) {
    if (i >= doubtful) return false;
    char& hidden = judgements[i];
    if (hidden == unknown) hidden = hidden_here(spots[i]) ? yes : no;
    return hidden == yes;
  };
  constexpr std::size_t most_looked_at = 4096;  // at once
  std::vector<char> covered_before(most_looked_at);
  std::vector<std::size_t> open;  // no sample covers them yet
  for (double scale = 1;; scale *= 1.1) {
    PointGrid grid(box, spacing.max_m);
    std::vector<SurfaceSample> samples;
    const auto is_covered = [&](std::size_t i) {
      return grid.any_within(spots[i].position, scale * wanted[i], [&](int n, double) {
        return samples[std::size_t(n)].normal.dot(spots[i].normal) > same_side;
      });
    };
    // Many are looked at at once, and those that nothing covered again: another of them may.
    std::size_t count = judged_at_once;
    for (std::size_t begin = 0; begin < spots.size() && int(samples.size()) <= most; begin += count) {
      count = std::min(open.size() < judged_at_once / 2 && begin > 0 ? 2 * count : count, most_looked_at);
      const std::size_t end = std::min(spots.size(), begin + count);
      parallel_for_many(int(end - begin),
                        [&](int i) { covered_before[std::size_t(i)] = is_covered(begin + std::size_t(i)); });
      open.clear();
      for (std::size_t i = begin; i < end; ++i)
        if (!covered_before[i - begin]) open.push_back(i);
      parallel_for(int(open.size()), [&](int i) { is_hidden(open[std::size_t(i)]); });
      for (const std::size_t i : open) {
        if (int(samples.size()) > most) break;
        if (is_covered(i) || is_hidden(i)) continue;
        grid.add(spots[i].position);
        samples.push_back({spots[i].position, spots[i].normal, 0});
      }
    }
    if (int(samples.size()) > most) continue;
    if (samples.empty()) return {};
    add_tips(seen_vertices(surface, seen.seen), scale, map, spacing, hidden_here, grid, samples,
             int(samples.size()) + most_tips);
    share_area(std::span(spread).first(std::size_t(std::min(candidates, 100'000))), seen.area_m2, grid,
               spacing.min_m, samples);
    return samples;
  }
}

}  // namespace limber::meshing::detail
