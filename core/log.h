// Lines for the person at the terminal: always stderr, so that stdout stays data. log::info("{} tets", n).
#pragma once

#include <spdlog/spdlog.h>

namespace limber::log {

using spdlog::debug;
using spdlog::info;
using spdlog::warn;

void set_up(int verbosity);  // −1 warnings only, 0 info, 1 debug

}  // namespace limber::log
