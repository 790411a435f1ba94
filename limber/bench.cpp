#include "limber/bench.h"

#include "limber/detail/bench/bench.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

Benchmark run_benchmark(const BenchOptions& options, const Context& context) {
  return detail::working_for(context, [&] { return detail::bench(options); });
}

}  // namespace limber
