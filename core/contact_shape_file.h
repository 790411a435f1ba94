// contact.npz: field int16 (nodes z × y × x), sample_positions_m float64 (S × 3), sample_tets int32 (S),
// sample_weights float64 (S × 4), sample_areas_m2 float64 (S), min_weight float64 (T × 4), and meta.json
// with the rest of the field, `usable`, and the hashes of both meshes.
#pragma once

#include "core/contact_shape.h"
#include "core/file.h"
#include "core/mesh.h"

namespace limber {

void write_contact_shape(const fs::path&, const ContactShape&, const SurfaceMesh&, const TetMesh& cage);

// Throws InputError when the file is cut short or contradicts itself, or when it was made for other meshes
// than these (then the text names the command that renews it).
ContactShape read_contact_shape(const fs::path&, const SurfaceMesh&, const TetMesh& cage);

}  // namespace limber
