// One page in HTML about a planned folder, that needs nothing else: docs/files.md.
#pragma once

#include <optional>

#include "core/file.h"

namespace limber::detail {

enum class FilmInPage { none, embedded, of_another_plan, too_large };

struct WrittenReport {
  fs::path file;
  std::size_t bytes = 0;
  FilmInPage film = FilmInPage::none;
  bool all_kept = false;  // promises, checked anew
};
// Default: report.html in the folder. Throws as verify does, or DiskError.
WrittenReport report(const fs::path& folder, const std::optional<fs::path>& file = {});

}  // namespace limber::detail
