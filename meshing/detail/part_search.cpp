#include "meshing/detail/part_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "core/threads.h"
#include "meshing/convex_hull.h"
#include "meshing/detail/cut_search.h"

namespace limber::meshing::detail {

namespace {

// More parts are cut than asked for, and the cheapest neighbours united again.
constexpr double overcut = 1.2;
// A cut that gains less than this, over the cube of the diagonal, is none: a hull's volume is not known
// better.
constexpr double min_gain = 5e-7;
// Looking two cuts ahead is dear, so only parts of this share of the whole hull's volume may.
constexpr double worth_looking_ahead = 0.1;
// A part that stands off by more than this share of the diagonal is cut even where that gains nothing.
constexpr double far_off = 0.02;
// Of the time that decomposing takes, before the first and after the last cut; for the estimate only.
constexpr double share_before_cuts = 0.25, share_after_cuts = 0.7, share_before_cutting_anew = 0.77;
// Two parts may touch when their boxes are no farther apart.
constexpr double touching = 0.01;

// Where the hull of some points stands off the model farthest, of some hundred places outside the solid.
struct Farthest {
  double overshoot = 0;
  Vec3 point = Vec3::Zero(), outwards = Vec3::Zero();  // on the hull; across its face there
};
Farthest farthest_of(const std::vector<Vec3>& corners, InsideTest& inside, const SurfaceDistance& distance,
                     double least) {
  constexpr double samples = 500;
  Farthest farthest{.overshoot = least};
  if (rough_hull(corners, 0).flat()) return farthest;
  Points rows(Eigen::Index(corners.size()), 3);
  for (std::size_t i = 0; i < corners.size(); ++i) rows.row(Eigen::Index(i)) = corners[i].transpose();
  const ConvexShell shell = convex_hull(rows);
  const double area_of_shell = area(SurfaceMesh{shell.vertices, shell.triangles});
  for (const BoundarySample& sample : boundary_samples({shell}, samples / area_of_shell))
    if (const double d = distance.at(sample.point); d > farthest.overshoot && !inside(sample.point))
      farthest.overshoot = d, farthest.point = sample.point;
  if (farthest.overshoot == least) return farthest;
  double nearest = 1e300;
  const auto planes = detail::planes_of(shell);
  for (Eigen::Index f = 0; f < planes.rows(); ++f)
    if (const double off = std::abs(planes.row(f).head<3>().dot(farthest.point) + planes(f, 3));
        off < nearest)
      nearest = off, farthest.outwards = planes.row(f).head<3>();
  return farthest;
}
// How far, and `least` when less.
double hull_overshoot(const std::vector<Vec3>& corners, InsideTest& inside, const SurfaceDistance& distance,
                      double least) {
  return farthest_of(corners, inside, distance, least).overshoot;
}

struct Leaf {
  Part part;
  Cut cut;
  double overshoot = 0;
  std::optional<Farthest> farthest = {};  // where it was asked for
};

std::vector<Part> cut_up(Model& model, Part root, InsideTest& inside, const SurfaceDistance& distance,
                         const PartLimits& limits, Progress& progress) {
  std::vector<Leaf> leaves;
  const double worth = worth_looking_ahead * root.hull_volume;
  const std::size_t wanted = std::size_t(parts_to_cut(limits.most));
  const auto seen = [&](Part part) {
    throw_if_stopped();
    Leaf leaf;
    if (wanted > 1) leaf.cut = (part.hull_volume > worth ? best_cut_ahead : best_cut)(model, part, inside);
    if (limits.max_overshoot > 0) leaf.overshoot = hull_overshoot(part.hull, inside, distance, 0);
    leaf.part = std::move(part);
    return leaf;
  };
  // Walls round a hollow have the hull of the whole until the cuts are so many that each part has few of
  // them.
  const auto farthest_leaf = [&]() -> Leaf* {
    Leaf* farthest = nullptr;
    double most = std::max(far_off, limits.max_overshoot);
    for (Leaf& leaf : leaves) {
      if (!leaf.farthest) leaf.farthest = farthest_of(leaf.part.hull, inside, distance, 0);
      if (leaf.farthest->overshoot > most) most = leaf.farthest->overshoot, farthest = &leaf;
    }
    return farthest;
  };
  progress.update(0, "the first cut", share_before_cuts);
  leaves.push_back(seen(std::move(root)));
  while (leaves.size() < wanted) {
    progress.update(
        std::int64_t(leaves.size()), "parts",
        share_before_cuts + (share_after_cuts - share_before_cuts) * double(leaves.size()) / double(wanted));
    Leaf* best = nullptr;
    for (Leaf& leaf : leaves)
      if (leaf.cut.gain > (best ? best->cut.gain : min_gain) &&
          (limits.max_overshoot == 0 || leaf.overshoot > limits.max_overshoot))
        best = &leaf;
    if (!best) {
      best = farthest_leaf();
      if (!best) break;
      const Farthest& at = *best->farthest;
      best->cut = {cut_through(model, best->part, at.point, at.outwards, inside), 0, true};
    }
    auto [below, above] = cut(model, best->part, best->cut.plane, inside);
    if (!best->cut.is_first_of_two &&
        best->part.hull_volume - below.hull_volume - above.hull_volume <= min_gain) {
      best->cut.gain = 0;  // the sketch promised too much
      continue;
    }
    Leaf lower, upper;
    side_by_side(2, [&](int i) { i == 0 ? lower = seen(std::move(below)) : upper = seen(std::move(above)); });
    *best = std::move(lower);
    leaves.push_back(std::move(upper));
  }
  std::vector<Part> parts;
  for (Leaf& leaf : leaves)
    if (!leaf.part.hull.empty()) parts.push_back(std::move(leaf.part));
  return parts;
}

// The hull of a part in so few corners that all pairs can be tried. What it lacks it lacks alone and united.
struct Outline {
  explicit Outline(std::vector<Vec3> points) {
    constexpr double coarse = 5e-4;
    GrowingHull hull = rough_hull(std::move(points), coarse);
    corners = hull.vertices();
    volume = rough_hull(corners, fine).volume();
    for (const Vec3& p : corners) box.include(p);
  }
  double volume_with(const Outline& other) const { return rough_hull(corners_with(other), fine).volume(); }
  std::vector<Vec3> corners_with(const Outline& other) const {
    std::vector<Vec3> both = corners;
    both.insert(both.end(), other.corners.begin(), other.corners.end());
    return both;
  }
  bool near(const Outline& other) const {
    return (box.lower.array() <= other.box.upper.array() + touching).all() &&
           (other.box.lower.array() <= box.upper.array() + touching).all();
  }
  static constexpr double fine = 1e-5;
  std::vector<Vec3> corners;
  double volume;
  Box box;
};

// Unites parts, cheapest first, until they are few enough; and on while it costs nothing, or, with a bound,
// while the bound holds.
void unite_cheapest(std::vector<Part>& parts, InsideTest& inside, const SurfaceDistance& distance,
                    const PartLimits& limits) {
  std::vector<std::optional<Outline>> outlines;  // none: united into another
  for (const Part& part : parts) outlines.emplace_back(part.hull);
  using PairOfParts = std::pair<std::size_t, std::size_t>;  // the less first
  std::map<PairOfParts, double> cost;
  // Of all pairs with a part of [first, last).
  const auto find_costs = [&](std::size_t first, std::size_t last, bool only_near) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = first; i < last; ++i)
      for (std::size_t j = 0; j < outlines.size(); ++j) {
        const auto &a = outlines[i], &b = outlines[j];
        const bool is_of_j = j > i && j < last;  // listed there
        if (j != i && !is_of_j && a && b && (!only_near || a->near(*b))) pairs.emplace_back(i, j);
      }
    std::vector<double> costs(pairs.size());
    parallel_for(int(pairs.size()), [&](int k) {
      const Outline &a = *outlines[pairs[std::size_t(k)].first], &b = *outlines[pairs[std::size_t(k)].second];
      costs[std::size_t(k)] = a.volume_with(b) - a.volume - b.volume;
    });
    for (std::size_t k = 0; k < pairs.size(); ++k)
      cost[std::minmax(pairs[k].first, pairs[k].second)] = costs[k];
  };
  find_costs(0, outlines.size(), true);
  // Two slender parts far apart have a common hull of little volume too: no hull may stand off more than the
  // worst did before, while there is a choice.
  std::vector<double> overshoots(parts.size());
  parallel_for(int(parts.size()), [&](int i) {
    overshoots[std::size_t(i)] = hull_overshoot(parts[std::size_t(i)].hull, inside, distance, 0);
  });
  double worst = limits.max_overshoot;
  for (const double overshoot : overshoots) worst = std::max(worst, overshoot);
  const auto limit_of = [&](double extra, bool too_many) {
    return too_many || extra <= min_gain ? worst : limits.max_overshoot;
  };
  std::set<std::pair<PairOfParts, double>> refused;  // for that limit
  for (std::size_t alive = outlines.size(); alive > 1; --alive) {
    throw_if_stopped();
    const bool too_many = alive > std::size_t(limits.most);
    if (cost.empty() && too_many) find_costs(0, outlines.size(), false);
    std::vector<std::pair<double, PairOfParts>> by_cost;
    for (const auto& [pair, value] : cost) by_cost.push_back({value, pair});
    std::sort(by_cost.begin(), by_cost.end());
    std::optional<PairOfParts> chosen;
    if (too_many && !by_cost.empty()) chosen = by_cost.front().second;  // where none may be united
    // The cheapest that may. As many are asked at a time as there are threads; which is the first of
    // those that may does not depend on it.
    std::erase_if(by_cost, [&](const auto& entry) {
      const double limit = limit_of(entry.first, too_many);
      return limit == 0 || refused.contains({entry.second, limit});
    });
    bool found = false;
    for (std::size_t first = 0; !found && first < by_cost.size();) {
      const std::size_t last = std::min(first + std::size_t(thread_count()), by_cost.size());
      std::vector<char> may(by_cost.size());
      parallel_for(int(last - first), [&](int i) {
        const std::size_t k = first + std::size_t(i);
        const auto& [value, pair] = by_cost[k];
        const double limit = limit_of(value, too_many);
        const std::vector<Vec3> both = outlines[pair.first]->corners_with(*outlines[pair.second]);
        may[k] = hull_overshoot(both, inside, distance, limit) <= limit;
      });
      for (; !found && first < last; ++first) {
        const auto& [value, pair] = by_cost[first];
        found = may[first];
        if (found)
          chosen = pair;
        else
          refused.insert({pair, limit_of(value, too_many)});
      }
    }
    if (!chosen) break;
    const auto [i, j] = *chosen;
    parts[i] = unite(parts[i], parts[j]);
    outlines[i].emplace(outlines[i]->corners_with(*outlines[j]));
    outlines[j].reset();
    const auto changed = [i = i, j = j](const auto& entry) {
      const auto& [a, b] = entry.first;
      return a == i || b == i || a == j || b == j;
    };
    std::erase_if(cost, changed), std::erase_if(refused, changed);
    find_costs(i, i + 1, true);
  }
  std::vector<Part> kept;
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (outlines[i]) kept.push_back(std::move(parts[i]));
  parts = std::move(kept);
}

