// The two loops that take the time: elastic forces and integration, over W lanes. Lane l of node n, axis c is
// at node × n + component × c + l of a layout; lanes never meet, so a lane's result does not depend on the
// others. Formulas: docs/dynamics.md. Plain data and pointers only: this header is compiled for three
// instruction sets.
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

// The same in columns, 16 to a block, for the kernel that puts elements of one rollout side by side. The last
// block is filled up with whatever is harmless to compute.
inline constexpr int block_size = 16;
template <class Real>
struct SpringBlock {
  int i[block_size], j[block_size];
  Real rest_length[block_size], stiffness[block_size], damping[block_size];
};
template <class Real>
struct VolumeBlock {
  int node[4][block_size];
  Real rest_volume6[block_size], stiffness[block_size], inverted_stiffness[block_size], damping[block_size];
};

template <class Real>
struct Elements {
  const Spring<Real>* springs;
  const SpringBlock<Real>* spring_blocks;
  int spring_count;
  const VolumeElement<Real>* volumes;
  const VolumeBlock<Real>* volume_blocks;
  int volume_count;
};

// Where numbers of a node are, from the first of their array. One lane: records x y z 0 u v w 0 and forces
// x y z 0, which load as rows. More: [node][xyz][lane].
struct Layout {
  int node, component;
  int at(int n, int c) const { return node * n + component * c; }
};
constexpr Layout state_layout(int lanes) { return lanes == 1 ? Layout{8, 1} : Layout{3 * lanes, lanes}; }
constexpr Layout force_layout(int lanes) { return lanes == 1 ? Layout{4, 1} : Layout{3 * lanes, lanes}; }

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
// lanes 1, 4, 8 or 16 for float, 1 for double.
template <class Real>
const Kernels<Real>& kernels(Isa, int lanes);

}  // namespace limber::fem::detail
