// Choosing a node: by distance or time to a random point (as LaValle and Kuffner's RRT does, IJRR 2001), or,
// for draws that are guided, by the rank of a promise. The promise of a node, seconds, less is better, is
//
//     time to the goal over the grid + time_weight × time it took
//         + child_price × (children + density_price × nodes that were in its cell before it),
//
// the first by bang-bang thrust along the cheapest way and a stop of what moves across it. With children it
// gets worse, so no node is tried for ever; with density no place is. Where what is free shuts the way, all
// that comes after it stands before it, and each of those nodes has no child yet. Density as in expansive
// space trees (Hsu, Latombe and Motwani, ICRA 1997), which draw a node by the inverse of what is near it;
// counted when a node is added, so that no rank changes by what comes later.
//
// What always holds: a choice is a function of the draw and of the nodes told of so far, in their order. Ties
// go to the first node. Prices are learnt in a copy of the grid that is this object's own, from controls that
// are in the tree.
//
// A guided draw takes the rank r with a probability that falls as 1/r.
#include "plan/node_selector.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace limber::plan {

namespace {

constexpr double child_price = 0.25;                     // of the time it takes to cross the robot's radius
constexpr double cell_radii = 0.5;                       // side of a cell for density, of the robot's radius
constexpr double nearest_ahead = 1, farthest_ahead = 5;  // of the robot's radius
constexpr double aside_share = 0.25;                     // of the way ahead
constexpr double stuck_share = 0.3;                      // of the way it would have gone in the open
constexpr double raise_by = 4;                           // price of a metre where a push got stuck
constexpr int raises_a_renewal = 4;

}  // namespace

NodeSelector::NodeSelector(const System& system, const Settings& settings, const Guidance* guidance, int root,
                           int smallest_tree)
    : system_(system),
      settings_(settings),
      root_(root),
      by_distance_(smallest_tree),
      by_time_(smallest_tree),
      by_time_of_carriers_(smallest_tree) {
  if (guidance) guidance_ = *guidance;
  const Carriers* carriers = system.carriers();
  if (!carriers) return;
  carriers_apart_m_ = (carriers->goals[1] - carriers->goals[0]).norm();
  if (!guidance) return;
  for (const Vec3& goal : carriers->goals)
    carrier_guidance_.emplace_back(guidance->workspace(), settings.goal.center_of_mass_m + goal,
                                   settings.search_options.soft_price);
}

// The strongest push there may be, on all of the robot's mass.
Drive NodeSelector::strongest() const {
  const double carriers = system_.carriers() ? 2 : 1;
  return {
      std::max(1e-9, carriers * settings_.max_force_n * settings_.max_force_share / system_.robot_mass_kg()),
      system_.robot_drag_per_s()};
}

void NodeSelector::add(const Tree& tree, int of_tree) {
  const int node = of_tree - root_;
  LIMBER_CHECK(node == centers_.size(), node, centers_.size());
  const State state = tree.states[std::size_t(of_tree)];
  const Vec3f center = tree.centers[of_tree];
  const Vec3 shift = system_.goal_shift(state);
  motions_.push_back({center.cast<double>(),
                      system_.robot_velocity(state),
                      shift,
                      system_.goal_velocity(state),
                      {},
                      system_.windings(state)});
  if (const Carriers* carriers = system_.carriers())
    for (std::size_t i = 0; i < 2; ++i)
      motions_.back().carried[i] = system_.node_place(state, carriers->nodes[i]);
  centers_.push_back(center);
  centers_from_goal_.push_back(center - shift.cast<float>());
  times_s_.push_back(double(state.step) * system_.dt_s());
  children_.push_back(0), refused_.push_back(false);
  plant(node);
  if (!guidance_) return;
  std::array<int, 3> cell;
  for (int c = 0; c < 3; ++c)
    cell[std::size_t(c)] =
        int(std::floor(double(center[c]) / (cell_radii * guidance_->workspace().robot_radius_m)));
  crowd_.push_back(nodes_in_[cell]++);
  const int parent = tree.parents[std::size_t(of_tree)] - root_;  // < 0: of the root
  if (parent >= 0) {
    unrank(parent);
    ++children_[std::size_t(parent)];
    rank(parent);
  }
  rank(node);
  if (parent >= 0 && settings_.search_options.learn_prices)
    learn(tree.controls[std::size_t(of_tree)], parent, node);
}

// By distance such a node is infinitely far, by time infinitely dear, and it has no rank.
void NodeSelector::refuse(int of_tree) {
  const int node = of_tree - root_;
  LIMBER_CHECK(node > 0 && !refused_[std::size_t(node)], node);
  refused_[std::size_t(node)] = true;
  constexpr float nowhere = std::numeric_limits<float>::infinity();  // farther than any other
  for (Centers* centers : {&centers_, &centers_from_goal_}) centers->x[std::size_t(node)] = nowhere;
  if (at_goal_ && at_goal_->node == node) at_goal_.reset();
  if (guidance_) unrank(node);
}

