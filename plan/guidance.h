// Which way to go: the cost-to-go to the goal over a grid of the workspace, in which tight and soft places
// can be passed at a price (Dijkstra over 26 neighbours; distances by Felzenszwalb and Huttenlocher, Distance
// Transforms of Sampled Functions, 2012). Method: docs/planning.md.
#pragma once

#include <vector>

#include "plan/system.h"

namespace limber::plan {

class Guidance {
 public:
  // Prices: 1 + soft_price · share², where share is what of the robot's radius does not fit between a place
  // and what is soft; likewise, and ten times dearer, for what is rigid.
  Guidance(const Workspace&, const Vec3& goal, double soft_price);

  double to_go(
      const Vec3& place) const;  // metres, where the passage is free; outside the box, of the nearest place
  // The place `way_m` metres ahead on the cheapest way to the goal, or the goal.
  Vec3 ahead(const Vec3& place, double way_m) const;
  double price(const Vec3& place) const;
  // A metre round `place` costs `by` more. To be seen after renew().
  void raise(const Vec3& place, double by);
  void renew();  // the cost-to-go under the present prices

  const Workspace& workspace() const { return space_; }

 private:
  Vec3 center_of(int cell) const;
  int cell_at(const Vec3&) const;
  void set_prices(double soft_price);

  Workspace space_;
  Vec3 goal_;
  std::vector<float> price_;  // [cell] of a metre
  std::vector<float> to_go_;  // [cell]
  std::vector<int> next_;     // [cell] the neighbour on the cheapest way; itself where the goal is
};

// Distance from every cell's middle to the middle of the nearest cell of which `is` holds, in cells; 1e9
// where there is none. [(z · ny + y) · nx + x]
std::vector<float> distance_in_cells(const Eigen::Vector3i& cells, const std::vector<bool>& is);

}  // namespace limber::plan
