// Hangs a detailed surface on a coarse tet cage once, then moves it every frame: free-form deformation
// (Sederberg and Parry, SIGGRAPH 1986) with barycentric coordinates for the lattice's polynomials. Method:
// docs/binding.md.
#pragma once

#include "core/mesh.h"
#include "core/node_gradients.h"

namespace limber::ffd {

struct Binding {
  Eigen::VectorXi tet_from_vertex;  // (V)      row of cage.tets
  Weights weights;                  // (V × 4)  each row sums to 1; all ≥ 0 for a vertex inside its tet
  // Vertices in no tet: bound to the nearest one by extrapolation, clamped to weights ≥ −1.
  std::int64_t outside = 0;
  int farthest_outside_vertex = -1;
  double max_outside_distance_m = 0;
};

// Neighbours on the surface land in the same tet or in tets joined by faces wherever the cage allows it, also
// where two limbs of the cage touch. Throws InputError when a mesh is not valid (core/mesh.h).
Binding bind(const SurfaceMesh& surface, const TetMesh& cage);

// surface_positions (V × 3) is overwritten; it allocates only where it has another size.
void deform(const Binding&, const Tets&, const Points& cage_positions, Points& surface_positions);

// F of each node, row after row.
using Gradients = Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor>;  // (N × 9)
Gradients node_deformation_gradients(const NodeGradients&, const Points& cage_positions);

// As deform(), by Phong Deformation (James, SIGGRAPH 2020): x(X) = Σ w_i (x_i + ½ F_i (X − X_i)) over the
// corners of the vertex' tet, X and X_i at rest. Exact under affine maps and continuous as deform(), but the
// surface bends where that one folds; a vertex may leave its tet. Linear in cage_positions, so velocities of
// the nodes give those of the vertices.
void deform_phong(const Binding&, const TetMesh& rest_cage, const NodeGradients&,
                  const Points& cage_positions, Points& surface_positions);

// Unit normals (V × 3) of the deformed surface from those at rest: the cofactor of the deformation gradient,
// averaged at the cage's nodes and interpolated between them, so that no kink shows at tet borders. A normal
// that vanishes there (a cage folded flat) keeps its rest direction. normals may be rest_normals.
void deform_normals(const Binding&, const TetMesh& rest_cage, const Points& cage_positions,
                    const Points& rest_normals, Points& normals);

}  // namespace limber::ffd
