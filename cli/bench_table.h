// The tables of a benchmark's report.
#pragma once

#include <string>

#include "core/json.h"

namespace limber::cli {

std::string text_of_benchmark(const Json& report);

}  // namespace limber::cli