// Two neighbours that nearly fill their common hull are often better cut elsewhere: each was cut to please a
// larger part.
void cut_anew(Model& model, std::vector<Part>& parts, InsideTest& inside, const SurfaceDistance& distance,
              const PartLimits& limits) {
  constexpr double nearly_fill = 0.05;  // the share of the common hull that may be in neither
  struct Pair {
    double empty;
    std::size_t a, b;
  };
  std::vector<Outline> outlines;
  for (const Part& part : parts) outlines.emplace_back(part.hull);
  std::vector<Pair> pairs;
  for (std::size_t b = 0; b < parts.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      if (outlines[a].near(outlines[b])) pairs.push_back({0, a, b});
  parallel_for(int(pairs.size()), [&](int k) {
    auto& [empty, a, b] = pairs[std::size_t(k)];
    const double together = outlines[a].volume_with(outlines[b]);
    empty = (together - outlines[a].volume - outlines[b].volume) / together;
  });
  std::erase_if(pairs, [](const Pair& pair) { return !(pair.empty < nearly_fill); });
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& p, const Pair& q) { return p.empty < q.empty; });
  // Pairs one after the other that share no part are looked at side by side, and then cut in their order.
  std::vector<Part> united(pairs.size());
  std::vector<Cut> cuts(pairs.size());
  std::size_t seen = 0;  // pairs
  const auto look_at_next = [&] {
    constexpr std::size_t most = 8;
    const std::size_t first = seen;
    const auto shares_a_part = [&](std::size_t k) {
      for (std::size_t i = first; i < k; ++i)
        for (const std::size_t p : {pairs[i].a, pairs[i].b})
          if (p == pairs[k].a || p == pairs[k].b) return true;
      return false;
    };
    while (seen < pairs.size() && seen < first + most && !shares_a_part(seen)) ++seen;
    side_by_side(int(seen - first), [&](int i) {
      const std::size_t k = first + std::size_t(i);
      throw_if_stopped();
      united[k] = unite(parts[pairs[k].a], parts[pairs[k].b]);
      cuts[k] = best_cut(model, united[k], inside);
    });
  };
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (k == seen) look_at_next();
    const auto [empty, a, b] = pairs[k];
    const Part both = std::move(united[k]);
    const Cut& best = cuts[k];
    if (best.gain <= 0) continue;
    auto [below, above] = cut(model, both, best.plane, inside);
    if (below.hull_volume + above.hull_volume > parts[a].hull_volume + parts[b].hull_volume - min_gain)
      continue;
    double overshoots[4];
    const Part* const asked[4] = {&below, &above, &parts[a], &parts[b]};
    parallel_for(4, [&, &below = below](int i) {
      overshoots[i] = hull_overshoot(asked[i]->hull, inside, distance, 0);
    });
    if (std::max(overshoots[0], overshoots[1]) >
        std::max({overshoots[2], overshoots[3], limits.max_overshoot}))
      continue;
    parts[a] = std::move(below), parts[b] = std::move(above);
  }
}

}  // namespace

int parts_to_cut(int most) { return most == 1 ? 1 : int(std::ceil(overcut * most)); }

std::vector<Part> find_parts(Model& model, Part whole, InsideTest& inside, const SurfaceDistance& distance,
                             const PartLimits& limits, Progress& progress) {
  std::vector<Part> parts = cut_up(model, std::move(whole), inside, distance, limits, progress);
  const std::int64_t cut = std::int64_t(parts.size());
  progress.update(cut, "uniting", share_after_cuts);
  unite_cheapest(parts, inside, distance, limits);
  progress.update(cut, "cutting anew", share_before_cutting_anew);
  cut_anew(model, parts, inside, distance, limits);
  return parts;
}

}  // namespace limber::meshing::detail
