// Pictures of what prepare made, for people: shells, cage, a cut through the tets, their dihedrals.
// docs/cli.md.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/body/body.h"

namespace limber::detail {

inline constexpr const char* preview_files[] = {"preview-shells.png", "preview-cage.png", "preview-cut.png",
                                                "preview-dihedrals.png"};

inline constexpr const char* picture_file = "picture.png";

// sRGB, 0 … 1: the colour in which preview-shells.png and preview-cage.png show shell i.
Vec3 shell_color(std::size_t i);

bool has_picture(const fs::path& folder);  // a whole one
// Writes picture_file into a body's folder, from its files: small, without words, the cage over the surface,
// or the shells where there is no cage.
void write_picture(const fs::path& folder);

// Writes preview_files into the folder; they do not show where the model lies.
void write_previews(PreparedBody, std::vector<ConvexShell>, const fs::path& folder);

}  // namespace limber::detail
