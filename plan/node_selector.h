// From which node an expansion starts, and with which control. A function of the draw and of the nodes that
// it was told of, in their order.
#pragma once

#include <array>
#include <map>
#include <optional>

#include "plan/expansion.h"
#include "plan/guidance.h"
#include "plan/nearest.h"
#include "plan/steering.h"
#include "plan/tree.h"

namespace limber::plan {

struct Selection {
  int node = 0;
  double cost = 0;  // of the node for this draw, by the metric; 0 where guidance chose
  Control control;
};

class NodeSelector {
 public:
  // All must outlive it; guidance as the search begins, nullptr where the laws want none. Nodes of the tree
  // before `root` do not count. Up to `smallest_tree` nodes (a power of two from 16 on) are asked one by one;
  // the choice is the same.
  NodeSelector(const System&, const Settings&, const Guidance*, int root, int smallest_tree = 256);

  void add(const Tree&, int node);  // nodes in order, the root first
  void refuse(int node);            // not the root; no expansion starts there any more
  bool refused(int node) const { return refused_[std::size_t(node - root_)]; }
  Selection choose(const Sample&) const;  // there is a node; of equal cost the first
  Selection aim(const Sample&, int node) const;
  double cost(const Sample&, int node) const;

 private:
  // Below, nodes are counted from the root.
  double cost_of(const Sample&, int node) const;
  int nearest_node(const Sample&) const;
  int nearest_to_goal() const;
  void plant(int node);
  Control control(const Sample&, int node) const;
  // Where the carriers are to go from a node: that pose of the robot, of which the draw says centre and turn.
  std::array<Vec3, 2> carrier_targets(const Sample&, int node) const;
  double heuristic(int node) const;  // seconds to the goal; less is better
  double seconds_to_go(const Guidance&, const Vec3& place, const Vec3& velocity, const Windings&) const;
  void rank(int node);
  void unrank(int node);
  void rank_all();
  void learn(const Control&, int parent, int node);
  Drive strongest() const;

  const System& system_;
  const Settings& settings_;
  const int root_;
  std::optional<Guidance> guidance_;
  std::vector<Guidance> carrier_guidance_;  // of each carrier, to its own place in the goal
  double carriers_apart_m_ = 0;             // at rest
  Centers centers_, centers_from_goal_;
  std::vector<NodeMotion> motions_;
  std::vector<double> times_s_;                  // of the nodes
  std::vector<int> children_;                    // of a node
  std::map<std::array<int, 3>, int> nodes_in_;   // of cells of half the robot's radius
  std::vector<int> crowd_;                       // of a node: those in its cell before it
  std::vector<bool> refused_;                    // is a node
  std::vector<std::pair<double, int>> ranking_;  // (promise, node) of those that are not, ascending
  // Nodes by their places, in that which is of the metric; the others are empty.
  NearestForest<ByDistance> by_distance_;
  NearestForest<ByTime<1>> by_time_;
  NearestForest<ByTime<2>> by_time_of_carriers_;
  mutable std::optional<Nearest> at_goal_;  // of draws towards the goal; nothing: to be looked for
  int raised_ = 0;                          // prices since the cost-to-go was last renewed
};

}  // namespace limber::plan
