// One scene on many machines: sent, looked after, ended. docs/farm.md.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/farm/engines.h"

namespace limber::detail {

// The folder first, and then the engine. Throws InputError where nothing was submitted.
FarmStatus farm_status(const fs::path& work_folder);

// Goes on where the same was submitted before. Without a scene goes on with what is in the folder. Of engine
// "local" waits for the end. Throws InputError also where something else is at work in the folder.
Submitted submit(FarmOptions);

// Throws InputError where nothing was submitted. The jobs that it ended.
Cancelled cancel_farm(const fs::path& work_folder);

}  // namespace limber::detail
