#include "limber/detail/world/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/progress.h"
#include "core/threads.h"
#include "render/plot.h"
#include "render/png_file.h"

namespace limber::detail {

namespace {

std::string between(const fem::World& world, int body, int other, const char* otherwise = "nothing touches") {
  if (body < 0) return otherwise;
  return fmt::format("{} and {}", world.bodies[std::size_t(body)].name,
                     other < 0 ? std::string("a wall") : world.bodies[std::size_t(other)].name);
}

// Of the centre of mass.
Vec3 place_in_scene(const fem::Body& body) {
  const Eigen::Map<const Eigen::VectorXd> masses(body.node_mass_kg.data(), body.node_count());
  return body.cage.positions.transpose() * masses / masses.sum();
}

FrameFigures measure_frame(const fem::World& world, const State& state) {
  FrameFigures frame;
  frame.time_s = fem::time_s(world, state);
  std::vector<Vec3> contact(world.bodies.size(), Vec3::Zero());
  frame.contact_between = between(world, -1, -1);
  const std::vector<fem::ContactForce> forces = fem::contact_forces(world, state);
  const std::vector<double> loads = fem::contact_loads_n(world, forces);
  for (const fem::PairForce& pair : fem::pair_forces(forces)) {
    contact[std::size_t(pair.body)] += pair.force_n;
    if (pair.other >= 0) contact[std::size_t(pair.other)] -= pair.force_n;
    frame.pair_force_n[{pair.body, pair.other}] = pair.force_n.norm();
    if (pair.force_n.norm() <= frame.contact_force_n) continue;
    frame.contact_force_n = pair.force_n.norm();
    frame.contact_between = between(world, pair.body, pair.other);
  }
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    BodyFigures& body = frame.bodies.emplace_back();
    body.contact_force_n = contact[std::size_t(b)].norm();
    body.contact_load_n = loads[std::size_t(b)];
    if (!world.bodies[std::size_t(b)].moving) continue;
    const fem::Strains strains = fem::strains(world, state, b);
    body.volume_change = fem::volume_m3(world, state, b) / world.bodies[std::size_t(b)].rest_volume_m3 - 1;
    body.largest_strain = *std::max_element(strains.largest.begin(), strains.largest.end());
    body.min_stretch = *std::min_element(strains.shortest.begin(), strains.shortest.end());
    body.largest_stretch = *std::max_element(strains.longest.begin(), strains.longest.end());
    body.elastic_energy_j = fem::elastic_energy_j(world, state, b);
    body.kinetic_energy_j = fem::kinetic_energy_j(world, state, b);
    body.away_m =
        (fem::center_of_mass_m(world, state, b) - place_in_scene(world.bodies[std::size_t(b)])).norm();
  }
  for (const fem::LigamentPull& pull : fem::ligament_pulls(world, state))
    frame.ligament_tension_n.push_back(pull.tension_n);
  frame.penetration = fem::deepest_penetration(world, state);
  frame.penetration_between = between(world, frame.penetration.body, frame.penetration.other);
  frame.inverted_tets = fem::inverted_tets(world, state);
  return frame;
}

}  // namespace

MotionFigures measure_motion(const fem::World& world, const plan::Trajectory& path) {
  MotionFigures figures;
  figures.frames.resize(path.frames.size());
  parallel_for(int(path.frames.size()), [&](int f) {
    if (nothing_to_keep()) throw_if_stopped();
    figures.frames[std::size_t(f)] = measure_frame(world, path.frames[std::size_t(f)]);
  });

  figures.largest_volume_change.assign(world.bodies.size(), 0);
  for (const FrameFigures& frame : figures.frames) {
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
      const BodyFigures& body = frame.bodies[b];
      figures.largest_volume_change[b] =
          std::max(figures.largest_volume_change[b], std::abs(body.volume_change));
      if (body.largest_strain > figures.largest_strain)
        figures.largest_strain = body.largest_strain, figures.largest_strain_of = world.bodies[b].name;
      if (body.min_stretch < figures.min_stretch)
        figures.min_stretch = body.min_stretch, figures.min_stretch_of = world.bodies[b].name;
      if (body.largest_stretch > figures.largest_stretch)
        figures.largest_stretch = body.largest_stretch, figures.largest_stretch_of = world.bodies[b].name;
    }
    if (frame.contact_force_n > figures.largest_contact_force_n)
      figures.largest_contact_force_n = frame.contact_force_n,
      figures.contact_between = frame.contact_between;
    if (frame.penetration.depth_m > figures.deepest_penetration_m)
      figures.deepest_penetration_m = frame.penetration.depth_m,
      figures.penetration_between = frame.penetration_between;
    figures.inverted_tets += frame.inverted_tets;
  }
  figures.robot_size_m =
      bounding_box(world.bodies[std::size_t(world.robot)].cage.positions).size().maxCoeff();
  for (const Control& control : path.controls)
    figures.largest_force_n = std::max(figures.largest_force_n, double(largest_force(control)));
  return figures;
}

