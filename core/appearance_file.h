// appearance.npz and the images beside it, in a body's folder: docs/files.md.
#pragma once

#include <string>
#include <vector>

#include "core/appearance.h"
#include "core/file.h"

namespace limber {

inline constexpr const char* appearance_file = "appearance.npz";
inline constexpr std::uintmax_t max_image_bytes = 64 << 20;
inline constexpr std::size_t max_images = 64;

// "image-0.png": of image i.
std::string name_of_image_file(const Appearance&, std::size_t image);
bool is_name_of_image_file(const std::string&);

// Of those rows of coordinates and colors what floats hold. Returns the names of the files, appearance.npz
// first; writes none where the appearance is empty.
std::vector<std::string> write_appearance(const fs::path& folder, const Appearance&, const SurfaceMesh&);
// Throws InputError when a file is missing, damaged, or of another surface.
Appearance read_appearance(const fs::path& folder, const SurfaceMesh&);
// Removes whatever write_appearance may have written there.
void remove_appearance(const fs::path& folder);

}  // namespace limber
