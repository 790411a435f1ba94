// The states of a world that follow from it alone: bodies at rest, and where all begins.
//
// A State has positions and velocities of all bodies that move, in float32 and world order (core/state.h),
// and the number of steps that it is old. A kinematic body's nodes are part of it, although they follow
// from that number: positions are those at the state's time, velocities those of the step that begins,
//
//     x = c(t) + R(t) (X − pivot),    v = (x(t + h) − x(t))/h,
//
// so what it pushes feels the speed it really moves with. A body with an initial velocity turns about its
// centre of mass: v = v₀ + ω × (x − c). Held nodes do not move.
#include <algorithm>

#include "fem/detail/make_body.h"
#include "fem/world.h"

namespace limber::fem {

// Nodes of moving bodies come first among all nodes of the world.
State rest_state(const World& world) {
  State state;
  state.positions.assign(world.tables.rest_positions.begin(),
                         world.tables.rest_positions.begin() + 3 * world.moving_nodes);
  state.velocities.assign(std::size_t(3 * world.moving_nodes), 0.f);
  return state;
}

// Places are those of World::start_positions: the rest places, unless bodies overlapped and were parted
// (detail/start.h). The centre of mass is that of the body where it begins.
State start_state(const World& world) {
  State state = rest_state(world);
  state.positions = world.start_positions;
  for (const Body& body : world.bodies) {
    if (!body.pushed()) continue;
    using Rows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
    const Eigen::Map<const Rows> places(&state.positions[std::size_t(3 * body.first_node)], body.node_count(),
                                        3);
    const Vec3 center = detail::center_of(body, places.cast<double>());
    for (int n = 0; n < body.node_count(); ++n) {
      if (body.fixed[std::size_t(n)]) continue;
      const Vec3 from_center = places.row(n).cast<double>().transpose() - center;
      const Vec3f velocity =
          (body.velocity_m_s + body.angular_velocity_rad_s.cross(from_center)).cast<float>();
      std::copy_n(velocity.data(), 3, &state.velocities[std::size_t(3 * (body.first_node + n))]);
    }
  }
  follow_keyframes(world, state);
  return state;
}

// All in double and rounded once, so that the same step gives the same bits whoever asks.
void follow_keyframes(const World& world, State& state) {
  for (const Body& body : world.bodies) {
    if (body.kind != BodyKind::kinematic) continue;
    const Pose now = pose_at(body.track, double(state.step) * world.dt_s),
               next = pose_at(body.track, double(state.step + 1) * world.dt_s);
    for (int n = 0; n < body.node_count(); ++n) {
      const Vec3 from_pivot = body.cage.positions.row(n).transpose() - body.track.pivot_m;
      const Vec3f place = (now.place_m + now.turn * from_pivot).cast<float>();
      const Vec3f velocity =
          ((next.place_m - now.place_m + (next.turn - now.turn) * from_pivot) / world.dt_s).cast<float>();
      const std::size_t k = std::size_t(3 * (body.first_node + n));
      std::copy_n(place.data(), 3, &state.positions[k]),
          std::copy_n(velocity.data(), 3, &state.velocities[k]);
    }
  }
}

}  // namespace limber::fem
