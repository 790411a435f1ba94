// How a strand lies in the holes of rings, up to deformation: the class of its way among them. Signatures of
// homotopy that augment a search graph: Bhattacharya, Likhachev and Kumar, Topological constraints in
// search-based robot path planning, Autonomous Robots 33, 2012. Method: docs/planning.md.
#pragma once

#include <span>
#include <vector>

#include "core/mesh.h"

namespace limber::plan {

// A flat disk that is spanned by a ring.
struct Hole {
  Vec3 middle_m = Vec3::Zero(), normal = Vec3::UnitZ();
  double radius_m = 0;
  int pieces = 0;  // of the strand that the goal asks for in it
};

// A way through holes, as a word: +(h + 1) where it goes through hole h along its normal, −(h + 1) against,
// in their order. Reduced: nothing is followed by its inverse, for a strand that goes back where it came from
// is drawn out of the hole. Of rings that are not linked, two ways between the same places can be deformed
// into one another, and pass through no ring, exactly where their words are the same.
using Windings = std::vector<int>;

// Adds what the segment passes through.
void wind(Windings&, std::span<const Hole>, const Vec3& from, const Vec3& to);

int pieces_in(const Windings&, int hole);
// As many pieces in each hole as the goal asks for.
bool hangs_as_asked(const Windings&, std::span<const Hole>);

}  // namespace limber::plan
