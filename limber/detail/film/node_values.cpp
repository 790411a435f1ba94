#include "limber/detail/film/node_values.h"

#include <algorithm>

#include "core/error.h"
#include "fem/observe.h"

namespace limber::detail {

namespace {

// The mean of the adjacent tets' values, by their rest volumes.
void spread_from_tets(const fem::Body& body, const std::vector<double>& of_tet, double* of_node) {
  std::vector<double> weight(std::size_t(body.node_count()), 0);
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const auto corner = [&](int i) {
      return Vec3(body.cage.positions.row(body.cage.tets(t, i)).transpose());
    };
    const double volume = signed_volume(corner(0), corner(1), corner(2), corner(3));
    for (int i = 0; i < 4; ++i) {
      weight[std::size_t(body.cage.tets(t, i))] += volume;
      of_node[body.cage.tets(t, i)] += volume * of_tet[std::size_t(t)];
    }
  }
  for (int n = 0; n < body.node_count(); ++n) of_node[n] /= weight[std::size_t(n)];
}

void mark_contacts(const fem::World& world, const State& state, std::vector<double>& values) {
  std::vector<Points> positions;
  for (int b = 0; b < int(world.bodies.size()); ++b)
    positions.push_back(fem::body_positions(world, state, b));
  const auto mark = [&](int b, const fem::ContactForce& contact) {
    if (b < 0 || !world.bodies[std::size_t(b)].moving) return;
    Eigen::Index nearest = 0;
    (positions[std::size_t(b)].rowwise() - contact.place_m.transpose())
        .rowwise()
        .squaredNorm()
        .minCoeff(&nearest);
    double& value = values[std::size_t(world.bodies[std::size_t(b)].first_node + nearest)];
    value = std::max(value, contact.depth_m);
  };
  for (const fem::ContactForce& contact : fem::contact_forces(world, state))
    mark(contact.body, contact), mark(contact.other, contact);
}

}  // namespace

std::vector<double> node_values(const fem::World& world, const State& state, scenes::ColorBy by) {
  LIMBER_CHECK(by != scenes::ColorBy::body, int(by));
  std::vector<double> values(std::size_t(world.nodes), 0);
  if (by == scenes::ColorBy::penetration) {
    mark_contacts(world, state, values);
    return values;
  }
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    const fem::Body& body = world.bodies[std::size_t(b)];
    if (!body.moving) continue;
    double* const own = &values[std::size_t(body.first_node)];
    if (by == scenes::ColorBy::speed)
      for (int n = 0; n < body.node_count(); ++n)
        own[n] = Vec3f::Map(&state.velocities[3 * std::size_t(body.first_node + n)]).cast<double>().norm();
    else
      spread_from_tets(body,
                       by == scenes::ColorBy::strain ? fem::strains(world, state, b).von_mises
                                                     : fem::volume_changes(world, state, b),
                       own);
  }
  return values;
}

const char* caption_of(scenes::ColorBy by) {
  switch (by) {
    case scenes::ColorBy::strain:
      return "von Mises strain";
    case scenes::ColorBy::volume:
      return "change of volume";
    case scenes::ColorBy::penetration:
      return "depth of contact, m";
    case scenes::ColorBy::speed:
      return "speed, m/s";
    case scenes::ColorBy::body:
      break;
  }
  return "";
}

}  // namespace limber::detail
