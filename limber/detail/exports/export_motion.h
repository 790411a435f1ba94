// The motion of a work folder as files for other programs. docs/files.md says what is in them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/json.h"
#include "limber/detail/exports/motion_files.h"

namespace limber::detail {

inline const std::vector<std::string> motion_formats{"gltf", "pc2", "usd", "vtu"};
struct ExportOptions {
  fs::path folder;
  std::vector<std::string> formats;  // of motion_formats
  std::optional<fs::path> out;       // default: export in the folder
  std::string frames;                // as of RenderOptions
};

struct ExportedMotion {
  std::vector<int> frames;  // those of the motion that were wanted
  int frames_of_motion = 0;
  std::string trajectory_hash;
  fs::path folder;
  std::vector<std::pair<std::string, scenes::Deformation>> bodies = {};  // by name
  std::vector<std::pair<std::string, WrittenFiles>> formats = {};        // by name
};
// Throws InputError, DiskError.
ExportedMotion export_motion(const ExportOptions&);
Json json_of(const ExportedMotion&);  // as manifest.json has it

}  // namespace limber::detail