void NodeSelector::unrank(int node) {
  ranking_.erase(std::lower_bound(ranking_.begin(), ranking_.end(), std::pair(heuristic(node), node)));
}

void NodeSelector::rank(int node) {
  const std::pair entry(heuristic(node), node);
  ranking_.insert(std::lower_bound(ranking_.begin(), ranking_.end(), entry), entry);
}

void NodeSelector::rank_all() {
  ranking_.clear();
  for (int node = 0; node < centers_.size(); ++node)
    if (!refused_[std::size_t(node)]) ranking_.emplace_back(heuristic(node), node);
  std::sort(ranking_.begin(), ranking_.end());
}

// Along the way ahead the drive speeds up and brakes; what moves across it is to be stopped besides. Both are
// for one point mass, so they are a promise and no bound.
double NodeSelector::seconds_to_go(const Guidance& guidance, const Vec3& place, const Vec3& velocity,
                                   const Windings& windings) const {
  const double radius = guidance.workspace().robot_radius_m;
  const Vec3 way = guidance.ahead(place, 2 * radius, windings) - place;
  const Vec3 direction = way.norm() > 0 ? Vec3(way.normalized()) : Vec3::Zero();
  const double along = velocity.dot(direction), across = (velocity - along * direction).norm();
  return min_time_to_go(guidance.to_go(place, windings), along, strongest()) +
         time_to_stop(across, strongest());
}

// The formula at the top. Of two carriers the mean of both.
double NodeSelector::heuristic(int node) const {
  const NodeMotion& at = motions_[std::size_t(node)];
  double to_go = 0;
  for (std::size_t i = 0; i < carrier_guidance_.size(); ++i)
    to_go += 0.5 * seconds_to_go(carrier_guidance_[i], at.carried[i].place - at.goal_shift,
                                 at.carried[i].velocity - at.goal_velocity, {});
  if (carrier_guidance_.empty())
    to_go = seconds_to_go(*guidance_, at.center - at.goal_shift, at.velocity - at.goal_velocity, at.windings);
  return to_go + settings_.search_options.time_weight * times_s_[std::size_t(node)] +
         child_price * std::sqrt(2 * guidance_->workspace().robot_radius_m / strongest().acceleration) *
             (children_[std::size_t(node)] +
              settings_.search_options.density_price * crowd_[std::size_t(node)]);
}

// Where a strong push from parent to node got less far than it should have, going on that way gets dearer.
void NodeSelector::learn(const Control& control, int parent, int node) {
  if (control.manipulation != Manipulation::body) return;
  const NodeMotion& from = motions_[std::size_t(parent)];
  const NodeMotion& to = motions_[std::size_t(node)];
  const double t = control.steps * system_.dt_s(), radius = guidance_->workspace().robot_radius_m;
  const Vec3 push = control.force_n.cast<double>() / system_.robot_mass_kg();
  const Drive a_metre{1, system_.robot_drag_per_s()};
  const Vec3 open_way =
      (from.velocity - from.goal_velocity) * drift_m(a_metre, t) + push * driven_m(a_metre, t);
  const Vec3 way = (to.center - to.goal_shift) - (from.center - from.goal_shift);
  if (push.norm() == 0 || open_way.norm() < 0.5 * radius || way.norm() > stuck_share * open_way.norm())
    return;
  guidance_->raise(to.center - to.goal_shift + radius * push.normalized(), raise_by);
  if (++raised_ < raises_a_renewal) return;
  raised_ = 0;
  guidance_->renew();
  rank_all();
}

double NodeSelector::cost(const Sample& d, int of_tree) const { return cost_of(d, of_tree - root_); }

// Metres squared, or seconds of a point mass in open space (plan/steering.h), seen from the goal where that
// moves.
double NodeSelector::cost_of(const Sample& d, int node) const {
  if (refused_[std::size_t(node)]) return std::numeric_limits<double>::infinity();
  if (settings_.search_options.metric == Metric::distance)
    return double(
        squared_distance(d.towards_goal ? centers_from_goal_[node] : centers_[node], d.point.cast<float>()));
  const NodeMotion& at = motions_[std::size_t(node)];
  const Vec3 frame = d.towards_goal ? at.goal_velocity : Vec3::Zero();
  double seconds = settings_.search_options.time_weight * times_s_[std::size_t(node)];
  if (system_.carriers()) {
    const std::array<Vec3, 2> targets = carrier_targets(d, node);
    for (std::size_t i = 0; i < 2; ++i)
      seconds +=
          0.5 * time_to_go(targets[i] - at.carried[i].place, at.carried[i].velocity - frame, strongest());
    return seconds;
  }
  const Vec3 way = d.point + (d.towards_goal ? at.goal_shift : Vec3::Zero()) - at.center;
  return seconds + time_to_go(way, at.velocity - frame, strongest());
}

namespace {

// Every draw towards the goal asks the same.
Sample towards(const Goal& goal) {
  Sample d;
  d.point = goal.center_of_mass_m, d.towards_goal = true;
  return d;
}

}  // namespace

