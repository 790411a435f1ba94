// What build_world refuses. A wrong input ends here, with a message that says what is wrong, where, and
// what to try, and never in a rollout. So what comes after may rely on it:
//
// - every cage is valid, also in float32, and each node belongs to a tet and so has a mass;
// - materials are in the range where the elements stand for them: springs alone have ν = ¼ and their volume
//   term can only add to that; near ν = ½ the stiffness of the volume, and so the step, would know no
//   bound;
// - keyframes ascend, and fixed nodes exist;
// - bodies start within the bounds. Cages do not overlap at the start; fine surfaces may, and are parted
//   (detail/start.h).
//
// How deep two cages overlap is measured slowly and plainly, apart from the contact code
// (detail/overlap.h). Ranges of parameters and their reasons: docs/dynamics.md, "Material", and
// docs/scene.md.
#include "fem/detail/check_world.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fem/detail/overlap.h"
#include "fem/detail/tet_edges.h"

namespace limber::fem::detail {
namespace {

// Throws unless lower ≤ value ≤ upper, and so also where the value is not a number. `text` is the range in
// words.
void require_range(const BodySpec& spec, const std::string& name, double value, double lower, double upper,
                   const char* text) {
  if (!(value >= lower && value <= upper))
    throw InputError(fmt::format("body {}: {} is {}; it must be {}", spec.name, name, value, text));
}

}  // namespace

// A tet may have a modulus and a density of its own; all of them must be in range. The last check is on
// float32, in which the steppers compute: it resolves 6e-8 of a coordinate, and forces need edges to a
// thousandth. A scene far from the origin, or a cage with a very short edge, would not get that.
void check(const BodySpec& spec) {
  validate(spec.cage, fmt::format("body {}: cage", spec.name));
  const Material& m = spec.material;
  const auto require_modulus = [&](const std::string& name, double value) {
    require_range(spec, name, value, 1e-3, 1e13, "from 0.001 to 1e13");
  };
  const auto require_density = [&](const std::string& name, double value) {
    require_range(spec, name, value, 1e-9, 1e6, "from 1e-9 to 1e6");
  };
  const std::size_t tets = std::size_t(spec.cage.tets.rows());
  const auto &moduli = spec.youngs_modulus_from_tet_pa, &densities = spec.density_from_tet_kg_m3;
  LIMBER_CHECK(moduli.empty() || moduli.size() == tets, moduli.size(), tets);
  LIMBER_CHECK(densities.empty() || densities.size() == tets, densities.size(), tets);
  for (std::size_t t = 0; t < moduli.size(); ++t)
    require_modulus(fmt::format("youngs_modulus_pa of tet {}", t), moduli[t]);
  for (std::size_t t = 0; t < densities.size(); ++t)
    require_density(fmt::format("density_kg_m3 of tet {}", t), densities[t]);
  require_modulus("youngs_modulus_pa", m.youngs_modulus_pa);
  if (m.model == MaterialModel::springs)
    require_range(spec, "poisson_ratio", m.poisson_ratio, 0.25, 0.495, "from 0.25 to 0.495 for springs");
  else
    require_range(spec, "poisson_ratio", m.poisson_ratio, 0, 0.495, "from 0 to 0.495");
  require_density("density_kg_m3", m.density_kg_m3);
  require_range(spec, "damping_ratio", m.damping_ratio, 0, 1, "from 0 to 1");
  require_range(spec, "mass_damping_per_s", m.mass_damping_per_s, 0, 1000, "from 0 to 1000");
  require_range(spec, "fascia_hz", m.fascia_hz, 0, 30, "from 0 to 30");
  require_range(spec, "fascia_damping_ratio", m.fascia_damping_ratio, 0, 2, "from 0 to 2");
  require_range(spec, "friction", m.friction, 0, 2, "from 0 to 2");
  if (spec.gravity_m_s2 && !spec.gravity_m_s2->allFinite())
    throw InputError(fmt::format("body {}: its gravity_m_s2 is not finite", spec.name));
  const int nodes = int(spec.cage.positions.rows());
  for (int n : spec.fixed_nodes)
    if (n < 0 || n >= nodes)
      throw InputError(
          fmt::format("body {}: fixed node {} does not exist; nodes are 0 to {}", spec.name, n, nodes - 1));
  for (std::size_t k = 0; k < spec.track.keyframes.size(); ++k)
    if (!(spec.track.keyframes[k].at_s > (k == 0 ? 0 : spec.track.keyframes[k - 1].at_s)))
      throw InputError(fmt::format("body {}: keyframe {} is at {} s; keyframes begin after 0 and ascend",
                                   spec.name, k, spec.track.keyframes[k].at_s));
  if (!spec.velocity_m_s.allFinite() || !spec.angular_velocity_rad_s.allFinite())
    throw InputError(fmt::format("body {}: its velocity at the start is not finite", spec.name));
  if (spec.kind == BodyKind::rigid && !spec.fixed_nodes.empty())
    throw InputError(fmt::format(
        "body {}: node {} of a rigid body is fixed; fix none, or make the body immovable or deformable",
        spec.name, spec.fixed_nodes.front()));
  std::vector<bool> used(std::size_t(nodes), false);
  for (int t = 0; t < spec.cage.tets.rows(); ++t)
    for (int i = 0; i < 4; ++i) used[spec.cage.tets(t, i)] = true;
  for (int n = 0; n < nodes; ++n)
    if (!used[n])
      throw InputError(
          fmt::format("body {}: node {} belongs to no tet and so has no mass; remove it", spec.name, n));
  const double far = spec.cage.positions.cwiseAbs().maxCoeff();
  double shortest = 1e300;
  for (int t = 0; t < spec.cage.tets.rows(); ++t)
    for (const auto& [i, j] : tet_edges)
      shortest = std::min(shortest, (spec.cage.positions.row(spec.cage.tets(t, i)) -
                                     spec.cage.positions.row(spec.cage.tets(t, j)))
                                        .norm());
  if (far * 6e-8 > 1e-3 * shortest)
    throw InputError(fmt::format(
        "body {}: its shortest edge, {:.3g} m, is too short for coordinates of {:.3g} m in float32; "
        "move the scene to the origin or mesh coarser",
        spec.name, shortest, far));
}

// Bounds, gravity, speeds and the step: all must be finite and have a meaning.
void check(const WorldSpec& spec) {
  if (spec.bodies.empty()) throw InputError("the world has no body; add at least the robot");
  if (spec.robot < 0 || spec.robot >= int(spec.bodies.size()))
    throw InputError(
        fmt::format("robot is body {}, but there are {} bodies", spec.robot, spec.bodies.size()));
  const auto& box = spec.bounds_m;
  if (!box.lower.allFinite() || !box.upper.allFinite() || !(box.size().array() > 0).all())
    throw InputError("bounds_m must be two finite corners, the first below the second on every axis");
  if (!spec.gravity_m_s2.allFinite()) throw InputError("gravity_m_s2 is not finite");
  if (!(spec.rest_speed_m_s >= 0 && std::isfinite(spec.rest_speed_m_s)))
    throw InputError(
        fmt::format("rest_speed_m_s is {}; it must be 0 (bodies never fall asleep) or a positive speed",
                    spec.rest_speed_m_s));
  if (!(spec.max_dt_s >= 0 && std::isfinite(spec.max_dt_s)))
    throw InputError(
        fmt::format("max_dt_s is {}; it must be 0 (automatic) or a positive time", spec.max_dt_s));
}

// Rounding may put a node a little outside, so a millionth of the bounds' diagonal is let pass; as much of
// cages that touch. Two bodies that nothing can push may overlap: nothing acts between them.
void check_places(const World& world) {
  const double size = world.bounds_m.diagonal();
  for (const Body& body : world.bodies)
    for (int n = 0; n < body.node_count() && world.walls && body.pushed(); ++n)
      for (int c = 0; c < 3; ++c) {
        const double x = body.cage.positions(n, c);
        if (x < world.bounds_m.lower[c] - 1e-6 * size || x > world.bounds_m.upper[c] + 1e-6 * size)
          throw InputError(fmt::format(
              "body {}: node {} at {} = {:.6g} m is outside the bounds {:.6g} to {:.6g}; move the "
              "body or widen bounds_m",
              body.name, n, "xyz"[c], x, world.bounds_m.lower[c], world.bounds_m.upper[c]));
      }
  if (world.touches_on_surfaces()) return;
  std::vector<Box> boxes;
  for (const Body& body : world.bodies) boxes.push_back(bounding_box(body.cage.positions));
  for (std::size_t a = 0; a < world.bodies.size(); ++a)
    for (std::size_t b = a + 1; b < world.bodies.size(); ++b) {
      const Body &one = world.bodies[a], &two = world.bodies[b];
      if ((!one.pushed() && !two.pushed()) || !can_overlap(boxes[a], boxes[b])) continue;
      const auto overlap = deepest_overlap({one.cage.positions, one.cage.tets, one.surface},
                                           {two.cage.positions, two.cage.tets, two.surface});
      if (overlap.depth_m > 1e-6 * size)
        throw InputError(fmt::format(
            "bodies {} and {} overlap at the start, {:.3g} m deep at ({:.4g}, {:.4g}, {:.4g}); move "
            "them apart",
            one.name, two.name, overlap.depth_m, overlap.place.x(), overlap.place.y(), overlap.place.z()));
    }
}

}  // namespace limber::fem::detail
