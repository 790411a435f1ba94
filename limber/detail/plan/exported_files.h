#pragma once

#include <vector>

#include "core/file.h"

namespace limber::detail {

// Those of the files in a folder that `limber export` may have written there, ordered.
std::vector<fs::path> exported_files(const fs::path& folder);

}  // namespace limber::detail
