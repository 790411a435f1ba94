// What a tree of many full states takes, in memory and as a file: the figures of docs/planning-measured.md,
// "Memory".
//
//   memory_bench [nodes] [vertices] [moving vertices]
//
// Each node hangs on a random earlier one, and differs from it in the vertices that move; the others sleep.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

#include "core/progress.h"
#include "core/random.h"
#include "plan/plan_file.h"

namespace limber::plan {
namespace {

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * double(::sysconf(_SC_PAGESIZE)) / 1e6;
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void measure(int nodes, int vertices, int moving) {
  Rng rng(1, 0);
  State state{0, std::vector<float>(std::size_t(3 * vertices)),
              std::vector<float>(std::size_t(3 * vertices))};
  for (float& x : state.positions) x = float(rng.uniform());
  const double before = resident_mb();
  Plan plan;
  plan.tree.add(state, -1, {}, -1, Vec3f::Zero());
  for (int n = 1; n < nodes; ++n) {
    const int parent = rng.below(n);
    state = plan.tree.states[std::size_t(parent)];
    for (int i = 0; i < 3 * moving; ++i)
      state.positions[std::size_t(i)] = float(rng.uniform()),
      state.velocities[std::size_t(i)] = float(rng.uniform());
    plan.tree.add(state, parent, {}, n - 1, Vec3f(state.positions.data()));
  }
  const double grown = resident_mb() - before;
  const double a_node = double(plan.tree.states.bytes()) / nodes;
  fmt::print("{} nodes of {} vertices, {} of them moving\n", nodes, vertices, moving);
  fmt::print("  a node           {:.0f} bytes of state, {:.0f} where nothing is shared\n", a_node,
             double(plan.tree.states.bytes_unshared()) / nodes);
  fmt::print("  resident         {:.0f} MB more, {:.0f} bytes a node\n", grown, 1e6 * grown / nodes);

  plan.settings.goal.radius_m = 1, plan.trajectory.end = state, plan.trajectory.frames = {state};
  const fs::path file = fs::temp_directory_path() / fmt::format("limber-memory-{}.npz", ::getpid());
  const double start = seconds();
  write_plan(file, plan, {});
  const double written = seconds();
  const bool same = hash_of(read_plan(file).plan.tree) == hash_of(plan.tree);
  fmt::print("  plan.npz         {:.0f} MB, written in {:.1f} s, read in {:.1f} s, {}\n",
             double(fs::file_size(file)) / 1e6, written - start, seconds() - written,
             same ? "the same tree" : "ANOTHER TREE");
  fmt::print("  most resident    {:.0f} MB\n", peak_memory_mb() * 1.048576);
  fs::remove(file);
}

}  // namespace
}  // namespace limber::plan

int main(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  limber::plan::measure(number(1, 100000), number(2, 1000), number(3, 64));
}
