// The tree of states that the search grows. Flat arrays; a node is an index, and its parent's is smaller.
#pragma once

#include <vector>

#include "core/state.h"
#include "plan/states.h"

namespace limber::plan {

// Robot centres of mass, one a node, axis by axis so that a search runs over plain arrays.
struct Centers {
  std::vector<float> x, y, z;  // metres
  int size() const { return int(x.size()); }
  Vec3f operator[](int i) const { return {x[std::size_t(i)], y[std::size_t(i)], z[std::size_t(i)]}; }
  void push_back(const Vec3f& p) { x.push_back(p.x()), y.push_back(p.y()), z.push_back(p.z()); }
};

struct Tree {
  States states;                         // [0] is the start
  std::vector<std::int32_t> parents;     // −1 for the start
  std::vector<Control> controls;         // led from the parent here; the start's is Control{}
  std::vector<std::int64_t> iterations;  // the expansion that made the node; −1 for the start
  Centers centers;                       // the planner's metric: distances between these

  int size() const { return int(states.size()); }
  int add(const State&, int parent, const Control&, std::int64_t iteration,
          const Vec3f& center);  // the new node
};

float squared_distance(const Vec3f&, const Vec3f&);
// The nearest centre; of equally near ones the first. There is at least one.
int nearest(const Centers&, const Vec3f& point);

// The nodes from the start to `node`, both included.
std::vector<int> path_to(const Tree&, int node);

std::uint64_t hash_of(const Tree&);
// Of the nodes that iterations made alone: the start, settles on the way and what came after a search are
// left out.
std::uint64_t hash_of_search(const Tree&);

}  // namespace limber::plan
