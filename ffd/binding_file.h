// binding.npz: tet_from_vertex int32 (V), weights float64 (V × 4), and meta.json with the hashes of both
// meshes.
#pragma once

#include "core/file.h"
#include "ffd/binding.h"

namespace limber::ffd {

void write_binding(const fs::path&, const Binding&, const SurfaceMesh&, const TetMesh& cage);

// Throws InputError when the file is cut short or contradicts itself, or when it was made for other meshes
// than these (then the text names the command that renews it).
Binding read_binding(const fs::path&, const SurfaceMesh&, const TetMesh& cage);

// Vega FEM's .interp, which goes with core/export_files.h's .veg: a line for each vertex of the surface, its
// number and four pairs of a cage node and its weight, all counted from 0.
void write_interp(const fs::path&, const Binding&, const Tets& cage_tets);

}  // namespace limber::ffd
