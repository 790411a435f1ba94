// What is seen of a motion: how the fine surfaces lie to one another at every stored frame. Method:
// docs/seen.md.
#pragma once

#include <deque>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/state.h"
#include "fem/world.h"
#include "limber/detail/body/body.h"
#include "meshing/surface_overlap.h"

namespace limber::detail {

// What is promised of what is seen, as shares of the robot's size (longest edge of its fine surface's box at
// rest), where contact is on the surfaces; and what the report marks of stretch, which a scene may promise.
struct SeenLimits {
  double overlap = 0.005, self_overlap = 0.005;
  double median_gap = 0.01, worst_gap = 0.02;
  double min_stretch = 0.5, largest_stretch = 2;
};

// What is promised where contact is between cages: how deep one goes into another or a wall, as a share of
// the longest edge of the robot's cage's box at rest.
constexpr double largest_cage_penetration = 0.04;
double largest_cage_penetration_m(const fem::World&);

struct SeenFrame {
  double overlap_m = 0;  // deepest of two surfaces, at least one of which moves
  int overlap_body = -1, overlap_other = -1;
  // Deepest of a surface beyond a wall of the bounds, beyond where it began.
  double wall_overlap_m = 0;
  int wall_overlap_body = -1;
  // Of each pair of bodies, or body and wall (other −1), that press one another.
  struct Gap {
    int body, other;
    double min_m;         // distance of their surfaces, 0 where they overlap
    double at_contact_m;  // where the strongest single force of contact acts
    double force_n;       // the lengths of all forces, summed
  };
  std::vector<Gap> gaps;
  double self_overlap_m = 0;  // deepest of a deformable body's surface in itself, beyond that at rest
  int self_overlap_body = -1;
};

// Bodies press one another in a frame where the forces between them, lengths summed, are more than this share
// of the largest such sum of the whole motion.
constexpr double pressing_share = 1e-3;

// The surfaces of all bodies, ready to be moved to where a state has them; world and bodies must outlive it.
// May be used from several threads at once.
class Surfaces {
 public:
  Surfaces(const fem::World&, const std::vector<PreparedBody>&);

  // With the gaps of all that touch, however lightly. Kept, so that to ask again costs nothing.
  SeenFrame at(const State&) const;
  // Throws InputError where two bodies of this state, which is a start, are in one another: deeper than could
  // be parted, or, for whoever asks for that, than is promised of any frame.
  void require_apart(const State& start, bool as_promised) const;

 private:
  SeenFrame measure(const State&) const;

  const fem::World& world_;
  const std::vector<PreparedBody>& bodies_;
  std::deque<meshing::SurfaceShape> shapes_;
  std::deque<meshing::PlacedSurface> at_rest_;
  mutable std::mutex mutex_;
  mutable std::unordered_map<std::uint64_t, SeenFrame> known_;  // by hash of the state
};

// Leaves the gaps of those that press one another alone, over all frames of a motion.
void keep_what_presses(std::vector<SeenFrame>&);
// One a frame.
std::vector<SeenFrame> measure_seen(const Surfaces&, const std::vector<State>& frames);

}  // namespace limber::detail
