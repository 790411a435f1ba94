// Sweep and prune (Baraff 1992; Cohen and others 1995), with boxes so much larger that its pairs last for
// many steps. With s the way that a body's fastest node has gone since they were made, no side of its box has
// moved by more than s. So
//
//     boxes are moved out by slack + reach, and pairs are used while     s ≤ 0.9 slack     of all bodies.
//
// What always holds: two bodies that are near are among the pairs, and pairs are in ascending order. Whoever
// asks looks at the boxes themselves, so which others are found with them, and when, changes no bit of a
// result (test NearPairs.AreThoseOfAllPairs).
#include "fem/detail/near_pairs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "fem/detail/list_margins.h"
#include "fem/world.h"

namespace limber::fem::detail {
template <class Real>
NearPairs<Real>::NearPairs(const World& world, std::vector<Real> slack, std::vector<Real> reach, int lanes)
    : slack_(std::move(slack)), reach_(std::move(reach)), of_lane_(std::size_t(lanes)) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const Body& body = world.bodies[b];
    pushed_.push_back(body.pushed());
    if (body.moving && body.self_contact) touching_themselves_.push_back(int(b));
    reach_[b] += slack_[b];
  }
}

template <class Real>
std::vector<NearPair>& NearPairs<Real>::find(int lane, const LaneView<Real>& view) {
  OfLane& of_lane = of_lane_[std::size_t(lane)];
  bool worn = !of_lane.made;
  for (std::size_t b = 0; b < slack_.size() && !worn; ++b)
    worn = !(view.travel[b * std::size_t(view.stride)] - of_lane.travel_when_made[b] <=
             list_margins::kept * slack_[b]);
  if (worn) make(view, of_lane);
  return of_lane.pairs;
}

// Its lists stay with the pairs: whoever keeps them knows that they are of another state.
template <class Real>
void NearPairs<Real>::forget(int lane) {
  of_lane_[std::size_t(lane)].made = false;
}

template <class Real>
int NearPairs<Real>::free_list() {
  if (free_.empty()) return lists_++;
  std::pop_heap(free_.begin(), free_.end(), std::greater<>());
  const int list = free_.back();
  free_.pop_back();
  return list;
}

// Boxes are sorted by their lower sides along the axis on which bodies are spread the most, for their size,
// and each is compared with those that begin before it ends. A side that is not a number, in a rollout that
// diverges, is everywhere.
template <class Real>
void NearPairs<Real>::make(const LaneView<Real>& view, OfLane& of_lane) {
  constexpr Real far = std::numeric_limits<Real>::max();
  const std::size_t bodies = slack_.size();
  of_lane.made = true;
  of_lane.travel_when_made.resize(bodies), boxes_.resize(bodies);
  Real least[3] = {far, far, far}, most[3] = {-far, -far, -far}, sizes[3] = {0, 0, 0};
  for (std::size_t b = 0; b < bodies; ++b) {
    Box& box = boxes_[b];
    box.body = int(b), box.pushed = pushed_[b];
    of_lane.travel_when_made[b] = view.travel[b * std::size_t(view.stride)];
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t k = (3 * b + c) * std::size_t(view.stride);
      const Real lower = view.lower[k] - reach_[b], upper = view.upper[k] + reach_[b];
      box.lower[c] = std::isnan(lower) ? -far : lower, box.upper[c] = std::isnan(upper) ? far : upper;
      if (!(std::abs(lower) < far && std::abs(upper) < far)) continue;
      least[c] = std::min(least[c], lower), most[c] = std::max(most[c], upper), sizes[c] += upper - lower;
    }
  }
  std::size_t axis = 0;
  for (std::size_t c = 1; c < 3; ++c)
    if ((most[c] - least[c]) * sizes[axis] > (most[axis] - least[axis]) * sizes[c]) axis = c;
  std::sort(boxes_.begin(), boxes_.end(),
            [axis](const Box& one, const Box& other) { return one.lower[axis] < other.lower[axis]; });
  found_.clear();
  for (const int body : touching_themselves_) found_.push_back({body, body});
  const std::size_t next = (axis + 1) % 3, last = (axis + 2) % 3;
  for (std::size_t i = 0; i < bodies; ++i) {
    const Box& one = boxes_[i];
    for (std::size_t j = i + 1; j < bodies && !(boxes_[j].lower[axis] > one.upper[axis]); ++j) {
      const Box& other = boxes_[j];
      if (one.lower[next] > other.upper[next] || other.lower[next] > one.upper[next] ||
          one.lower[last] > other.upper[last] || other.lower[last] > one.upper[last])
        continue;
      // Two boxes can also be one before the other along the axis, where one has no inside.
      if (one.lower[axis] > other.upper[axis] || !(one.pushed || other.pushed)) continue;
      found_.push_back({std::min(one.body, other.body), std::max(one.body, other.body)});
    }
  }
  std::sort(found_.begin(), found_.end());
  auto before = of_lane.pairs.begin();
  const auto give_back = [&] {
    if (before->list >= 0)
      free_.push_back(before->list), std::push_heap(free_.begin(), free_.end(), std::greater<>());
    ++before;
  };
  for (NearPair& pair : found_) {
    while (before != of_lane.pairs.end() && *before < pair) give_back();
    if (before != of_lane.pairs.end() && !(pair < *before)) pair.list = (before++)->list;
  }
  while (before != of_lane.pairs.end()) give_back();
  of_lane.pairs.swap(found_);
}

template class NearPairs<float>;
template class NearPairs<double>;

}  // namespace limber::fem::detail
