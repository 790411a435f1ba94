#include "plan/portfolio.h"

#include <gtest/gtest.h>

#include <csignal>
#include <set>

#include "core/progress.h"
#include "core/threads.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

constexpr int searches = 6;

Plan of_seed(const Toy& toy, std::uint64_t seed, std::int64_t most) {
  Settings settings = toy_settings();
  settings.seed = seed, settings.max_iterations = most;
  return plan(toy, settings);
}

// The sequential rule and the one with a lag.
std::vector<Settings> both() {
  std::vector<Settings> all(2, toy_settings());
  for (Settings& s : all) s.max_iterations = 6000;
  all[1].search_options.lag = 7;
  return all;
}

TEST(Portfolio, IsThePlanOfTheSeedWithTheFewestIterations) {
  const Toy toy(5, true, true, 1.6f);
  for (const Settings& settings : both())
    for (const std::uint64_t first : {1u, 20u}) {
      Settings own = settings;
      own.seed = first;
      PortfolioReport report;
      const Plan won = portfolio(toy, own, searches, &report);
      std::optional<Plan> best;
      std::set<std::int64_t> different;
      for (int k = 0; k < searches; ++k) {
        Settings one = settings;
        one.seed = first + std::uint64_t(k);
        Plan p = plan(toy, one);
        ASSERT_TRUE(p.solved());
        different.insert(p.statistics.iterations);
        if (!best || p.statistics.iterations < best->statistics.iterations) best = std::move(p);
      }
      EXPECT_GT(different.size(), 3u);  // there is something to choose from
      EXPECT_EQ(won.settings.seed, best->settings.seed);
      EXPECT_EQ(won.settings.max_iterations, 6000);
      EXPECT_EQ(won.statistics.iterations, best->statistics.iterations);
      EXPECT_EQ(hash_of(won.tree), hash_of(best->tree));
      EXPECT_EQ(hash_of(won.trajectory), hash_of(best->trajectory));

      ASSERT_EQ(report.searches.size(), std::size_t(searches));
      std::int64_t sum = 0;
      for (const PortfolioReport::Search& s : report.searches) {
        sum += s.iterations;
        EXPECT_LE(s.iterations, 2 * won.statistics.iterations);
      }
      EXPECT_EQ(report.iterations, sum);
    }
}

TEST(Portfolio, SameBytesForAnyThreads) {
  Toy toy(5, true, true, 1.6f);
  toy.jitter = true;
  for (const Settings& settings : both()) {
    set_thread_count(1);
    PortfolioReport first, second;
    const Plan one = portfolio(toy, settings, searches, &first);
    set_thread_count(3);
    const Plan three = portfolio(toy, settings, searches, &second);
    set_thread_count(0);
    EXPECT_EQ(one.settings.seed, three.settings.seed);
    EXPECT_EQ(hash_of(one.tree), hash_of(three.tree));
    EXPECT_EQ(hash_of(one.trajectory), hash_of(three.trajectory));
    EXPECT_EQ(first.iterations, second.iterations);
  }
}

TEST(Portfolio, WithoutASolutionItIsThePlanThatGotFarthest) {
  const Toy toy(5, true, true, 1.6f);
  Settings settings = toy_settings();
  settings.max_iterations = 20;
  PortfolioReport report;
  const Plan nearest = portfolio(toy, settings, searches, &report);
  EXPECT_FALSE(nearest.solved());
  EXPECT_EQ(report.iterations, 20 * searches);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < searches; ++k)
    least = std::min(least, of_seed(toy, settings.seed + std::uint64_t(k), 20).best_distance_m);
  EXPECT_EQ(nearest.best_distance_m, least);
}

TEST(Portfolio, ASignalOrNoTimeLeavesAPlan) {
  Toy toy(5, true, true, 1.6f);
  Settings settings = toy_settings();
  std::atomic<int> left{60};
  toy.before_each_rollout = [&] {
    if (--left == 0) request_stop(SIGINT);
  };
  const Plan stopped = portfolio(toy, settings, searches);
  request_stop(0);
  EXPECT_EQ(stopped.ending, Ending::stopped);
  EXPECT_FALSE(stopped.solved());
  toy.before_each_rollout = nullptr;
  settings.time_limit_s = 0;
  EXPECT_EQ(portfolio(toy, settings, searches).ending, Ending::time);
}

}  // namespace
}  // namespace limber::plan
