// What a tree of many nodes costs: the nearest of them, and plan.npz. The figures of
// docs/planning-measured.md, "Many nodes".
//
//   nodes_bench [most nodes] [numbers of a state]
//
// Seconds are of the processor. The scan is over all nodes: by distance in a loop that the compiler
// vectorises, by time each first by a bound that is quickly told, but of two carriers.
//
// Nodes are of a random walk in a box, as a search without a goal leaves them: each hangs on an earlier one
// and is a short flight away from it. A third of a state's numbers changes with each.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <limits>

#include "core/error.h"
#include "core/progress.h"
#include "core/random.h"
#include "plan/node_selector.h"
#include "plan/plan_file.h"

namespace limber::plan {
namespace {

double seconds() { return cpu_seconds(); }

const Box bounds{Vec3(0, 0, 0), Vec3(10, 10, 10)};

// A point that flies; the rest of its state stands.
struct Flight final : System {
  bool carried = false;
  Carriers both{{0, 1}, {Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0)}, Vec3::Zero()};

  static Vec3 at(const std::vector<float>& all, int node) {
    return Vec3f(&all[std::size_t(3 * node)]).cast<double>();
  }
  State start() const override { return {}; }
  Vec3 robot_center(const State& s) const override { return at(s.positions, 0); }
  Vec3 robot_velocity(const State& s) const override { return at(s.velocities, 0); }
  double robot_mass_kg() const override { return 1; }
  double mean_speed(const State&) const override { return 0; }
  int robot_nodes() const override { return 1; }
  const Carriers* carriers() const override { return carried ? &both : nullptr; }
  NodePlace node_place(const State& s, int node) const override {
    return {at(s.positions, node), at(s.velocities, node)};
  }
  Box sample_bounds() const override { return bounds; }
  double dt_s() const override { return 0.01; }
  std::uint64_t hash() const override { return 0; }
  Workspace workspace() const override { return {}; }
  std::unique_ptr<Propagator> make_propagator() const override { return nullptr; }
};

Tree grown(int nodes, int numbers) {
  Rng rng(1, 0);
  State state{0, std::vector<float>(std::size_t(numbers), 5), std::vector<float>(std::size_t(numbers))};
  Tree tree;
  tree.add(state, -1, {}, -1, Vec3f::Constant(5));
  for (int n = 1; n < nodes; ++n) {
    const int parent = rng.below(n);
    state = tree.states[std::size_t(parent)];
    for (int i = 0; i < std::max(6, numbers / 3); ++i) {
      float &x = state.positions[std::size_t(i)], &v = state.velocities[std::size_t(i)];
      v = std::clamp(v + float(rng.uniform(-1, 1)), -3.0f, 3.0f);
      x += 0.5f * v;
      if (x < 0 || x > 10) x = std::clamp(x, 0.0f, 10.0f), v = -v;
    }
    state.step += 50;
    Control control;
    control.manipulation = Manipulation::body, control.steps = 50;
    tree.add(state, parent, control, n - 1, Vec3f(state.positions.data()));
  }
  return tree;
}

// All nodes in their order: for a distance tree.h's loop, for a time each first by a bound that is quickly
// told, but of two carriers.
int scanned(const NodeSelector& selector, const Tree& tree, const std::vector<NodePlace>& places,
            const Sample& d, Metric metric, bool carried, double acceleration) {
  if (metric == Metric::distance) return nearest(tree.centers, d.point.cast<float>());
  Nearest found;
  for (int n = 0; n < tree.size(); ++n) {
    const NodePlace& at = places[std::size_t(n)];
    if (!carried &&
        min_time_to_go((d.point - at.place).norm(), at.velocity.norm(), {acceleration}) >= found.cost)
      continue;
    found.offer(selector.cost(d, n), n);
  }
  return found.node;
}

void measure_nearest(const Tree& tree, const char* name, Metric metric, double time_weight, bool carried) {
  Flight flight;
  flight.carried = carried;
  Settings settings;
  settings.max_force_n = 5;
  settings.search_options.metric = metric, settings.search_options.time_weight = time_weight;
  NodeSelector selector(flight, settings, nullptr, 0);
  std::vector<NodePlace> places;
  for (int n = 0; n < tree.size(); ++n) places.push_back(flight.node_place(tree.states[std::size_t(n)], 0));
  const double start = seconds();
  for (int n = 0; n < tree.size(); ++n) selector.add(tree, n);
  const double added = seconds();
  const auto draw = [](int k) {
    Rng rng(7, std::uint64_t(k));
    Sample d;
    for (int axis = 0; axis < 3; ++axis) d.point[axis] = rng.uniform(0, 10);
    d.aside = rng.direction();
    return d;
  };
  const int times = 2000, scans = std::clamp(5'000'000 / tree.size(), 5, times);
  std::vector<int> chosen;
  for (int k = 0; k < times; ++k) chosen.push_back(selector.choose(draw(k)).node);
  const double asked = seconds();
  for (int k = 0; k < scans; ++k) {
    const int node = scanned(selector, tree, places, draw(k), metric, carried, settings.max_force_n);
    LIMBER_CHECK(node == chosen[std::size_t(k)], name, node, chosen[std::size_t(k)]);
  }
  const double scan_ns = 1e9 * (seconds() - asked) / scans, trees_ns = 1e9 * (asked - added) / times;
  fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.1f} | {:.2f} |\n", tree.size(), name, scan_ns, trees_ns,
             scan_ns / trees_ns, 1e6 * (added - start) / tree.size());
  std::fflush(stdout);
}

