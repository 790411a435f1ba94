// Pictures of what prepare made, for people: shells, cage, a cut through the tets, their dihedrals.
// docs/cli.md.
#pragma once

#include <string>
#include <vector>

#include "app/body.h"

namespace limber::app {

inline constexpr const char* preview_files[] = {"preview-shells.png", "preview-cage.png", "preview-cut.png",
                                                "preview-dihedrals.png"};

// sRGB, 0 … 1: the colour in which preview-shells.png and preview-cage.png show shell i.
Vec3 shell_color(std::size_t i);

// Writes preview_files into the folder; they do not show where the model lies.
void write_previews(PreparedBody, std::vector<ConvexShell>, const fs::path& folder);

}  // namespace limber::app
