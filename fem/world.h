// Soft bodies as tet cages, and the world they share. Method, sources, figures: docs/dynamics.md,
// docs/contact.md.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/contact_shape.h"
#include "core/mesh.h"
#include "core/state.h"
#include "fem/detail/surface_tables.h"
#include "fem/detail/tables.h"
#include "fem/ligament.h"
#include "fem/script.h"

namespace limber::fem {

enum class MaterialModel {
  springs,     // the paper's: springs along edges and a spring of the volume (Teschner et al. 2004)
  neo_hookean  // stable Neo-Hookean (Smith, de Goes, Kim 2018): true moduli at small strain, whatever the
               // mesh
};

struct Material {
  MaterialModel model = MaterialModel::springs;
  double youngs_modulus_pa = 5e3;  // > 0
  double poisson_ratio =
      0.45;  // springs: 0.25 ≤ ν ≤ 0.495, since springs alone have 0.25; else 0 ≤ ν ≤ 0.495
  double density_kg_m3 = 100;     // > 0
  double damping_ratio = 0.05;    // 0 … 1, share of critical damping of the body's lowest longitudinal mode
  double mass_damping_per_s = 0;  // ≥ 0; Rayleigh's α: what moves is slowed by α v, as in a medium at rest
  // 0 … 30, and 0 … 2: node i of mass m is drawn to its place at rest X by m (ω² (X − x) − 2 ζ ω v), with
  // ω = 2 π fascia_hz. A uniform body's centre of mass is then a damped oscillator of its own.
  double fascia_hz = 0, fascia_damping_ratio = 1;
  double friction = 0.2;          // 0 … 2, Coulomb; a pair has the geometric mean, a wall the body's own
  bool mesh_independent = false;  // softens the elements by what coarse tets are too stiff (docs/dynamics.md)
};

enum class BodyKind {
  deformable,
  rigid,      // moves as one piece, by gravity, contact and controls
  immovable,  // no node ever moves
  kinematic   // moves as one piece by its keyframes: it pushes, and nothing pushes it
};

inline constexpr double min_stiffness_share = 0.05, max_stiffness_share = 4;  // that build_world finds

struct BodySpec {
  std::string name;
  TetMesh cage;  // the rest shape, where the body starts
  Material material;
  std::vector<int> fixed_nodes;          // rows of cage.positions that never move
  BodyKind kind = BodyKind::deformable;  // all nodes fixed means immovable too; rigid bodies have none fixed
  // (T) each, or empty: the material's everywhere.
  std::vector<double> youngs_modulus_from_tet_pa = {}, density_from_tet_kg_m3 = {};
  bool self_contact = false;  // parts of the body that are not neighbours push one another apart
  double max_volume_change = std::numeric_limits<double>::infinity();  // |V − V0|/V0 of a sound state, > 0
  // s > 1: in a sound state the singular values of all tets' deformation gradients lie within 1/s and s.
  double max_stretch = std::numeric_limits<double>::infinity();
  // > 0; what may press the body at a frame (contact_loads_n).
  double max_contact_load_n = std::numeric_limits<double>::infinity();
  // Of the fine surface that the cage moves: contact is where that is. All bodies of a world have one, or
  // none has: then contact is between the cages. Shared, for it is large and never changes.
  std::shared_ptr<const ContactShape> shape = nullptr;
  bool phong = false;  // the cage moves that surface by Phong Deformation (docs/binding.md); else linearly
  // At the start, of a body that is pushed; it turns about its centre of mass. Held nodes do not move.
  Vec3 velocity_m_s = Vec3::Zero(), angular_velocity_rad_s = Vec3::Zero();
  std::optional<Vec3> gravity_m_s2 = {};  // nothing: the world's
  Track track = {};                       // kinematic
  // Body::stiffness_share of a body of this spec, which spares build_world to find it; 0: not known.
  double stiffness_share = 0;
};

struct WorldSpec {
  std::vector<BodySpec> bodies;
  int robot = 0;                     // index of the body that controls push
  Box bounds_m;                      // every body starts inside
  bool walls = true;                 // the bounds are rigid walls
  Vec3 gravity_m_s2 = Vec3::Zero();  // on every node that is not fixed, where its body has no other
  double max_dt_s = 0;               // 0: automatic; a scene may only lower the step
  Points goal_shape_m;  // (N × 3) to which interpolation draws the robot, wherever; empty: its rest shape
  // A soft body all of whose nodes are slower, and would gain less than this in a second, comes to rest;
  // one at rest stays so until a node would gain as much in a tenth of a second. Where its box
  // meets another's or a wall, whose rounding shakes single nodes, their mean counts for that
  // (docs/dynamics.md, "Rest and sleep"). 0: only where nothing would move.
  double rest_speed_m_s = 0;
  double contact_offset_m = 0;  // ≥ 0: fine surfaces that near push each other
  bool part_overlaps = true;    // fine surfaces that overlap where bodies start are parted, else refused
  // > 0; in a clear state no fine surface is deeper in another body's than this, beyond what it is at the
  // start.
  double max_overlap_m = std::numeric_limits<double>::infinity();
  std::vector<ForceSpec> forces = {};
  std::vector<PressureSpec> pressures = {};
  std::vector<LigamentSpec> ligaments = {};
  // World::start_positions of a world of this spec, which spares it the parting; empty: not known.
  std::vector<float> start_positions = {};
};

// The rest cage and what follows from it and the material; constant.
struct Body {
  std::string name;
  Material material;
  BodyKind kind;
  bool self_contact;  // as asked for; false unless deformable
  bool moving;        // false: static, not part of State
  bool pushed() const { return moving && kind != BodyKind::kinematic; }  // forces count
  TetMesh cage;       // rest; positions rounded to float32, as the simulation has them
  int first_node;     // the body's row 0 among the world's nodes; for moving bodies also among those of State
  int first_tet;      // its tet 0 among the world's
  Triangles surface;  // boundary faces, rows of cage.positions
  Triangles blown;    // faces along whose normal a pressure acts: the surface's, or of hollows, turned inward
  std::vector<int> surface_nodes;    // rows of cage.positions, ascending
  std::vector<bool> fixed;           // (N)
  std::vector<double> node_mass_kg;  // (N) a quarter of each adjacent tet's
  std::vector<double> youngs_modulus_from_tet_pa,
      density_from_tet_kg_m3;  // (T) the material's, or a part's own
  double mass_kg, rest_volume_m3;
  std::shared_ptr<const ContactShape> shape;  // as given
  bool phong;  // as asked for; false unless deformable, moving and with a shape
  double max_volume_change, max_stretch, max_contact_load_n;  // as asked for
  Vec3 velocity_m_s, angular_velocity_rad_s;                  // as asked for
  Vec3 gravity_m_s2;                                          // on every node that is not fixed
  Track track;                                                // likewise
  std::vector<Eigen::Matrix3d> inverse_rest_edges;  // (T) of the edges from a tet's node 0, as columns
  double stiffness_share;     // by which the elements' stiffness is multiplied; 1 unless mesh_independent
  double elastic_dt_limit_s;  // largest stable step of the damped elastic body; infinite unless deformable
  int node_count() const { return int(cage.positions.rows()); }
};

// What was done to bodies whose fine surfaces overlap where they start. Method: docs/contact.md.
struct Parting {
  struct Pair {
    int body, other;    // body < other
    double depth_m;     // how deep they were in one another
    double gap_m;       // now; as far as the offset asked for
    double moved_m[2];  // where they were deepest: how far out of the other one's way each went
  };
  std::vector<Pair> pairs;             // ascending; empty: nothing was parted
  std::vector<double> largest_move_m;  // [body] of its nodes, from their places at rest; empty as `pairs`
  int steps = 0;                       // that it took; 0 where start_positions were given
  double cpu_s = 0;                    // likewise
};

// Constant while stepping; threads share it. Nodes and tets are numbered body after body, moving bodies
// first.
struct World {
  std::vector<Body> bodies;  // in the order of WorldSpec
  int robot;
  Box bounds_m;
  bool walls;
  double rest_speed_m_s;
  double dt_s;   // time step: of controls, contact and frames; substeps × a float32
  int substeps;  // of elastic forces, friction and integration in a step
  // Step from which contact stiffness follows: the automatic one, also when dt_s is lower. A float32, too.
  double contact_dt_s;
  Points goal_shape_m;              // (N × 3) from its centre of mass: to what interpolation draws the robot
  int moving_nodes;                 // nodes of State
  int nodes;                        // with those of static bodies
  detail::ElementLists elements;    // of the moving bodies, on nodes of the world
  detail::Tables<float> tables;     // what the float32 steppers read
  detail::Tables<double> tables64;  // the same for the double reference
  detail::Topology topology;
  detail::SurfaceTables<float> surfaces;  // without bodies where contact is between the cages
  detail::SurfaceTables<double> surfaces64;
  double substep_s() const { return dt_s / substeps; }  // a float32 exactly
  bool touches_on_surfaces() const { return !surfaces.bodies.empty(); }
  std::vector<float> start_positions;  // (3 × moving_nodes) rest shapes and places, unless they were parted
  Parting parting;
  bool part_overlaps;                            // as asked for
  double max_overlap_m;                          // as asked for
  std::vector<Force> forces;                     // in the order of WorldSpec
  std::vector<Pressure> pressures;               // likewise
  std::vector<Ligament> ligaments;               // likewise
  std::vector<detail::RigidTable> rigid_tables;  // a body; empty unless it is rigid
};

// Throws InputError naming body and element: a cage that is not valid, a node in no tet, a fixed node that
// does not exist or belongs to a rigid body, a material out of range, a robot that is missing or cannot move,
// a body outside the bounds, a force between no times or on a body or nodes that nothing can push, a pressure
// likewise or in what is not soft, keyframes
// that do not ascend from above 0, a ligament that hangs on nothing that moves or away from its bodies, two
// bodies that overlap at the start (and how deep) and are not parted, coordinates too large for float32, a
// step too small to be of use, start_positions of another number. Throws Interrupted after a stop signal.
World build_world(const WorldSpec&);

// How deep two cages are in one another, as build_world measures it at the start.
struct CageOverlap {
  double depth_m = 0;  // 0: apart
  Vec3 way_m =
      Vec3::Zero();  // of that length: the first cage moved by it has the deepest place no longer inside
};
CageOverlap cage_overlap(const TetMesh& one, const TetMesh& two);

// All moving bodies in their rest shapes and places, at rest.
State rest_state(const World&);
// Where all begins: the same, or as bodies that overlap there were parted, with the velocities at the start.
State start_state(const World&);
// Puts kinematic bodies where their keyframes have them at state.step, with the velocities of the step that
// begins.
void follow_keyframes(const World&, State& state);

}  // namespace limber::fem
