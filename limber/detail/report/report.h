// One page in HTML about a planned folder, that needs nothing else: docs/files.md.
#pragma once

#include <optional>

#include "core/file.h"
#include "limber/work_folder.h"

namespace limber::detail {

// Default: report.html in the folder. Throws as verify does, or DiskError.
WrittenReport report(const fs::path& folder, const std::optional<fs::path>& file = {});

}  // namespace limber::detail