void measure_nearest(int nodes) {
  const Tree tree = grown(nodes, 6);
  measure_nearest(tree, "distance", Metric::distance, 0, false);
  measure_nearest(tree, "time_to_go", Metric::time_to_go, 0, false);
  measure_nearest(tree, "time_to_go, time_weight 0.1", Metric::time_to_go, 0.1, false);
  measure_nearest(tree, "time_to_go, two carriers", Metric::time_to_go, 0, true);
}

// In a process of its own, whose memory is then its own.
void apart(const std::function<void()>& work) {
  std::fflush(stdout);
  const pid_t child = ::fork();
  LIMBER_CHECK(child >= 0, child);
  if (child == 0) {
    work();
    std::fflush(stdout);
    std::_Exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  LIMBER_CHECK(status == 0, status);
}

void measure_file(int nodes, int numbers) {
  const fs::path file = fs::temp_directory_path() / fmt::format("limber-nodes-{}.npz", ::getpid());
  apart([&] {
    Plan plan;
    plan.tree = grown(nodes, numbers);
    plan.settings.goal.radius_m = 1, plan.settings.max_force_n = 1;
    plan.trajectory.frames = {plan.tree.states[0]}, plan.trajectory.end = plan.tree.states[0];
    const double tree_mb = peak_memory_mb(), start = seconds();
    write_plan(file, plan, {});
    const double written_s = seconds() - start;
    fmt::print("| {} | {:.0f} | {:.0f} | {:.2f} | {:.0f} |", nodes, double(fs::file_size(file)) / nodes,
               tree_mb, written_s, peak_memory_mb() - tree_mb);
  });
  apart([&] {
    const double start = seconds();
    const PlanFile read = read_plan(file);
    fmt::print(" {:.2f} | {:.0f} |\n", seconds() - start, peak_memory_mb());
    LIMBER_CHECK(read.plan.tree.size() == nodes, read.plan.tree.size());
  });
  fs::remove(file);
}

}  // namespace
}  // namespace limber::plan

int main(int argc, char** argv) {
  using namespace limber::plan;
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  const int most = number(1, 1'000'000), numbers = number(2, 192);
  fmt::print(
      "| nodes | bytes a node | MB of the tree | written in (s) | MB more | read in (s) | MB at most |\n"
      "|---|---|---|---|---|---|---|\n");
  for (int nodes = 10'000; nodes <= most; nodes *= 10) measure_file(nodes, numbers);
  fmt::print(
      "\n| nodes | metric | scanned (ns) | through trees (ns) | times | added in (µs) |\n"
      "|---|---|---|---|---|---|\n");
  for (int nodes = 1000; nodes <= most; nodes *= 10) measure_nearest(nodes);
}
