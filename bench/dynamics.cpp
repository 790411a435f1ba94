// What a step costs: ns a tet-step (one pass over every tet and its share of edges, integration, contact) of
// one rollout, CPU time, with the hash of the state that came out beside it. A faster run with another hash
// is another program.
//   build/bench/dynamics_bench
#include <benchmark/benchmark.h>

#include "core/hash.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

Control push(const Vec3f& force_n, int steps) {
  Control control;
  control.manipulation = Manipulation::body;
  control.force_n = force_n;
  control.steps = steps;
  return control;
}

void measure(benchmark::State& bench, const World& world, const std::vector<State>& starts,
             const std::vector<Control>& controls) {
  const int lanes = int(bench.range(1));
  Batch batch(world, lanes);
  std::vector<Rollout> rollouts;
  for (std::size_t i = 0; i < controls.size(); ++i) rollouts.push_back({&starts[i], controls[i], {}, {}});
  for (auto _ : bench) propagate(batch, rollouts);
  Hasher hasher;
  double tet_steps = 0;
  for (const Rollout& rollout : rollouts) {
    hasher.value(hash_of(rollout.end));
    tet_steps += double(rollout.control.steps) * double(world.tables.elements.volumes.elements.size() +
                                                        world.tables.elements.neo_hookeans.elements.size());
  }
  bench.counters["ns_a_tet_step"] = benchmark::Counter(
      tet_steps, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  bench.SetLabel(hex(hasher.digest()));
}

World barriers(const benchmark::State& bench) {
  Material material;
  material.model = MaterialModel(bench.range(2));
  return build_world(testing::barriers(int(bench.range(0)), material));
}

// Barriers, nothing touches: the force step alone.
void free_flight(benchmark::State& bench) {
  const World world = barriers(bench);
  const std::vector<State> starts(16, rest_state(world));
  measure(bench, world, starts, std::vector<Control>(16, push({10, 0, 0}, 200)));
}

// Barriers, the robot at sixteen moments of a way over the first plate, pushed sixteen ways.
void over_the_plate(benchmark::State& bench) {
  const World world = barriers(bench);
  State state = rest_state(world);
  const auto go = [&](const Vec3f& force_n, double seconds) {
    state = propagate(world, state, push(force_n, int(seconds / world.dt_s))).end;
  };
  go({100, 0, 400}, 0.8);
  std::vector<State> starts;
  std::vector<Control> controls;
  Rng rng(31, 0);
  for (int i = 0; i < 16; ++i) {
    go({300, 0, 0}, 0.08);
    starts.push_back(state);
    controls.push_back(push((300 * rng.direction()).cast<float>(), 200));
  }
  measure(bench, world, starts, controls);
}

BENCHMARK(free_flight)
    ->ArgNames({"fineness", "lanes", "neo_hookean"})
    ->ArgsProduct({{1, 2}, {1, 4, 8, 16}, {0, 1}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(over_the_plate)
    ->ArgNames({"fineness", "lanes", "neo_hookean"})
    ->ArgsProduct({{1, 2}, {1, 4, 8, 16}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace limber::fem

BENCHMARK_MAIN();
