// Deformation gradients at the nodes of a tet mesh.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber {

// What turns positions of a cage's nodes into deformation gradients at the nodes: F_i = Σ_j x_j g_ijᵀ is the
// mean of the gradients of the tets round node i, by their rest volumes. Σ_j g_ij = 0; 0 for a node of no
// tet.
struct NodeGradients {
  std::vector<int> begin;      // (N + 1) node i has the entries begin[i] … begin[i + 1] − 1 of the others
  std::vector<int> neighbour;  // j: i itself and all that share a tet with it, ascending
  Points gradient;             // g_ij, 1/m
};
NodeGradients node_gradients(const TetMesh& rest_cage);

}  // namespace limber
