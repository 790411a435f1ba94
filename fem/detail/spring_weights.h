// Which spring each edge gets, so that together they are as isotropic as the mesh allows.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "core/mesh.h"

namespace limber::fem::detail {

// Edges (lower node first) and their k_D in J: ≥ 0, fitted so that round each node the springs' stiffness
// Σ ½ k_D n⊗n⊗n⊗n is as near as can be to that of an isotropic material of Lamé's λ = μ,
// Σ ¼ μV (δ_ij δ_kl + δ_ik δ_jl + δ_il δ_jk) over the node's tets. mu_volume: μV of each tet, J. Method:
// docs/dynamics.md.
std::map<std::pair<int, int>, double> isotropic_springs(const TetMesh&, const std::vector<double>& mu_volume);

}  // namespace limber::fem::detail