namespace {

GapFigures gaps_of(const fem::World& world, const std::vector<SeenFrame>& frames, bool to_walls,
                   double SeenFrame::Gap::*distance) {
  GapFigures figures;
  std::vector<double> all;
  for (const SeenFrame& frame : frames)
    for (const SeenFrame::Gap& gap : frame.gaps) {
      if ((gap.other < 0) != to_walls) continue;
      if (all.empty() || gap.*distance > figures.worst_m)
        figures.worst_m = gap.*distance, figures.worst_between = between(world, gap.body, gap.other);
      all.push_back(gap.*distance);
    }
  if (all.empty()) return figures;
  figures.count = int(all.size());
  const auto middle = all.begin() + std::ptrdiff_t(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  figures.median_m = *middle;
  return figures;
}

// The widest gap of the frame's pairs, or of its bodies and walls; null where nothing presses.
const SeenFrame::Gap* widest(const SeenFrame& frame, bool to_walls, double SeenFrame::Gap::*distance) {
  const SeenFrame::Gap* found = nullptr;
  for (const SeenFrame::Gap& gap : frame.gaps)
    if ((gap.other < 0) == to_walls && (!found || gap.*distance > found->*distance)) found = &gap;
  return found;
}

Json json_of(const GapFigures& gap, double size) {
  return {{"pairs_and_frames", gap.count},
          {"median_m", gap.median_m},
          {"median_of_robot_size", gap.median_m / size},
          {"worst_m", gap.worst_m},
          {"worst_of_robot_size", gap.worst_m / size},
          {"worst_between", gap.worst_between}};
}

}  // namespace

MotionFigures measure_motion(const fem::World& world, const std::vector<PreparedBody>& bodies,
                             const plan::Trajectory& path, const Surfaces* known) {
  MotionFigures figures = measure_motion(world, path);
  std::vector<SeenFrame> seen =
      known ? measure_seen(*known, path.frames) : measure_seen(Surfaces(world, bodies), path.frames);
  for (std::size_t f = 0; f < seen.size(); ++f) {
    const SeenFrame& frame = seen[f];
    if (frame.overlap_m > figures.deepest_overlap_m) {
      figures.deepest_overlap_m = frame.overlap_m;
      figures.overlap_between = between(world, frame.overlap_body, frame.overlap_other);
    }
    if (frame.wall_overlap_m > figures.deepest_wall_overlap_m) {
      figures.deepest_wall_overlap_m = frame.wall_overlap_m;
      figures.wall_overlap_of = world.bodies[std::size_t(frame.wall_overlap_body)].name;
    }
    if (frame.self_overlap_m > figures.deepest_self_overlap_m) {
      figures.deepest_self_overlap_m = frame.self_overlap_m;
      figures.self_overlap_of = world.bodies[std::size_t(frame.self_overlap_body)].name;
    }
  }
  figures.gap = gaps_of(world, seen, false, &SeenFrame::Gap::min_m);
  figures.gap_at_contact = gaps_of(world, seen, false, &SeenFrame::Gap::at_contact_m);
  figures.gap_to_wall = gaps_of(world, seen, true, &SeenFrame::Gap::at_contact_m);
  for (std::size_t f = 0; f < seen.size(); ++f) figures.frames[f].seen = std::move(seen[f]);
  figures.robot_surface_size_m =
      bounding_box(bodies[std::size_t(world.robot)].surface.positions).size().maxCoeff();
  return figures;
}

Json json_of(const MotionFigures& figures) {
  const double size = figures.robot_surface_size_m;
  return {{"largest_strain", figures.largest_strain},
          {"largest_strain_of", figures.largest_strain_of},
          {"largest_contact_force_n", figures.largest_contact_force_n},
          {"contact_between", figures.contact_between},
          {"deepest_penetration_m", figures.deepest_penetration_m},
          {"deepest_penetration_of_robot_size", figures.deepest_penetration_m / figures.robot_size_m},
          {"penetration_between", figures.penetration_between},
          {"inverted_tets", figures.inverted_tets},
          {"least_stretch", figures.min_stretch},
          {"least_stretch_of", figures.min_stretch_of},
          {"largest_stretch", figures.largest_stretch},
          {"largest_stretch_of", figures.largest_stretch_of},
          {"robot_surface_size_m", size},
          {"deepest_overlap_m", figures.deepest_overlap_m},
          {"deepest_overlap_of_robot_size", figures.deepest_overlap_m / size},
          {"overlap_between", figures.overlap_between},
          {"deepest_self_overlap_m", figures.deepest_self_overlap_m},
          {"deepest_self_overlap_of_robot_size", figures.deepest_self_overlap_m / size},
          {"self_overlap_of", figures.self_overlap_of},
          {"gap", json_of(figures.gap, size)},
          {"gap_at_contact", json_of(figures.gap_at_contact, size)},
          {"gap_to_wall", json_of(figures.gap_to_wall, size)},
          {"largest_force_n", figures.largest_force_n}};
}

double pair_force_n(const FrameFigures& frame, int body, int other) {
  const auto found = frame.pair_force_n.find({body, other});
  return found == frame.pair_force_n.end() ? 0 : found->second;
}

std::vector<TouchingPair> touching_pairs(const fem::World& world, const MotionFigures& figures) {
  std::set<std::pair<int, int>> found;
  for (const FrameFigures& frame : figures.frames)
    for (const auto& [pair, force_n] : frame.pair_force_n)
      if (force_n > 0) found.insert(pair);
  std::vector<TouchingPair> pairs;
  for (const auto& [body, other] : found)
    pairs.push_back({body, other,
                     fmt::format("{}|{}", world.bodies[std::size_t(body)].name,
                                 other < 0 ? std::string("walls") : world.bodies[std::size_t(other)].name)});
  return pairs;
}

void write_observables(const fs::path& csv, const fem::World& world, const MotionFigures& figures) {
  std::string text = "time_s";
  for (const fem::Body& body : world.bodies)
    for (const char* what :
         {"volume_change", "largest_strain", "least_stretch", "largest_stretch", "elastic_energy_j",
          "kinetic_energy_j", "contact_force_n", "contact_load_n", "away_m"})
      text += fmt::format(",{}.{}", body.name, what);
  text +=
      ",contact_force_n,contact_between,penetration_m,penetration_between,inverted_tets,overlap_m,overlap_"
      "between,"
      "self_overlap_m,self_overlap_of,pressing,gap_m,gap_at_contact_m,gap_between,pressing_walls,gap_to_wall_"
      "m";
  const std::vector<TouchingPair> pairs = touching_pairs(world, figures);
  for (const TouchingPair& pair : pairs) text += fmt::format(",{}.contact_force_n", pair.name);
  for (const fem::Ligament& ligament : world.ligaments) text += fmt::format(",{}.tension_n", ligament.name);
  text += "\n";
  for (const FrameFigures& frame : figures.frames) {
    text += fmt::format("{}", frame.time_s);
    for (const BodyFigures& b : frame.bodies)
      text += fmt::format(",{},{},{},{},{},{},{},{},{}", b.volume_change, b.largest_strain, b.min_stretch,
                          b.largest_stretch, b.elastic_energy_j, b.kinetic_energy_j, b.contact_force_n,
                          b.contact_load_n, b.away_m);
    text += fmt::format(",{},{},{},{},{}", frame.contact_force_n, frame.contact_between,
                        frame.penetration.depth_m, frame.penetration_between, frame.inverted_tets);
    const SeenFrame& seen = frame.seen;
    text += fmt::format(
        ",{},{},{},{}", seen.overlap_m,
        between(world, seen.overlap_body, seen.overlap_other, "nothing overlaps"), seen.self_overlap_m,
        seen.self_overlap_body < 0 ? "no body"
                                   : world.bodies[std::size_t(seen.self_overlap_body)].name.c_str());
    const auto pressing = [&](bool walls) {
      return std::count_if(seen.gaps.begin(), seen.gaps.end(),
                           [&](const SeenFrame::Gap& gap) { return (gap.other < 0) == walls; });
    };
    const SeenFrame::Gap* const pair = widest(seen, false, &SeenFrame::Gap::at_contact_m);
    const SeenFrame::Gap* const least = widest(seen, false, &SeenFrame::Gap::min_m);
    const SeenFrame::Gap* const wall = widest(seen, true, &SeenFrame::Gap::at_contact_m);
    text += fmt::format(",{},{},{},{},{},{}", pressing(false), least ? least->min_m : 0.0,
                        pair ? pair->at_contact_m : 0.0,
                        pair ? between(world, pair->body, pair->other) : "nothing presses", pressing(true),
                        wall ? wall->at_contact_m : 0.0);
    for (const auto& [body, other, name] : pairs)
      text += fmt::format(",{}", pair_force_n(frame, body, other));
    for (const double tension_n : frame.ligament_tension_n) text += fmt::format(",{}", tension_n);
    text += "\n";
  }
  write_file(csv, text);
}

VolumePlot volume_plot(const scenes::Scene& scene, const fem::World& world, const MotionFigures& figures,
                       double frames_per_second) {
  std::vector<render::Curve> curves;
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    if (!world.bodies[b].moving) continue;
    render::Curve curve{world.bodies[b].name, scene.bodies[b].color_srgb, {}, {}};
    for (std::size_t f = 0; f < figures.frames.size(); ++f) {
      curve.x.push_back(double(f) / frames_per_second);
      curve.y.push_back(100 * figures.frames[f].bodies[b].volume_change);
    }
    curves.push_back(std::move(curve));
  }
  const render::PlotLook look{
      .title = scene.name, .x_label = "time (s)", .y_label = "change of volume (%)", .limits = {-10, 10}};
  return {render::plot_svg(curves, look), render::png_bytes(render::plot_image(curves, look))};
}

}  // namespace limber::detail
