#include <fmt/format.h>

#include "cli/bench_table.h"
#include "cli/commands.h"
#include "core/json_fields.h"

namespace limber::cli {

Outcome bench(const BenchOptions& options) {
  const Benchmark benchmark = run_benchmark(options, at_terminal());
  std::string text = text_of_benchmark(benchmark.report);
  Json report = json_of_fields(benchmark.report);
  if (benchmark.records) {
    report["runs"] = benchmark.records->string();
    report["page"] = benchmark.page->string();
    text += fmt::format("{} runs in {}, curves and tables in {}\n", benchmark.runs,
                        benchmark.records->string(), benchmark.page->string());
  }
  for (const fs::path& log : benchmark.ompl_logs) {
    report["ompl_logs"].push_back(log.string());
    text += fmt::format("OMPL's log {}\n", log.string());
  }
  return {exit_done, report, text};
}

}  // namespace limber::cli
