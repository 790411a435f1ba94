// The two loops that take the time: elastic forces and integration, over W lanes. Lane l of node n, axis c is
// at node × n + component × c + l of a layout; lanes never meet, so a lane's result does not depend on the
// others. Formulas: docs/dynamics.md. Plain data and pointers only: this header is compiled for three
// instruction sets.
#pragma once

namespace limber::fem::detail {

// Laws, for numbers T: all members are T, so that a law can be read as an array.
// ½ k ((L−D)/D)², damped: on i along d = x_j − x_i acts s·d, s = stiffness (1 − D/L) + damping (d·ḋ)/L².
template <class T>
struct SpringLaw {
  T rest_length;  // D
  T stiffness;    // k/D²
  T damping;      // k_d/D²
};
// The damping alone.
template <class T>
struct DashpotLaw {
  T damping;
};
// ½ k ((V−V0)/V0)² + ½ k_inv (min(V,0)/V0)², damped, all by 6V = (b−a)·(c−a)×(d−a).
template <class T>
struct VolumeLaw {
  T rest_volume6;        // 6 V0
  T stiffness;           // k/(6V0)²
  T inverted_stiffness;  // k_inv/(6V0)²
  T damping;             // k_d/(6V0)²
};
// The volume law, and ½ μV0 (I − 3 − ln(I+1)), I = tr FᵀF = tr(EᵀE M), E the edges from node 0 as columns,
// M = (E0ᵀE0)⁻¹.
template <class T>
struct NeoHookeanLaw {
  VolumeLaw<T> volume;
  T metric[6];  // μV0 M: xx xy xz yy yz zz
  T scale;      // μV0
};
// A tet's law, and those of some of its edges from node 0, to its nodes 1 … Edges. Vectors, velocities and
// sums of forces of these edges are the tet's own, so that they load and store nothing themselves.
template <class T, template <class> class Solid, template <class> class Edge, int Edges>
struct StarLaw {
  Solid<T> solid;
  Edge<T> edge[Edges];
};
template <class T, template <class> class Solid, template <class> class Edge>
struct StarLaw<T, Solid, Edge, 0> {
  Solid<T> solid;
};
template <template <class> class Solid, template <class> class Edge, int Edges>
struct StarLawOf {
  template <class T>
  using Law = StarLaw<T, Solid, Edge, Edges>;
};

// On `nodes` nodes acts a law. Blocks hold the same in columns, 16 elements each, for the kernel that puts
// elements of one rollout side by side; the last is filled up with what is harmless to compute.
template <class Real, int Nodes, template <class> class Law>
struct Element {
  static constexpr int nodes = Nodes;
  int node[Nodes];
  Law<Real> law;
};
template <class Real>
using Spring = Element<Real, 2, SpringLaw>;
template <class Real>
using Dashpot = Element<Real, 2, DashpotLaw>;
template <class Real>
using VolumeElement = Element<Real, 4, VolumeLaw>;
template <class Real>
using NeoHookeanElement = Element<Real, 4, NeoHookeanLaw>;
template <class Real, int Edges>
using SpringStar = Element<Real, 4, StarLawOf<VolumeLaw, SpringLaw, Edges>::template Law>;
template <class Real, int Edges>
using NeoHookeanStar = Element<Real, 4, StarLawOf<NeoHookeanLaw, DashpotLaw, Edges>::template Law>;

inline constexpr int block_size = 16;
template <class E>
struct Block;
template <class Real, int Nodes, template <class> class Law>
struct alignas(64) Block<Element<Real, Nodes, Law>> {
  static constexpr int numbers = sizeof(Law<Real>) / sizeof(Real);
  int node[Nodes][block_size];
  Real law[numbers][block_size];
};

template <class E>
struct List {
  const E* elements;
  const Block<E>* blocks;
  int count;
};

// The kinds of elements by number: edges that are in no star, and stars of 0 to 3 edges.
inline constexpr int spring_kind = 0, dashpot_kind = 1, spring_star_kind = 2, neo_hookean_star_kind = 6,
                     kinds = 10;
template <class Real, int Kind>
struct OfKind {
  using Type = NeoHookeanStar<Real, Kind - neo_hookean_star_kind>;
};
template <class Real, int Kind>
requires(Kind < neo_hookean_star_kind) struct OfKind<Real, Kind> {
  using Type = SpringStar<Real, Kind - spring_star_kind>;
};
template <class Real>
struct OfKind<Real, spring_kind> {
  using Type = Spring<Real>;
};
template <class Real>
struct OfKind<Real, dashpot_kind> {
  using Type = Dashpot<Real>;
};
template <class Real, int Kind>
using ElementOfKind = typename OfKind<Real, Kind>::Type;

// Elements of one kind, one after the other, from these on of all of their kind.
struct Run {
  int kind, element, block, count;
};
// What acts, run by run: the order of all sums of forces.
template <class Real>
struct Elements {
  const Run* runs;
  int count;
  const void* elements[kinds];  // of all bodies, the first of their kind
  const void* blocks[kinds];
  template <int Kind>
  List<ElementOfKind<Real, Kind>> list_of(const Run& run) const {
    using E = ElementOfKind<Real, Kind>;
    return {static_cast<const E*>(elements[Kind]) + run.element,
            static_cast<const Block<E>*>(blocks[Kind]) + run.block, run.count};
  }
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
  Real kept;            // share of the velocity that damping by mass leaves in a step; 1: all
  const Real* push;     // accelerations [3 (n − first_node) + xyz][lane], or null
  Real *lower, *upper;  // out: box of the new positions, [xyz][lane]
  Real* speed2;         // out: largest |v|² of the new velocities, [lane]
};

// A rigid body at rest, seen from its centre of mass; the order of six numbers is xx xy xz yy yz zz.
struct RigidBody {
  const double* mass;        // of its nodes
  const double* place;       // (3 a node) x y z
  double inverse_mass;       // of all
  double inverse_spread[6];  // (Σ m X Xᵀ)⁻¹
  double inverse_inertia[6];
};
// motion.speed2 is that of the way the nodes went in the step.
template <class Real>
struct RigidMotion {
  Motion<Real> motion;
  RigidBody body;
};

// Tets in columns, for finding points near them.
template <class Real>
struct alignas(64) TetPlanes {
  Real lower[3][block_size], upper[3][block_size];  // boxes
  // Outward unit normals and places of the faces' planes, at most 0.2 % too short; all 0 of a flat tet.
  Real normal[4][3][block_size], offset[4][block_size];
};

// What was found near it.
template <class Real>
struct NearTet {
  int item;       // of the points or segments
  Real distance;  // to the tet at least
};

// A tet and an edge of another body, or a vertex of it: then from = to.
struct TetAndEdge {
  int corner[4], from, to;  // nodes
  int tet, point;           // of the world's
};

// A point in a tet, for finding how ways lead out of the tet.
template <class Real>
struct WayOut {
  Real place[3];
  Real normal[4][3];  // inward, of any length
  Real height[4];     // of the point above the faces, in lengths of the normals
};

// A place near a tet of a body whose fine surface it may touch; and how far from the tet's core, metres.
template <class Real>
struct PlaceInTet {
  Real place[3], out;
  int node[4], tet, sample;  // of the world's
};
// Where things of tets are: in rows of four numbers, the first three of them x y z, unless it is said how
// many.
template <class Real>
struct SurfaceRows {
  const Real* places;  // of nodes; from first_core on corners of cores, four a tet
  int first_core;
  const Real* cores;             // (core_numbers a tet) first the least weights
  const Real* rest_places;       // of nodes
  const Real* slopes;            // columns of nodes' deformation gradients, three a node
  const Real* bends;             // of edges, six a tet
  const Real* weight_gradients;  // (9 a tet, and one more) of nodes 1 to 3
};
inline constexpr int core_numbers = 5;
// The signed distance to a surface at rest, on a grid, in units.
template <class Real>
struct FieldGrid {
  const short* values;
  int nodes[3];
  Real lower[3], inverse_cell, unit;
};

// When a body is at rest, [lane].
template <class Real>
struct Rest {
  Real max_speed2;                     // largest |v|² of a node, before and after
  Real max_gain2, max_gain2_of_still;  // largest |Δv|², where it moved, and where it was at rest
  // The same where it may touch something: contact's rounding shakes single nodes, so of each by this, and of
  // their mean by so much.
  Real max_shake2, max_mean_gain2, max_mean_gain2_of_still;
  const Real *asleep, *speed2_before, *touches;
  Real* at_rest;  // out: v is 0 now and x as before; `asleep` and `at_rest` are 0 or 1
};

// Tets whose singular values are to lie between two limits, here squared.
template <class Real>
struct StretchedTets {
  const int* nodes;          // (4 a tet) of the world
  const Real* inverse_rest;  // (9 a tet) of the edges at rest from node 0 as columns, row by row
  int count;
  Real least, most;
  const Real*
      reach;  // no singular value changes by more than this times what its nodes move, against any place
};

template <class Real>
struct Kernels {
  int lanes;
  // Adds the elastic and damping forces to f.
  void (*elastic)(const Elements<Real>&, const Real* x, const Real* v, Real* f);
  // v = kept (v + dt (f/m + g + push)), x += dt v, f = 0.
  void (*integrate)(const Motion<Real>&, Real* x, Real* v, Real* f);
  // The same where a body may stand still: it does in lanes where it is asleep, and where it was slow, stays
  // slow and gains little.
  void (*integrate_resting)(const Motion<Real>&, const Rest<Real>&, Real* x, Real* v, Real* f);
  // The same for a body whose nodes keep their distances. They are drawn onto the nearest rigid place first.
  void (*move_rigid)(const RigidMotion<Real>&, Real* x, Real* v, Real* f);
  // [lane] The largest square of a velocity of the nodes [first, last) against their mean.
  void (*inner_speed2)(int first, int last, const Real* v, Real* speed2);
  // Which tets have a singular value beyond a limit, or are inverted, in some lane, ascending, and in which
  // lanes, as bits. Returns how many. A tet sleeps in a lane while `travel` [lane], of the body's nodes
  // against their mean, is below `asleep_until` [tet][lane]. Reads multiples of block_size.
  int (*find_stretched)(const StretchedTets<Real>&, const Real* x, const Real* travel, Real* asleep_until,
                        int* tets, unsigned* lanes);
  // The planes of tets[k].corner, and their boxes moved out by `reach`.
  void (*find_planes)(const TetAndEdge* tets, int count, const Real* places, Real reach, TetPlanes<Real>*);
  // The points p, or segments from p to q, whose boxes meet the tet's and that are not outside of one of its
  // planes by more than `reach`. Reads multiples of block_size: all arrays must be that long. Returns how
  // many.
  int (*near_points)(const TetPlanes<Real>&, int column, const Real* const p[3], const Real* const q[3],
                     int count, Real reach, NearTet<Real>* found);
  int (*near_segments)(const TetPlanes<Real>&, int column, const Real* const p[3], const Real* const q[3],
                       int count, Real reach, NearTet<Real>* found);
  // Which of the boxes meet the tet's and are not outside of one of its planes by more than `reach`,
  // ascending. Reads and writes multiples of block_size. Returns how many.
  int (*meeting_boxes)(const TetPlanes<Real>&, int column, const Real* const lower[3],
                       const Real* const upper[3], int count, Real reach, int* index);
  // Which of the numbers are at most the bound, ascending. Reads and writes multiples of block_size. Returns
  // how many.
  int (*find_at_most)(const Real* numbers, int count, Real bound, int* index);
  // How far all[index[k]] are apart at least, 0 of a tet that is flat or inverted; the middle of the edge, or
  // all of it. A null index: all[k]. `places` has four numbers a node.
  void (*middle_distances)(const TetAndEdge* all, const int* index, int count, const Real* places,
                           Real* distance);
  void (*edge_distances)(const TetAndEdge* all, const int* index, int count, const Real* places,
                         Real* distance);
  // Through which face (−1: none) straight ways from the point to (x y z) leave the tet, and after which
  // share of the way. Multiples of block_size as above.
  void (*exits)(const WayOut<Real>&, const Real* x, const Real* y, const Real* z, int count, Real* share,
                int* face);
  // For each place its weights in its tet, columns 0 to 3, and in the next the least of them where it is no
  // farther than `out` from the tet's core; lowest where it is. All columns: multiples of block_size.
  void (*weigh_in_cores)(const PlaceInTet<Real>*, int count, const SurfaceRows<Real>&, Real* const* columns);
  // The weights of the place of the body that is there now, how far the surface is, negative below it, and
  // its unit normal, in eight columns. A largest distance where there is no such place, or no slope. Linear
  // deformation, and Phong's, until places are as near as `exact`.
  void (*find_surfaces)(const PlaceInTet<Real>*, int count, const SurfaceRows<Real>&, const FieldGrid<Real>&,
                        Real* const* columns);
  void (*find_bent_surfaces)(const PlaceInTet<Real>*, int count, const SurfaceRows<Real>&,
                             const FieldGrid<Real>&, Real exact, Real* const* columns);
  // How far samples of one tet, of weights in columns, are within a wall, if its nodes are so far; with the
  // bends of its edges away from it. And which are at most 0, ascending; returns how many. Reads and
  // writes multiples of block_size.
  int (*find_beyond_wall)(const Real* const weights[4], int count, const Real node[4], const Real* edge,
                          Real* within, int* index);
};

enum class Isa { sse2, avx2, avx512 };
bool machine_has(Isa);
Isa best_isa();
// lanes 1, 4, 8 or 16 for float, 1 for double.
template <class Real>
const Kernels<Real>& kernels(Isa, int lanes);

}  // namespace limber::fem::detail
