// Files that a model names: its materials, its images.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/file.h"

namespace limber::meshing::detail {

// As many letters of a name that a file gives, so that messages and files end.
constexpr std::size_t max_letters_of_names = 100;
// A name that a file gives, cut and without control letters, as UTF-8.
std::string tamed(const std::string& name);

// `named` as a path beside the model, with slashes; nothing where it leads out of the model's folder. Of a
// path from the root of another machine the last part is what is looked for.
std::optional<fs::path> path_beside(const fs::path& model, std::string named);

struct Companion {
  std::optional<std::string> bytes;
  std::string complaint;  // where there are none: "… is not there"
};
// Reads a file that the model names.
Companion read_companion(const fs::path& model, const std::string& named, std::uintmax_t max_bytes);

}  // namespace limber::meshing::detail
