// The rollouts of bench/rollouts.py by the propagator that the planner uses, without the library's arrays:
// rollouts_bench SCENE FOLDER THREADS prints the median of five times, seconds, and the sum of the robot's
// centres.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "core/log.h"
#include "core/threads.h"
#include "limber/detail/interface/problem.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"

namespace {

using namespace limber;

class RolloutList final : public plan::RolloutSource {
 public:
  RolloutList(std::vector<plan::Rollout>& all, std::atomic<std::size_t>& next, int at_once)
      : all_(all), next_(next), at_once_(at_once) {}
  int at_once() const override { return at_once_; }
  plan::Rollout* next() override {
    const std::size_t i = next_++;
    return i < all_.size() ? &all_[i] : nullptr;
  }
  void done(plan::Rollout&) override {}

 private:
  std::vector<plan::Rollout>& all_;
  std::atomic<std::size_t>& next_;
  int at_once_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const Problem problem(read_scene(argv[1], {.preset = "fast"}), argv[2]);
  const Plan planned = problem.solve({.seed = 1});
  const std::vector<State>& frames = planned.impl().plan.trajectory.frames;
  constexpr int count = 256;
  const detail::FemSystem& system = problem.impl().system;
  std::vector<plan::Rollout> rollouts(count);
  for (int i = 0; i < count; ++i) {
    rollouts[std::size_t(i)].from = &frames[std::size_t(i) % frames.size()];
    rollouts[std::size_t(i)].control = {.manipulation = Manipulation::body,
                                        .force_n = {float(7 * i % 61 - 30), float(13 * i % 61 - 30), 0},
                                        .steps = 20 + 7 * i % 80};
  }
  set_thread_count(std::atoi(argv[3]));
  std::vector<std::unique_ptr<plan::Propagator>> propagators;
  for (int t = 0; t < thread_count(); ++t) propagators.push_back(system.make_propagator());
  std::vector<double> seconds;
  for (int round = 0; round < 5; ++round) {
    std::atomic<std::size_t> next{0};
    const auto began = std::chrono::steady_clock::now();
    parallel_for(thread_count(), [&](int t) {
      RolloutList supply(rollouts, next, system.lanes());
      propagators[std::size_t(t)]->run(supply, 1 << 30);
    });
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  }
  std::sort(seconds.begin(), seconds.end());
  double sum = 0;
  for (const plan::Rollout& rollout : rollouts) sum += system.robot_center(rollout.to).sum();
  std::printf("%.6f %.9f\n", seconds[2], sum);
}
