// The two loops that take the time: elastic forces and integration, over W lanes. Lane l of node n, axis c is
// at
// [(3n + c)W + l]; lanes never meet, so a lane's result does not depend on the others. Formulas:
// docs/dynamics.md. Plain data and pointers only: this header is compiled for three instruction sets.
#pragma once

namespace limber::fem::detail {

// ½ k ((L−D)/D)², damped: on i along d = x_j − x_i acts s·d, s = stiffness (1 − D/L) + damping (d·ḋ)/L².
template <class Real>
struct Spring {
  int i, j;
  Real rest_length;  // D
  Real stiffness;    // k/D²
  Real damping;      // k_d/D²
};

// ½ k ((V−V0)/V0)² + ½ k_inv (min(V,0)/V0)², damped, all by 6V = (b−a)·(c−a)×(d−a).
template <class Real>
struct VolumeElement {
  int node[4];
  Real rest_volume6;        // 6 V0
  Real stiffness;           // k/(6V0)²
  Real inverted_stiffness;  // k_inv/(6V0)²
  Real damping;             // k_d/(6V0)²
};

template <class Real>
struct Elements {
  const Spring<Real>* springs;
  int spring_count;
  const VolumeElement<Real>* volumes;
  int volume_count;
};

// One body's nodes and what integration finds out on the way.
template <class Real>
struct Motion {
  int first_node, last_node;  // [first, last)
  const Real* inverse_mass;   // a world node; 0 where it never moves
  Real dt;
  Real gravity[3];
  const Real* push;     // accelerations [3 (n − first_node) + xyz][lane], or null
  Real *lower, *upper;  // out: box of the new positions, [xyz][lane]
  Real* speed2;         // out: largest |v|² of the new velocities, [lane]
};

template <class Real>
struct Kernels {
  int lanes;
  // Adds the elastic and damping forces to f.
  void (*elastic)(const Elements<Real>&, const Real* x, const Real* v, Real* f);
  // v += dt (f/m + g + push), x += dt v, f = 0.
  void (*integrate)(const Motion<Real>&, Real* x, Real* v, Real* f);
};

enum class Isa { sse2, avx2, avx512 };
bool machine_has(Isa);
Isa best_isa();
// lanes 1, 8 or 16 for float, 1 for double.
template <class Real>
const Kernels<Real>& kernels(Isa, int lanes);

}  // namespace limber::fem::detail
