// What a motion did to the bodies, measured at every stored frame.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "fem/world.h"
#include "plan/trajectory.h"
#include "scenes/scene.h"

namespace limber::app {

struct MotionFigures {
  std::vector<std::vector<double>> volume_change;  // [body][frame], V/V₀ − 1; 0 for a body that does not move
  std::vector<double> largest_volume_change;       // [body], largest absolute value
  double deepest_penetration_m = 0;
  std::string penetration_between;  // "robot and floor"; "nothing" when nothing touches
  double robot_size_m = 0;          // largest edge of the robot's bounding box at rest
  int inverted_tets = 0;            // over all frames
  double largest_force_n = 0;       // of any control
  double mean_speed_at_end_m_s = 0;
};
MotionFigures measure_motion(const fem::World&, const plan::Trajectory&);

void write_volume_plot(const fs::path&, const scenes::Scene&, const fem::World&, const MotionFigures&,
                       double frames_per_second);

}  // namespace limber::app