void NodeSelector::plant(int node) {
  const NodeMotion& at = motions_[std::size_t(node)];
  const double time_s = times_s_[std::size_t(node)];
  if (settings_.search_options.metric == Metric::distance)
    by_distance_.add({node, centers_[node]});
  else if (system_.carriers())
    by_time_of_carriers_.add({node, time_s, at.carried});
  else
    by_time_.add({node, time_s, {NodePlace{at.center, at.velocity}}});
  const double to_goal = cost_of(towards(settings_.goal), node);
  if (node == 0) at_goal_ = {node, to_goal};
  if (at_goal_) at_goal_->offer(to_goal, node);
}

int NodeSelector::nearest_to_goal() const {
  if (at_goal_) return at_goal_->node;
  at_goal_.emplace();
  for (int node = 0; node < centers_.size(); ++node)
    at_goal_->offer(cost_of(towards(settings_.goal), node), node);
  return at_goal_->node;
}

int NodeSelector::nearest_node(const Sample& d) const {
  if (d.towards_goal) return nearest_to_goal();
  const double time_weight = settings_.search_options.time_weight;
  const auto cost = [&](int node) { return cost_of(d, node); };
  Nearest found{0, cost(0)};
  if (settings_.search_options.metric == Metric::distance)
    by_distance_.search(DistanceQuery{d.point.cast<float>(), cost}, found);
  else if (system_.carriers())
    by_time_of_carriers_.search(TimeQuery{carrier_targets(d, 0), strongest(), time_weight, cost}, found);
  else
    by_time_.search(TimeQuery{std::array{d.point}, strongest(), time_weight, cost}, found);
  return found.node;
}

Selection NodeSelector::choose(const Sample& d) const {
  if (d.guided) {
    // Evenly in the logarithm of the rank: as often among the best two as among the next two to four, and so
    // on.
    const double n = double(ranking_.size());
    const auto rank = std::min(ranking_.size() - 1, std::size_t(std::pow(n + 1, d.rank)) - 1);
    const int node = ranking_[rank].second;
    return {root_ + node, 0, control(d, node)};
  }
  return aim(d, root_ + nearest_node(d));
}

Selection NodeSelector::aim(const Sample& d, int of_tree) const {
  return {of_tree, cost(d, of_tree), control(d, of_tree - root_)};
}

// Guided: ahead on each carrier's own way, and a little aside. Else the goal's pose, or a random point
// between the carriers, who keep their distance at rest along a random direction.
std::array<Vec3, 2> NodeSelector::carrier_targets(const Sample& d, int node) const {
  const NodeMotion& at = motions_[std::size_t(node)];
  std::array<Vec3, 2> targets;
  if (d.guided) {
    const double radius = guidance_->workspace().robot_radius_m;
    const double way = radius * (nearest_ahead + (farthest_ahead - nearest_ahead) * d.ahead);
    const Vec3 asides[] = {d.aside, {d.aside.y(), d.aside.z(), d.aside.x()}};
    for (std::size_t i = 0; i < 2; ++i)
      targets[i] = carrier_guidance_[i].ahead(at.carried[i].place - at.goal_shift, way) + at.goal_shift +
                   aside_share * way * asides[i];
    return targets;
  }
  for (std::size_t i = 0; i < 2; ++i)
    targets[i] = d.towards_goal ? Vec3(d.point + at.goal_shift + system_.carriers()->goals[i])
                                : Vec3(d.point + (i == 0 ? -0.5 : 0.5) * carriers_apart_m_ * d.aside);
  return targets;
}

// Guided: a push towards a place one to five radii ahead, or interpolation once that place is the goal. Else
// towards the random point, or, where the laws do not steer, as Algorithm 1 draws it.
Control NodeSelector::control(const Sample& d, int node) const {
  const NodeMotion& at = motions_[std::size_t(node)];
  if (d.manipulation == Manipulation::control_point && system_.carriers())
    return carriers_control(d, settings_, system_, at, carrier_targets(d, node),
                            d.guided || d.towards_goal ? at.goal_velocity : Vec3::Zero());
  if (d.guided) {
    const double radius = guidance_->workspace().robot_radius_m;
    const double way = radius * (nearest_ahead + (farthest_ahead - nearest_ahead) * d.ahead);
    const Vec3 target = guidance_->ahead(at.center - at.goal_shift, way, at.windings) + at.goal_shift;
    if (settings_.weights.interpolation > 0 && target == settings_.goal.center_of_mass_m + at.goal_shift) {
      Sample arriving = d;
      arriving.manipulation = Manipulation::interpolation;
      return control_of(arriving, settings_, at.center, at.goal_shift);
    }
    return steered_control(d, settings_, system_, at, target + aside_share * way * d.aside, at.goal_velocity);
  }
  if (!settings_.search_options.steer || d.manipulation == Manipulation::interpolation)
    return control_of(d, settings_, at.center, at.goal_shift);
  return d.towards_goal
             ? steered_control(d, settings_, system_, at, d.point + at.goal_shift, at.goal_velocity)
             : steered_control(d, settings_, system_, at, d.point, Vec3::Zero());
}

}  // namespace limber::plan
