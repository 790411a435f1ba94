#include "plan/portfolio.h"

#include <algorithm>
#include <chrono>

#include "core/error.h"
#include "core/progress.h"

namespace limber::plan {

namespace {

constexpr std::int64_t first_turn = 16;  // iterations

bool got_farther(const Plan& a, const Plan& b) {
  return a.leg() != b.leg() ? a.leg() > b.leg() : a.best_distance_m < b.best_distance_m;
}

}  // namespace

Json json_of(const PortfolioReport& report) {
  Json searches = Json::array();
  for (const PortfolioReport::Search& s : report.searches)
    searches.push_back({{"seed", s.seed}, {"iterations", s.iterations}, {"solved", s.solved}});
  return {{"searches", searches},
          {"iterations", report.iterations},
          {"cpu_s", report.cpu_s},
          {"wall_s", report.wall_s}};
}

Plan portfolio(const System& system, const Settings& settings, int searches, PortfolioReport* report) {
  using Clock = std::chrono::steady_clock;
  LIMBER_CHECK(searches >= 2 && searches <= 1000, searches);
  const Clock::time_point started = Clock::now();
  const auto wall_s = [&] { return std::chrono::duration<double>(Clock::now() - started).count(); };
  const double cpu_before = cpu_seconds();

  std::vector<std::optional<Plan>> plans(std::size_t(searches), std::nullopt);
  int winner = -1;
  Ending ending = Ending::iterations;  // of what is not solved
  for (std::int64_t turn = std::min(first_turn, settings.max_iterations);
       winner < 0 && ending == Ending::iterations; turn = std::min(2 * turn, settings.max_iterations)) {
    std::int64_t most = turn;
    for (int k = 0; k < searches && ending == Ending::iterations; ++k) {
      std::optional<Plan>& plan = plans[std::size_t(k)];
      Settings own = settings;
      own.seed += std::uint64_t(k);
      own.max_iterations = most;
      own.time_limit_s =
          std::max(0.0, settings.time_limit_s - wall_s()) + (plan ? plan->statistics.wall_s : 0);
      plan = plan::plan(system, own, std::move(plan));
      if (plan->ending == Ending::stopped || plan->ending == Ending::time) ending = plan->ending;
      // Of those that follow only one with fewer iterations would win.
      if (plan->solved()) winner = k, most = plan->statistics.iterations - 1;
      if (most < 0) break;
    }
    if (turn == settings.max_iterations) break;
  }
  int best = winner;
  for (int k = 0; k < searches && winner < 0; ++k)
    if (plans[std::size_t(k)] && (best < 0 || got_farther(*plans[std::size_t(k)], *plans[std::size_t(best)])))
      best = k;

  if (report) {
    for (int k = 0; k < searches; ++k) {
      const std::optional<Plan>& plan = plans[std::size_t(k)];
      report->searches.push_back(
          {settings.seed + std::uint64_t(k), plan ? plan->statistics.iterations : 0, plan && plan->solved()});
      report->iterations += report->searches.back().iterations;
    }
    report->cpu_s = cpu_seconds() - cpu_before;
    report->wall_s = wall_s();
  }
  Plan plan = std::move(*plans[std::size_t(best)]);
  if (!plan.solved()) plan.ending = ending;
  plan.settings.max_iterations = settings.max_iterations;
  plan.settings.time_limit_s = settings.time_limit_s;
  return plan;
}

}  // namespace limber::plan
