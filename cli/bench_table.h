// The tables of a benchmark's report.
#pragma once

#include <string>

#include "limber/bench.h"

namespace limber::cli {

std::string text_of_benchmark(const BenchReport&);

}  // namespace limber::cli
