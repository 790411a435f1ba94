// The force of one contact, and the little vector algebra that contact is written in.
#pragma once

#include <cmath>

namespace limber::fem::detail {

// Penalty stiffness β m_eff/h², damping 2 ζ √(k m_eff), and the share of a slip that friction may stop in one
// step.
inline constexpr double contact_beta = 0.4;       // vertices
inline constexpr double contact_edge_beta = 0.2;  // points of edges: a vertex has six of them
inline constexpr double surface_beta = 0.8;       // samples of surfaces, which share what a node can bear
inline constexpr double contact_damping_ratio = 0.3;
inline constexpr double contact_slip_stop = 0.5;

template <class Real>
Real dot(const Real a[3], const Real b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
void cross(const Real a[3], const Real b[3], Real out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

template <class Real>
Real damping_of(Real beta) {
  return Real(2 * contact_damping_ratio) * std::sqrt(beta);
}

// Normal force k d − c ṙ·n, never pulling; friction against the slip, at most μ times that, and at most what
// takes a share of the slip away in one step. `mass_along` a unit vector is what is set against a push.
// False: no force.
template <class Real, class Mass>
bool penalty_force(Real beta, Real depth, const Real normal[3], const Real relative_velocity[3],
                   const Mass& mass_along, Real step, Real friction, Real force[3]) {
  const Real mass = mass_along(normal);
  const Real damping = damping_of(beta);
  const Real speed = dot(relative_velocity, normal);
  const Real push = mass / step * (beta * depth / step - damping * speed);
  if (!(push > 0)) return false;
  Real slip[3];
  for (int c = 0; c < 3; ++c) slip[c] = relative_velocity[c] - speed * normal[c];
  const Real slip_speed = std::sqrt(dot(slip, slip));
  Real slip_way[3];
  for (int c = 0; c < 3; ++c) slip_way[c] = slip_speed > 0 ? slip[c] / slip_speed : Real(0);
  const Real slip_mass = mass_along(slip_way);
  const Real most = friction * push, stop = Real(contact_slip_stop) * slip_mass / step * slip_speed;
  const Real drag = stop > most ? most / slip_speed : Real(contact_slip_stop) * slip_mass / step;
  for (int c = 0; c < 3; ++c) force[c] = push * normal[c] - drag * slip[c];
  return true;
}

// A force that a contact or a wall gave, for those who ask.
template <class Real>
struct Exerted {
  int body, against;  // whose point, on whom; against −1: a wall
  Real place[3], depth, force[3];
};

}  // namespace limber::fem::detail
