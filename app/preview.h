// Pictures of what prepare made, for people: shells, cage, a cut through the tets, their dihedrals.
// docs/cli.md.
#pragma once

#include <string>
#include <vector>

#include "app/body.h"

namespace limber::app {

inline constexpr const char* preview_files[] = {"preview-shells.png", "preview-cage.png", "preview-cut.png",
                                                "preview-dihedrals.png"};

// Writes preview_files into the folder.
void write_previews(const PreparedBody&, const std::vector<ConvexShell>&, const fs::path& folder);

}  // namespace limber::app
