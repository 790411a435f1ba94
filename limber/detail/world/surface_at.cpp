#include "limber/detail/world/surface_at.h"

#include "fem/observe.h"

namespace limber::detail {

Points surface_at(const fem::World& world, const PreparedBody& prepared, const State& state, int body) {
  if (!world.bodies[std::size_t(body)].moving) return prepared.surface.positions;
  Points surface;
  deform(prepared, fem::body_positions(world, state, body), surface);
  return surface;
}

Points surface_at_rest(const fem::Body& body, const PreparedBody& prepared) {
  if (!body.moving) return prepared.surface.positions;
  Points surface;
  deform(prepared, prepared.cage.positions, surface);
  return surface;
}

}  // namespace limber::detail
