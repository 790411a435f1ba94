// Files for other programs, made from a prepared body. docs/files.md says what is in them.
#pragma once

#include <string>
#include <vector>

#include "app/body.h"

namespace limber::app {

inline const std::vector<std::string> export_formats{"vtu", "node", "interp"};
inline constexpr const char* export_files[] = {"cage.vtu", "surface.vtu",    "cage.node",  "cage.ele",
                                               "cage.veg", "surface.interp", "surface.obj"};

// Writes those files of each format into the folder, and returns their names.
std::vector<std::string> export_body(const PreparedBody&, const std::vector<std::string>& formats,
                                     const fs::path& folder);

}  // namespace limber::app
