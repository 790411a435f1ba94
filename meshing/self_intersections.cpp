#include "meshing/self_intersections.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/progress.h"
#include "meshing/detail/triangle_pair.h"

namespace limber::meshing {

namespace {

// Single precision, of coordinates counted from the corner of the model: rounding never changes the order of
// two numbers, so boxes that meet still do.
struct SmallBox {
  std::array<float, 3> lower, upper;

  void include(const SmallBox& other) {
    for (int i = 0; i < 3; ++i) {
      lower[i] = std::min(lower[i], other.lower[i]);
      upper[i] = std::max(upper[i], other.upper[i]);
    }
  }
};

bool meet(const SmallBox& a, const SmallBox& b) {
  bool apart = false;  // no branch per axis
  for (int i = 0; i < 3; ++i) apart |= (a.lower[i] > b.upper[i]) | (b.lower[i] > a.upper[i]);
  return !apart;
}

// The bits of three numbers of 21 bits in turn: neighbours on this curve are neighbours in space.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

// Rows of triangles along a Morton curve through their middles.
std::vector<int> along_a_curve(const SurfaceMesh& surface, const Box& all) {
  struct Place {
    std::uint64_t code;
    int triangle;
  };
  const Vec3 cells = (2097151.0 / 3) * all.size().cwiseMax(1e-300).cwiseInverse();
  std::vector<Place> places(std::size_t(surface.triangles.rows()));
  for (int t = 0; t < int(places.size()); ++t) {
    Vec3 thrice_middle = Vec3::Zero();
    for (int c = 0; c < 3; ++c)
      thrice_middle += Vec3(surface.positions.row(surface.triangles(t, c))) - all.lower;
    const Vec3 cell = thrice_middle.cwiseProduct(cells).cwiseMin(2097151.0);
    places[t] = {spread(std::uint64_t(cell.x())) | spread(std::uint64_t(cell.y())) << 1 |
                     spread(std::uint64_t(cell.z())) << 2,
                 t};
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.code != b.code ? a.code < b.code : a.triangle < b.triangle;
  });
  std::vector<int> order(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) order[i] = places[i].triangle;
  return order;
}

class Search {
 public:
  Search(const SurfaceMesh& surface, std::size_t limit)
      : surface_(surface), limit_(limit), max_candidates_(100'000'000 + 200 * surface.triangles.rows()) {
    Box all;
    for (const int v : std::span(surface.triangles.data(), std::size_t(surface.triangles.size())))
      all.include(Vec3(surface.positions.row(v)));
    order_ = along_a_curve(surface, all);
    boxes_.reserve(order_.size());
    for (const int t : order_) boxes_.push_back(box_of(t, all.lower));
    build();
  }

  SelfIntersections run() {
    if (!order_.empty()) visit(int(levels_.size()) - 1, 0, 0);
    std::sort(found_.pairs.begin(), found_.pairs.end());
    return std::move(found_);
  }

 private:
  static constexpr int leaf_size = 4;

  SmallBox box_of(int t, const Vec3& origin) const {
    Box box;
    for (int c = 0; c < 3; ++c) box.include(Vec3(surface_.positions.row(surface_.triangles(t, c))));
    SmallBox small;
    for (int i = 0; i < 3; ++i) {
      small.lower[i] = float(box.lower[i] - origin[i]);
      small.upper[i] = float(box.upper[i] - origin[i]);
    }
    return small;
  }

  // levels_[0]: boxes of leaf_size triangles that follow each other; each level above: of two below.
  void build() {
    const auto grouped = [](const std::vector<SmallBox>& below, std::size_t size) {
      std::vector<SmallBox> level;
      level.reserve((below.size() + size - 1) / size);
      for (std::size_t i = 0; i < below.size(); ++i)
        if (i % size == 0)
          level.push_back(below[i]);
        else
          level.back().include(below[i]);
      return level;
    };
    levels_.push_back(grouped(boxes_, leaf_size));
    while (levels_.back().size() > 1) levels_.push_back(grouped(levels_.back(), 2));
  }

  // Pairs with one triangle under node i and one under node j of a level, i ≤ j; each pair once.
  void visit(int level, int i, int j) {
    if (!found_.complete || (i != j && !meet(levels_[level][i], levels_[level][j]))) return;
    if (level == 0) return visit_leaves(i, j);
    const int below = int(levels_[level - 1].size());
    for (int a = 2 * i; a < std::min(2 * i + 2, below); ++a)
      for (int b = std::max(a, 2 * j); b < std::min(2 * j + 2, below); ++b) visit(level - 1, a, b);
  }

  void visit_leaves(int i, int j) {
    const int count = int(order_.size());
    for (int a = leaf_size * i; a < std::min(leaf_size * (i + 1), count); ++a)
      for (int b = std::max(a + 1, leaf_size * j); b < std::min(leaf_size * (j + 1), count); ++b)
        if (meet(boxes_[a], boxes_[b]))
          try_pair(std::min(order_[a], order_[b]), std::max(order_[a], order_[b]));
  }

  void try_pair(int s, int t) {
    if (++candidates_ > max_candidates_) found_.complete = false;
    if (!found_.complete) return;
    throw_if_stopped();
    const auto corners = [&](int f) {
      return std::array{surface_.triangles(f, 0), surface_.triangles(f, 1), surface_.triangles(f, 2)};
    };
    if (!detail::meet_beyond_what_they_share(surface_.positions, corners(s), corners(t))) return;
    if (found_.pairs.size() == limit_)
      found_.complete = false;
    else
      found_.pairs.push_back({s, t});
  }

  const SurfaceMesh& surface_;
  const std::size_t limit_;
  // About ten a triangle is usual; long slivers side by side can ask for all pairs, and for hours.
  const std::int64_t max_candidates_;
  std::int64_t candidates_ = 0;
  std::vector<int> order_;
  std::vector<SmallBox> boxes_;  // in that order
  std::vector<std::vector<SmallBox>> levels_;
  SelfIntersections found_;
};

}  // namespace

SelfIntersections self_intersections(const SurfaceMesh& surface, std::size_t limit) {
  return Search(surface, limit).run();
}

}  // namespace limber::meshing
