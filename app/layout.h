// Where organs go whose cages overlap: cages are coarser and larger than what they enclose, and in a body
// organs touch.
#pragma once

#include <optional>
#include <vector>

#include "core/mesh.h"

namespace limber::app {

struct LaidCage {
  TetMesh cage;
  bool held = false;  // stays where it is
};

// The way that each cage goes until no two overlap, but for two that are held; nothing when one would go
// farther than `reach_m`. First each two that overlap part by half the shortest way each, round after round;
// then each goes back as far as there is room. Same input, same result.
std::optional<std::vector<Vec3>> ways_apart(std::vector<LaidCage>, double reach_m);

}  // namespace limber::app
