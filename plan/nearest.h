// The node of least cost, without asking all of them: k-d trees over the places of nodes.
//
// Nodes come one after the other and none goes. So trees are made by the logarithmic method (Bentley and
// Saxe, Decomposable Searching Problems, J. Algorithms 1980): each block of nodes becomes a tree, and two
// trees of one size become one of twice that. A tree is of nodes that follow one another, its branches are
// equally large whatever the places are, and of n nodes each is sorted in log n times. The newest are asked
// one by one.
//
// What always holds: the answer is that of a scan over all nodes in their order, the least cost, and of
// equals the first. A branch is passed over only where none of its nodes can be less, or equal and earlier.
// Bounds are no more than what the metric computes, rounding included.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "plan/steering.h"
#include "plan/system.h"
#include "plan/tree.h"

namespace limber::plan {

// What has been found so far.
struct Nearest {
  int node = 0;
  double cost = std::numeric_limits<double>::infinity();
  bool is_beaten_by(double other_cost, int other) const {
    return other_cost < cost || (other_cost == cost && other < node);
  }
  void offer(double other_cost, int other) {
    if (is_beaten_by(other_cost, other)) cost = other_cost, node = other;
  }
};

// A node as a metric sees it, and a branch of them. Metric::Item has `node` and coordinates, Metric::Branch
// includes items and other branches and has `first_node`. A query has bound(Item) and bound(Branch), both no
// more than cost(node) of any node in them.
template <class Metric>
class NearestForest {
 public:
  using Item = typename Metric::Item;
  using Branch = typename Metric::Branch;

  // Nodes of the smallest tree: a power of two from 16 on.
  explicit NearestForest(int block) : block_(std::size_t(block)) {}

  void add(const Item& item) {  // in the order of nodes
    fresh_.push_back(item);
    if (fresh_.size() == block_) plant();
  }

  template <class Query>
  void search(const Query& query, Nearest& nearest) const {
    for (const Tree& tree : trees_) tree.search(query, nearest, 0, query.bound(tree.branches[0]));
    ask(query, nearest, fresh_);
  }

 private:
  static constexpr std::size_t leaf = 16;  // items

  template <class Query>
  static void ask(const Query& query, Nearest& nearest, std::span<const Item> items) {
    for (const Item& item : items)
      if (nearest.is_beaten_by(query.bound(item), item.node)) nearest.offer(query.cost(item.node), item.node);
  }

  // Branch b parts into 2b + 1 and 2b + 2. The last of them are leaves; the i-th has `leaf` items from
  // leaf × i on.
  struct Tree {
    std::vector<Item> items;
    std::vector<Branch> branches;

    explicit Tree(std::vector<Item> all) : items(std::move(all)), branches(2 * (items.size() / leaf) - 1) {
      sort(0, 0, items.size());
    }

    std::size_t first_leaf() const { return branches.size() / 2; }

    // Halves where they are widest.
    void sort(std::size_t b, std::size_t from, std::size_t to) {
      Branch& branch = branches[b];
      for (std::size_t i = from; i < to; ++i) branch.include(items[i]);
      if (b >= first_leaf()) return;
      const int axis = branch.widest();
      const auto begin = items.begin(), middle = begin + std::ptrdiff_t((from + to) / 2);
      std::nth_element(begin + std::ptrdiff_t(from), middle, begin + std::ptrdiff_t(to),
                       [axis](const Item& p, const Item& q) {
                         const auto x = p.coordinate(axis), y = q.coordinate(axis);
                         return x < y || (x == y && p.node < q.node);
                       });
      sort(2 * b + 1, from, (from + to) / 2);
      sort(2 * b + 2, (from + to) / 2, to);
    }

    template <class Query>
    void search(const Query& query, Nearest& nearest, std::size_t b, double bound) const {
      if (!nearest.is_beaten_by(bound, branches[b].first_node)) return;
      if (b >= first_leaf()) return ask(query, nearest, {&items[leaf * (b - first_leaf())], leaf});
      std::size_t near = 2 * b + 1, far = near + 1;
      double to_near = query.bound(branches[near]), to_far = query.bound(branches[far]);
      if (to_far < to_near || (to_far == to_near && branches[far].first_node < branches[near].first_node))
        std::swap(near, far), std::swap(to_near, to_far);
      search(query, nearest, near, to_near);
      search(query, nearest, far, to_far);
    }
  };

  void plant() {
    std::vector<Item> items = std::move(fresh_);
    for (; !trees_.empty() && trees_.back().items.size() == items.size(); trees_.pop_back()) {
      std::vector<Item>& earlier = trees_.back().items;
      items.insert(items.end(), earlier.begin(), earlier.end());
    }
    trees_.emplace_back(std::move(items));
    fresh_ = {};
  }

