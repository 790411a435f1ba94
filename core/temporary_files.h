// The names that files have while they are written, and what becomes of those that killed processes leave.
#pragma once

#include <string>

#include "core/file.h"

namespace limber {

// Where the number of a process means something: this machine since it was started, and the same container. 8
// digits.
const std::string& place_of_processes();

// In the same folder, with the same extension, and another one each time:
// .STEM.PLACE.PROCESS.COUNT.tmp.EXTENSION, PLACE as above.
fs::path temporary_name(const fs::path& final_path);

// Removes the temporary files that killed processes left in the folder itself, and returns how many: those of
// this place at once when no such process runs any more; those of others, of which nothing can be known, when
// they have not been written to for a day.
int remove_abandoned(const fs::path& folder);

}  // namespace limber
