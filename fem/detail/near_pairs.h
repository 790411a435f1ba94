// Which pairs of bodies may be near one another in a lane, found without asking all of them at each step.
#pragma once

#include <vector>

#include "fem/detail/lane_view.h"

namespace limber::fem {
struct World;
}

namespace limber::fem::detail {

// Two bodies a < b of which contact can push at least one, or a body a = b that touches itself.
struct NearPair {
  int a, b;
  int list = -1;  // of what its owner keeps for the pair, which one; −1: none yet
  bool operator<(const NearPair& other) const { return a != other.a ? a < other.a : b < other.b; }
};

template <class Real>
class NearPairs {
 public:
  // Two bodies are near where their boxes, moved out by `reach`, meet. Pairs are made anew when a body has
  // gone its `slack`: a skin is some tens of steps, and bodies that lie side by side are no pairs yet. Both
  // [body], metres.
  NearPairs(const World&, std::vector<Real> slack, std::vector<Real> reach, int lanes);
  // Ascending; all that are near now, some that are not, and each body that touches itself. Valid until the
  // next call for this lane.
  std::vector<NearPair>& find(int lane, const LaneView<Real>&);
  // As the last call had them.
  const std::vector<NearPair>& found_before(int lane) const { return of_lane_[std::size_t(lane)].pairs; }
  void forget(int lane);  // the lane holds another state now
  // The number of a list that no pair has, the lowest there is. Lists of pairs that are no longer found come
  // back by themselves.
  int free_list();

 private:
  struct OfLane {
    bool made = false;
    std::vector<Real> travel_when_made;  // [body]
    std::vector<NearPair> pairs;
  };
  struct Box {
    Real lower[3], upper[3];
    int body;
    bool pushed;
  };
  void make(const LaneView<Real>&, OfLane&);

  std::vector<bool> pushed_;              // [body]
  std::vector<int> touching_themselves_;  // ascending
  std::vector<Real> slack_, reach_;       // [body]; the reach with the slack
  std::vector<OfLane> of_lane_;
  std::vector<int> free_;
  int lists_ = 0;
  std::vector<Box> boxes_;       // scratch
  std::vector<NearPair> found_;  // scratch
};

}  // namespace limber::fem::detail
