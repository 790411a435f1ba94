// Files for other programs, made from a prepared body. docs/files.md says what is in them.
#pragma once

#include <string>
#include <vector>

#include "limber/body_folder.h"
#include "limber/detail/body/body.h"

namespace limber::detail {

// Writes those files of each format of the body in `body_folder` into `out`, and returns their names, each
// once. Masses are of density_kg_m3. Throws InputError where the folder's shells are damaged, DiskError.
std::vector<std::string> export_body(const PreparedBody&, const std::vector<std::string>& formats,
                                     double density_kg_m3, const fs::path& body_folder, const fs::path& out);
// Removes all that export_body can have written there.
void remove_exports(const fs::path& folder);

// `limber export` of a folder that `limber prepare` made.
// Throws InputError where the folder holds no whole body.
ExportedBody export_body_folder(const BodyExportOptions&);

}  // namespace limber::detail
