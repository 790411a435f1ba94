// Springs between points of bodies, and between those and points that stand: ligaments, tethers, sutures.
// Method: docs/dynamics.md, "Ligaments".
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/types.h"

namespace limber::fem {

struct World;

struct LigamentSpec {
  struct End {
    int body = -1;                // −1: a point that stands
    Vec3 point_m = Vec3::Zero();  // where bodies start
    double radius_m = 0;          // 0: at that point of the cage; else its nodes within this, by their mass
  };
  std::string name;
  std::array<End, 2> ends;     // of two bodies, or of one and none
  double stiffness_n_m = 0;    // > 0
  double damping_ratio = 0.3;  // 0 … 2, share of the critical damping of what hangs on it
  double rest_length = 1;      // ≥ 0, share of the length at the start
  bool pushes = false;         // as it pulls, too, when it is shorter than at rest; else it is slack
};

// Its end is at p = Σ w x, and the tension T along the unit vector from end to end falls on its nodes as w T,
//
//     T = k (l − l₀) + c l',    c = 2 ζ √(k m),
//
// with m the mass of both ends together; T ≥ 0 unless it pushes, and 0 where l < l₀ then.
struct Ligament {
  struct End {
    int body;                     // −1: none
    std::vector<int> nodes;       // of the world
    std::vector<double> weights;  // sum to 1
    Vec3 point_m;                 // of the world, where there is no body
  };
  std::string name;
  std::array<End, 2> ends;
  double stiffness_n_m, damping_n_s_m, rest_length_m;
  bool pushes;
  double inverse_mass_per_kg;  // along any direction at most: Σ w²/m, of a rigid body 1/M + r²/I
};

}  // namespace limber::fem
