// Mesh files of our own work folder. Readers throw InputError naming the file and the place; a truncated file
// is an InputError. (Models of users come in through meshing's import, which takes far more.)
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "core/mesh.h"

namespace limber {

// Binary little-endian PLY, double positions, int triangles.
// ASCII and float PLY of the same elements.
void write_ply(const fs::path&, const SurfaceMesh&);
SurfaceMesh read_ply(const fs::path&);
SurfaceMesh ply_from(const std::string& bytes, const fs::path& named);  // of a file that was read

// OBJ with 17 digits; one group "shell_i" a shell; how many shells, vertices and triangles there are stands
// in its first line, and "# end" in its last.
void write_obj(const fs::path&, const std::vector<ConvexShell>&);
std::vector<ConvexShell> read_obj_shells(const fs::path&);
void write_obj(const fs::path&, const SurfaceMesh&);

// Gmsh 2.2 ASCII, 4-node tets, 17 digits. `label` (per tet, may be empty) goes into the physical and
// elementary tags, plus 1.
void write_msh(const fs::path&, const TetMesh&, const std::vector<int>& label = {});
TetMesh read_msh(const fs::path&, std::vector<int>* label = nullptr);
TetMesh msh_from(const std::string& text, const fs::path& named, std::vector<int>* label = nullptr);

}  // namespace limber
