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

}  // namespace limber::ffd
