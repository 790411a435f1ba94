#include "limber/bench.h"

#include "limber/detail/bench/bench.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"
#include "plan/settings.h"

namespace limber {

Benchmark run_benchmark(const BenchOptions& options, const Context& context) {
  using detail::require_in;
  if (options.iterations) require_in("iterations", *options.iterations, 0, plan::iteration_limit);
  require_in("in_flight", options.in_flight, 0, 4096);
  return detail::working_for(context, [&] { return detail::bench(options); });
}

}  // namespace limber
