// What a motion did to the bodies, measured at every stored frame.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/file.h"
#include "core/json.h"
#include "fem/observe.h"
#include "fem/world.h"
#include "limber/detail/world/seen.h"
#include "plan/trajectory.h"
#include "scenes/scene.h"

namespace limber::detail {

struct BodyFigures {          // of one frame; all 0 for a body that does not move, but for contact_force_n
  double volume_change = 0;   // V/V₀ − 1
  double largest_strain = 0;  // of its tets, Green's, absolute and principal
  double min_stretch = 1, largest_stretch = 1;  // of its tets: singular values of the deformation gradient
  double elastic_energy_j = 0, kinetic_energy_j = 0;
  double contact_force_n = 0;  // of the sum of all contacts and walls on it
  double contact_load_n = 0;   // the sum of their magnitudes (fem::contact_loads_n)
  double away_m = 0;           // of its centre of mass from where the scene has it
};
struct FrameFigures {
  double time_s = 0;
  std::vector<BodyFigures> bodies;
  std::vector<double> ligament_tension_n;              // in their order
  std::map<std::pair<int, int>, double> pair_force_n;  // of two bodies that touch, the lower first; walls: −1
  double contact_force_n = 0;   // the largest sum over one pair of bodies, or a body and the walls
  std::string contact_between;  // "robot and floor", "robot and a wall"; "nothing touches"
  fem::Penetration penetration;
  std::string penetration_between;
  int inverted_tets = 0;
  SeenFrame seen;
};
struct GapFigures {  // over all frames and pairs that press one another
  int count = 0;
  double median_m = 0, worst_m = 0;
  std::string worst_between = "nothing presses";
};
struct MotionFigures {
  std::vector<FrameFigures> frames;
  std::vector<double> largest_volume_change;  // [body], largest absolute value
  double largest_strain = 0;
  std::string largest_strain_of = "no body";
  double largest_contact_force_n = 0;
  std::string contact_between = "nothing touches";
  double deepest_penetration_m = 0;
  std::string penetration_between = "nothing touches";
  double robot_size_m = 0;     // largest edge of the robot's bounding box at rest
  int inverted_tets = 0;       // over all frames
  double largest_force_n = 0;  // of any control
  double mean_speed_at_end_m_s = 0;
  double min_stretch = 1, largest_stretch = 1;
  std::string min_stretch_of = "no body", largest_stretch_of = "no body";

  // Of what is seen.
  double robot_surface_size_m = 0;  // largest edge of the bounding box of its fine surface at rest
  double deepest_overlap_m = 0, deepest_self_overlap_m = 0, deepest_wall_overlap_m = 0;
  std::string overlap_between = "nothing overlaps", self_overlap_of = "no body", wall_overlap_of = "no body";
  GapFigures gap, gap_at_contact, gap_to_wall;
};
// Without surfaces: all but what is seen.
MotionFigures measure_motion(const fem::World&, const plan::Trajectory&);
// With those that a search has looked at, nullptr for none.
MotionFigures measure_motion(const fem::World&, const std::vector<PreparedBody>&, const plan::Trajectory&,
                             const Surfaces* = nullptr);
// Those that touch in some frame, ascending, and as they are called: "robot|floor", "robot|walls".
struct TouchingPair {
  int body, other;
  std::string name;
};
double pair_force_n(const FrameFigures&, int body, int other);  // 0 where they do not touch
std::vector<TouchingPair> touching_pairs(const fem::World&, const MotionFigures&);
Json json_of(const MotionFigures&);  // as plan, verify and bench print them

// A row a frame, for each body its figures, then what is of all, then the forces of pairs: docs/files.md.
void write_observables(const fs::path& csv, const fem::World&, const MotionFigures&);

// The bytes of volume.svg and volume.png.
struct VolumePlot {
  std::string svg, png;
};
VolumePlot volume_plot(const scenes::Scene&, const fem::World&, const MotionFigures&,
                       double frames_per_second);

}  // namespace limber::detail
