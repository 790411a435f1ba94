// Files for other programs, made from a prepared body. docs/files.md says what is in them.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/body/body.h"

namespace limber::detail {

inline const std::vector<std::string> export_formats{"vtu",  "node", "interp", "vtk", "vtk-interior", "inp",
                                                     "urdf", "sdf",  "mjcf",   "usd", "usd-omni",     "sofa"};

// Writes those files of each format into the folder, and returns their names, each once. Masses are of
// density_kg_m3.
std::vector<std::string> export_body(const PreparedBody&, const std::vector<std::string>& formats,
                                     double density_kg_m3, const fs::path& folder);
// Removes all that export_body can have written there.
void remove_exports(const fs::path& folder);

}  // namespace limber::detail
