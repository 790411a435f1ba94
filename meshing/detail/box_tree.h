// A binary tree of boxes over numbered things, built once. The answers of its users never depend on the
// tree's shape.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

class BoxTree {
 public:
  explicit BoxTree(const std::vector<Box>& boxes);

  // Calls visit(thing) for the things in leaves whose box, and whose ancestors' boxes, are not rejected,
  // until visit returns true. Returns whether it did.
  template <class Rejects, class Visit>
  bool any(Rejects rejects, Visit visit) const {
    int pending[max_depth];
    int count = 0;
    pending[count++] = 0;
    while (count > 0) {
      const Node& node = nodes_[pending[--count]];
      if (rejects(node.box)) continue;
      if (node.left < 0) {
        for (int i = node.first; i < node.last; ++i)
          if (visit(things_[i])) return true;
      } else {
        pending[count++] = node.left + 1;
        pending[count++] = node.left;
      }
    }
    return false;
  }

  // Calls visit(thing), nearest boxes first, while the squared distance from p to the box is not above the
  // bound that visit returned last.
  template <class Visit>
  void nearest(const Vec3& p, double bound, Visit visit) const {
    struct Pending {
      int node;
      double squared_distance;
    } pending[max_depth];
    int count = 0;
    pending[count++] = {0, squared_distance(nodes_[0].box, p)};
    while (count > 0) {
      const Pending top = pending[--count];
      if (top.squared_distance > bound) continue;
      const Node& node = nodes_[top.node];
      if (node.left < 0) {
        for (int i = node.first; i < node.last; ++i) bound = visit(things_[i]);
        continue;
      }
      const Pending a{node.left, squared_distance(nodes_[node.left].box, p)};
      const Pending b{node.left + 1, squared_distance(nodes_[node.left + 1].box, p)};
      const bool a_first = a.squared_distance <= b.squared_distance;
      pending[count++] = a_first ? b : a;
      pending[count++] = a_first ? a : b;
    }
  }

 private:
  struct Node {
    Box box;
    int left = -1;  // its children are left and left + 1; −1: a leaf
    int first = 0, last = 0;
  };
  static constexpr int max_depth = 96;  // halving 2³¹ things needs 31 levels, two entries each at most
  static double squared_distance(const Box& box, const Vec3& p) {
    return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).squaredNorm();
  }
  void split(int node, const std::vector<Box>& boxes);

  std::vector<Node> nodes_;
  std::vector<int> things_;
};

}  // namespace limber::meshing::detail
