// The tables of a benchmark's report.
#pragma once

#include <string>

#include "limber/detail/bench/bench.h"

namespace limber::cli {

std::string text_of_benchmark(const detail::BenchReport&);

}  // namespace limber::cli
