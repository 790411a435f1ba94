// What happens by itself, whatever the planner does: [[forces]] on bodies that can be pushed, [[pressures]]
// in soft ones, [[motions]] of rigid obstacles, [[ligaments]] between bodies. Bodies are called by their
// names and kept by their numbers. Meaning: docs/simulation.md, "What happens by itself".
#include "scenes/detail/scene_parts.h"
#include "scenes/detail/typed_reads.h"

namespace limber::scenes {

namespace {

void read_times(const Node& table, const std::string& what, double& from_s, double& to_s) {
  from_s = number(table, "from_s"), to_s = number(table, "to_s");
  if (!(to_s > from_s))
    complain(
        child(table, "to_s"),
        fmt::format("{}.to_s is {}, not after from_s, {}; write the later one there", what, to_s, from_s));
}

}  // namespace

void read_force(const Node& table, Scene& scene) {
  ForceSpec force;
  const std::string what = fmt::format("forces[{}]", scene.forces.size());
  force.where = table.where.text();
  force.body = body_called(child(table, "body"), scene, what + ".body");
  if (const BodySpec& body = scene.bodies[std::size_t(force.body)]; is_rigid_obstacle(body))
    complain(child(table, "body"),
             fmt::format("{}: {} is a rigid obstacle, which no force moves; choose another body, or make it "
                         "soft or free",
                         what, body.name));
  read_times(table, what, force.from_s, force.to_s);
  force.force_n = vector(table, "force_n");
  if (table.find("box_m")) force.box_m = box(table, "box_m");
  scene.forces.push_back(std::move(force));
}

void read_pressure(const Node& table, Scene& scene) {
  PressureSpec pressure;
  const std::string what = fmt::format("pressures[{}]", scene.pressures.size());
  pressure.where = table.where.text();
  pressure.body = body_called(child(table, "body"), scene, what + ".body");
  if (const BodySpec& body = scene.bodies[std::size_t(pressure.body)]; body.kind == Kind::rigid)
    complain(child(table, "body"),
             fmt::format("{}: {} is rigid, which no pressure blows up; choose another body, or make it soft",
                         what, body.name));
  read_times(table, what, pressure.from_s, pressure.to_s);
  pressure.pressure_pa = number(table, "pressure_pa");
  scene.pressures.push_back(std::move(pressure));
}

// Of one body there is one motion, so that it is never asked to be in two places. A keyframe without
// position_m has that of the pose.
void read_motion(const Node& table, Scene& scene) {
  MotionSpec motion;
  const std::string what = fmt::format("motions[{}]", scene.motions.size());
  motion.where = table.where.text();
  const Node& name = child(table, "body");
  motion.body = body_called(name, scene, what + ".body");
  const BodySpec& body = scene.bodies[std::size_t(motion.body)];
  if (!is_rigid_obstacle(body))
    complain(name, fmt::format("{}: {} is no rigid obstacle, and goes where it is pushed; write role = "
                               "\"obstacle\" and kind = \"rigid\" for it, or [[forces]]",
                               what, body.name));
  for (const MotionSpec& other : scene.motions)
    if (other.body == motion.body)
      complain(name, fmt::format("{}: {} has a motion already; put all keyframes into one", what, body.name));
  for (const Node& node : list(table, "keyframes")) {
    MotionSpec::Keyframe frame{number(node, "at_s"), body.pose.position_m,
                               direction(node, "axis", (what + ".keyframes.axis").c_str()),
                               number(node, "angle_deg")};
    if (node.find("position_m")) frame.position_m = vector(node, "position_m");
    if (!motion.keyframes.empty() && !(frame.at_s > motion.keyframes.back().at_s))
      complain(child(node, "at_s"),
               fmt::format("keyframe at {} s does not come after the one at {} s; put them in order",
                           frame.at_s, motion.keyframes.back().at_s));
    motion.keyframes.push_back(frame);
  }
  if (motion.keyframes.empty())
    complain(
        child(table, "keyframes"),
        fmt::format("{}.keyframes is empty; write for example keyframes = [{{ at_s = 1, position_m = [0, "
                    "0, 1] }}]",
                    what));
  scene.motions.push_back(std::move(motion));
}

// That its ends are where the bodies are, fem sees (docs/dynamics.md, "Ligaments").
void read_ligament(const Node& table, Scene& scene) {
  LigamentSpec ligament;
  ligament.where = table.where.text();
  ligament.name = text(table, "name");
  const std::string what = fmt::format("ligaments.{}", ligament.name);
  for (const LigamentSpec& other : scene.ligaments)
    if (other.name == ligament.name)
      complain(child(table, "name"),
               fmt::format("two ligaments are called \"{}\"; give one another name", ligament.name));
  ligament.from = body_called(child(table, "from"), scene, what + ".from");
  if (const Node* to = table.find("to")) ligament.to = body_called(*to, scene, what + ".to");
  if (ligament.from == ligament.to)
    complain(child(table, "to"),
             fmt::format("{} goes from {} to itself; name another body, or leave `to` out: then "
                         "that end stands in the world",
                         what, scene.bodies[std::size_t(ligament.from)].name));
  ligament.from_m = vector(table, "from_m"), ligament.to_m = vector(table, "to_m");
  ligament.radius_m = number(table, "radius_m");
  ligament.stiffness_n_m = number(table, "stiffness_n_m");
  ligament.damping_ratio = number(table, "damping_ratio");
  ligament.rest_length = number(table, "rest_length");
  ligament.pushes = flag(table, "pushes");
  ligament.diameter_m = maybe_number(table, "diameter_m");
  ligament.color_srgb = as_color(text(table, "color"));
  scene.ligaments.push_back(std::move(ligament));
}

}  // namespace limber::scenes
