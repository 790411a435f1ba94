// The force of one contact, and the little vector algebra that contact is written in.
#pragma once

#include <cmath>

namespace limber::fem::detail {

// Penalty stiffness β m_eff/h², damping 2 ζ √(k m_eff).
inline constexpr double contact_beta = 0.4;       // vertices
inline constexpr double contact_edge_beta = 0.2;  // points of edges: a vertex has six of them
inline constexpr double surface_beta = 0.8;       // samples of surfaces, which share what a node can bear
inline constexpr double contact_damping_ratio = 0.3;

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

// Normal force k d − c ṙ·n of a contact so deep, opening at that speed, against which so much mass is set;
// ≤ 0: it would pull, and there is none.
template <class Real>
Real penalty_push(Real beta, Real depth, Real speed, Real mass, Real step) {
  return mass / step * (beta * depth / step - damping_of(beta) * speed);
}

// A place that moves as Σ weight × node does.
template <class Real>
struct Share {
  int node;  // of the world
  Real weight;
};
// Some that lie one behind the other.
template <class Real>
struct Shares {
  const Share<Real>*first = nullptr, *last = nullptr;
  const Share<Real>* begin() const { return first; }
  const Share<Real>* end() const { return last; }
};

// A force that a contact or a wall gave, for those who ask.
template <class Real>
struct ContactRecord {
  int body, against;  // whose point, on whom; against −1: a wall
  Real place[3], depth, force[3];
};

}  // namespace limber::fem::detail
