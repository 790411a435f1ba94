// Which way to go: the cost-to-go to the goal over a grid of the workspace, in which tight and soft places
// can be passed at a price (Dijkstra over 26 neighbours; distances by Felzenszwalb and Huttenlocher, Distance
// Transforms of Sampled Functions, 2012). Where the goal asks how a strand hangs in holes, the grid has a
// sheet for each class of ways through them, joined at the holes. Method: docs/planning.md.
#pragma once

#include <map>
#include <vector>

#include "plan/system.h"

namespace limber::plan {

class Guidance {
 public:
  // Prices: 1 + soft_price · share², where share is what of the robot's radius does not fit between a place
  // and what is soft; likewise, and ten times dearer, for what is rigid.
  // `start`: how the strand hangs in the holes as the search begins.
  Guidance(const Workspace&, const Vec3& goal, double soft_price, const Windings& start = {});

  // Of a strand's end, with how the strand hangs behind it. Metres, where the passage is free; outside the
  // box, of the nearest place. Of windings that lead nowhere, as much as of any.
  double to_go(const Vec3& place, const Windings& = {}) const;
  // The place `way_m` metres ahead on the cheapest way to the goal, or the goal; of windings that lead
  // nowhere, the place itself.
  Vec3 ahead(const Vec3& place, double way_m, const Windings& = {}) const;
  double price(const Vec3& place) const;
  // A metre round `place` costs `by` more. To be seen after renew().
  void raise(const Vec3& place, double by);
  void renew();  // the cost-to-go under the present prices

  // Of a strand that hangs in holes the robot's radius is that in which it bends.
  const Workspace& workspace() const { return space_; }

 private:
  Vec3 center_of(int cell) const;
  int cell_at(const Vec3&) const;
  void set_prices(double soft_price);
  void set_sheets(const Windings& start);
  // Where one is with these windings: the cell and the sheet. −1: on no sheet.
  int node_at(const Vec3& place, Windings) const;
  // The sheet on which one is behind a step between neighbours; −1: none.
  int sheet_behind(int sheet, int cell, int other) const;
  int cells() const { return int(price_.size()); }

  Workspace space_;
  Vec3 goal_;
  std::vector<float> price_;      // [cell] of a metre
  std::vector<Windings> sheets_;  // by length, the first of none
  std::map<Windings, int> sheet_of_;
  std::vector<bool> near_hole_;  // [cell] a step from there may lead through one
  std::vector<float> to_go_;     // [sheet · cells + cell]
  std::vector<int> next_;        // likewise: the neighbour on the cheapest way; itself where the goal is
  float farthest_ = 0;
};

// Distance from every cell's middle to the middle of the nearest cell of which `is` holds, in cells; 1e9
// where there is none. [(z · ny + y) · nx + x]
std::vector<float> distance_in_cells(const Eigen::Vector3i& cells, const std::vector<bool>& is);

}  // namespace limber::plan
