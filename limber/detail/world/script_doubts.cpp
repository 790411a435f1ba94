#include "limber/detail/world/script_doubts.h"

#include <fmt/format.h>

namespace limber::detail {

namespace {

// Of the body's size: a cage is a little larger than its surface.
constexpr double seen_beyond_bounds = 0.05;

// Nothing, or why what acts from one time to another never does. `made` is what it was made into.
template <class Spec, class Made>
std::string idle(const std::string& what, const Spec& spec, const Made& made, const fem::World& world,
                 double from_s, double to_s) {
  const std::string acts =
      fmt::format("{}: {} acts from {:g} s to {:g} s", spec.where, what, spec.from_s, spec.to_s);
  if (made.end_step <= made.first_step)
    return fmt::format(
        "{}, and no step begins then, for a step lasts {:.3g} s: it never acts; let it act "
        "for longer",
        acts, world.dt_s);
  if (spec.from_s >= to_s)
    return fmt::format(
        "{}, and the motion ends at {:g} s: it never acts; simulate for longer with "
        "--duration, or let it act sooner",
        acts, to_s);
  if (spec.to_s <= from_s)
    return fmt::format("{}, and the motion begins at {:g} s: it never acts; let it act later", acts, from_s);
  return "";
}

std::string out_of_bounds(const scenes::MotionSpec& motion, const fem::World& world, const Box& bounds) {
  const fem::Body& body = world.bodies[std::size_t(motion.body)];
  const Points& rest = body.cage.positions;
  const double size = bounding_box(rest).size().maxCoeff();
  for (const fem::Keyframe& frame : body.track.keyframes) {
    const fem::Pose pose = fem::pose_at(body.track, frame.at_s);
    const Points there =
        ((rest.rowwise() - body.track.pivot_m.transpose()) * pose.turn.transpose()).rowwise() +
        pose.place_m.transpose();
    const Box box = bounding_box(there);
    const double beyond =
        std::max((bounds.lower - box.lower).maxCoeff(), (box.upper - bounds.upper).maxCoeff());
    if (beyond > seen_beyond_bounds * size)
      return fmt::format(
          "{}: the keyframe at {:g} s takes {} {:.3g} m out of the bounds, which do not "
          "stop what moves by keyframes; move it, or enlarge world.bounds_m",
          motion.where, frame.at_s, body.name, beyond);
  }
  return "";
}

}  // namespace

std::vector<std::string> doubts_of_script(const scenes::Scene& scene, const fem::World& world, double from_s,
                                          double to_s) {
  std::vector<std::string> doubts;
  for (std::size_t i = 0; i < scene.forces.size(); ++i)
    doubts.push_back(idle("a force on " + scene.bodies[std::size_t(scene.forces[i].body)].name,
                          scene.forces[i], world.forces[i], world, from_s, to_s));
  for (std::size_t i = 0; i < scene.pressures.size(); ++i)
    doubts.push_back(idle("a pressure in " + scene.bodies[std::size_t(scene.pressures[i].body)].name,
                          scene.pressures[i], world.pressures[i], world, from_s, to_s));
  for (const scenes::MotionSpec& motion : scene.motions)
    if (scene.walls) doubts.push_back(out_of_bounds(motion, world, scene.bounds_m));
  std::erase(doubts, "");
  return doubts;
}

}  // namespace limber::detail
