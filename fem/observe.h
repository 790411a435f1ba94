// What a State shows: pure functions of World and State, in double.
#pragma once

#include "fem/world.h"

namespace limber::fem {

// (N × 3) of one body, metres: the rows of its cage. A static body has its rest positions.
Points body_positions(const World&, const State&, int body);
double time_s(const World&, const State&);

double volume_m3(const World&, const State&, int body);  // sum of signed tet volumes
// Largest |V − V0|/V0 of all moving bodies.
double largest_volume_change(const World&, const State&);
Vec3 center_of_mass_m(const World&, const State&, int body);
double mean_speed_m_s(const World&, const State&,
                      int body);  // mass-weighted mean of |v|; 0 for a static body

double elastic_energy_j(const World&, const State&);
double kinetic_energy_j(const World&, const State&);

int inverted_tets(const World&, const State&);  // of all moving bodies: volume ≤ 0

// The deepest point of one body in another, or beyond a wall of the bounds: distance to the nearest surface,
// over vertices and surface edges, measured apart from the contact code. Pairs of static bodies do not count.
struct Penetration {
  double depth_m = 0;         // 0: nothing touches
  int body = -1, other = -1;  // other −1: a wall
  Vec3 place_m = Vec3::Zero();
};
Penetration deepest_penetration(const World&, const State&);

}  // namespace limber::fem
