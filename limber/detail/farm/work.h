// A worker: takes units of a farm's folder until none is left for it. docs/farm.md.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/farm/farm_folder.h"

namespace limber::detail {

// Throws InputError where nothing was submitted, or by another build of limber, or the scene was edited
// since; DiskError; Interrupted, also where the farm is cancelled.
WorkDone work(const WorkOptions&);

}  // namespace limber::detail
