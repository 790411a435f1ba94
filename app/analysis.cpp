#include "app/analysis.h"

#include <fmt/format.h>

#include <cmath>

#include "core/threads.h"
#include "fem/observe.h"
#include "render/plot.h"

namespace limber::app {

MotionFigures measure_motion(const fem::World& world, const plan::Trajectory& path) {
  const std::size_t bodies = world.bodies.size(), frames = path.frames.size();
  MotionFigures figures;
  figures.volume_change.assign(bodies, std::vector<double>(frames, 0));
  std::vector<fem::Penetration> penetration(frames);
  std::vector<int> inverted(frames);
  parallel_for(int(frames), [&](int f) {
    const State& state = path.frames[std::size_t(f)];
    for (std::size_t b = 0; b < bodies; ++b)
      if (world.bodies[b].moving)
        figures.volume_change[b][std::size_t(f)] =
            fem::volume_m3(world, state, int(b)) / world.bodies[b].rest_volume_m3 - 1;
    penetration[std::size_t(f)] = fem::deepest_penetration(world, state);
    inverted[std::size_t(f)] = fem::inverted_tets(world, state);
  });

  for (const std::vector<double>& change : figures.volume_change) {
    double largest = 0;
    for (const double v : change) largest = std::max(largest, std::abs(v));
    figures.largest_volume_change.push_back(largest);
  }
  fem::Penetration deepest;
  for (const fem::Penetration& p : penetration)
    if (p.depth_m > deepest.depth_m) deepest = p;
  const auto name = [&](int body) {
    return body < 0 ? std::string("a wall") : world.bodies[std::size_t(body)].name;
  };
  figures.deepest_penetration_m = deepest.depth_m;
  figures.penetration_between = deepest.body < 0
                                    ? "nothing touches"
                                    : fmt::format("{} and {}", name(deepest.body), name(deepest.other));
  figures.robot_size_m =
      bounding_box(world.bodies[std::size_t(world.robot)].cage.positions).size().maxCoeff();
  for (const int n : inverted) figures.inverted_tets += n;
  for (const Control& control : path.controls)
    figures.largest_force_n = std::max(figures.largest_force_n, double(largest_force(control)));
  return figures;
}

void write_volume_plot(const fs::path& file, const scenes::Scene& scene, const fem::World& world,
                       const MotionFigures& figures, double frames_per_second) {
  std::vector<render::Curve> curves;
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    if (!world.bodies[b].moving) continue;
    render::Curve curve{world.bodies[b].name, scene.bodies[b].color_srgb, {}, {}};
    for (std::size_t f = 0; f < figures.volume_change[b].size(); ++f) {
      curve.x.push_back(double(f) / frames_per_second);
      curve.y.push_back(100 * figures.volume_change[b][f]);
    }
    curves.push_back(std::move(curve));
  }
  const render::PlotLook look{
      .title = scene.name, .x_label = "time (s)", .y_label = "change of volume (%)", .limits = {-10, 10}};
  write_file(file, render::plot_svg(curves, look));
}

}  // namespace limber::app