  std::size_t block_;
  std::vector<Tree> trees_;  // each of earlier nodes than the next, and larger
  std::vector<Item> fresh_;
};

// Squares of distances between centres of mass, in float32 as the scan has them: differences, squares and
// sums are rounded, and rounding keeps the order.
struct ByDistance {
  struct Item {
    int node;
    Vec3f center;
    float coordinate(int axis) const { return center[axis]; }
  };
  struct Branch {
    int first_node = std::numeric_limits<int>::max();
    Vec3f lower = Vec3f::Constant(std::numeric_limits<float>::infinity()), upper = -lower;
    void include(const Item& item) {
      first_node = std::min(first_node, item.node);
      lower = lower.cwiseMin(item.center), upper = upper.cwiseMax(item.center);
    }
    int widest() const {
      int axis;
      (upper - lower).maxCoeff(&axis);
      return axis;
    }
  };
};

template <class Cost>
struct DistanceQuery {
  Vec3f point;
  Cost cost;  // of a node

  double bound(const ByDistance::Item& item) const { return double(squared_distance(item.center, point)); }
  double bound(const ByDistance::Branch& branch) const {
    return double(squared_distance(point.cwiseMax(branch.lower).cwiseMin(branch.upper), point));
  }
};

// The mean of the times in which a force brings one point, or each of two, to where it is wanted, and a share
// of the node's own time besides (plan/steering.h).
template <std::size_t points>
struct ByTime {
  struct Item {
    int node;
    double time_s;
    std::array<NodePlace, points> at;
    double coordinate(int axis) const { return at[std::size_t(axis / 3)].place[axis % 3]; }
  };
  struct Branch {
    int first_node = std::numeric_limits<int>::max();
    double first_time_s = std::numeric_limits<double>::infinity();
    std::array<Box, points> boxes;
    std::array<double, points> largest_speed{};
    void include(const Item& item) {
      first_node = std::min(first_node, item.node);
      first_time_s = std::min(first_time_s, item.time_s);
      for (std::size_t i = 0; i < points; ++i) {
        boxes[i].include(item.at[i].place);
        largest_speed[i] = std::max(largest_speed[i], item.at[i].velocity.norm());
      }
    }
    int widest() const {
      int widest = 0;
      double width = -1;
      for (int axis = 0; axis < int(3 * points); ++axis)
        if (const double w = boxes[std::size_t(axis / 3)].size()[axis % 3]; w > width)
          widest = axis, width = w;
      return widest;
    }
  };
};

template <std::size_t points, class Cost>
struct TimeQuery {
  std::array<Vec3, points> targets;
  Drive drive;
  double time_weight;
  Cost cost;  // of a node

  double bound(const typename ByTime<points>::Item& item) const {
    double seconds = time_weight * item.time_s;
    for (std::size_t i = 0; i < points; ++i) {
      const Vec3 way = targets[i] - item.at[i].place;
      const double distance = way.norm();
      seconds += no_sooner(distance, distance > 0 ? item.at[i].velocity.dot(way) / distance : 0,
                           item.at[i].velocity.norm()) /
                 double(points);
    }
    return seconds;
  }
  double bound(const typename ByTime<points>::Branch& branch) const {
    double seconds = time_weight * branch.first_time_s;
    for (std::size_t i = 0; i < points; ++i) {
      const Box& box = branch.boxes[i];
      const double distance = (targets[i].cwiseMax(box.lower).cwiseMin(box.upper) - targets[i]).norm();
      seconds += no_sooner(distance, branch.largest_speed[i], branch.largest_speed[i]) / double(points);
    }
    return seconds;
  }

 private:
  // From |way − v t| ≥ d − c t for the speed c towards the target: no t with |way − v t| = a t²/2 is less.
  // Drag makes it later, but where it slows what flies away. The margins are far above rounding: time_to_go
  // finds a root of rounded terms, which are off by some ulps of d and of |v| t.
  double no_sooner(double distance, double closing, double speed) const {
    if (distance <= 0) return 0;
    if (drive.drag_per_s > 0) closing = std::max(closing, 0.0);
    const double a = drive.acceleration, root = std::sqrt(closing * closing + 2 * a * distance);
    const double t = closing > 0 ? 2 * distance / (closing + root) : (root - closing) / a;
    return std::max(0.0, t * (1 - 1e-9) - 1e-12 * speed / a);
  }
};

}  // namespace limber::plan
