// What dynamics cost, as tables, and that faster is not another program: every instruction set and number of
// lanes must give the same hash, else the exit code is 1. CPU time, best of several short runs that take
// turns, so that a busy machine shows as spread. A tet-step is one pass over every tet and its share of edges
// and nodes, for one rollout.
//   build/bench/dynamics_bench [--repetitions 5] [--quick] [--orders [--cage FILE.msh]] [--json FILE]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "bench/dynamics/bullet.h"
#include "bench/dynamics/count.h"
#include "bench/dynamics/peak.h"
#include "bench/dynamics/unfused.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/detail/kernels.h"
#include "fem/detail/make_tables.h"
#include "fem/detail/stepper.h"
#include "fem/observe.h"
#include "tests/core/node_order.h"
#include "tests/fem/worlds.h"

namespace limber::bench {
namespace {

using fem::Batch;
using fem::Cost;
using fem::InstructionSet;
using fem::MaterialModel;
using fem::World;

using Kernels = fem::detail::Kernels<float>;
using Numbers = std::vector<float, fem::detail::LineAllocator<float>>;

constexpr int rollouts = 16;
constexpr int lane_counts[] = {1, 4, 8, 16};

struct Set {
  InstructionSet set;
  const char* name;
};
std::vector<Set> sets_here() {
  std::vector<Set> sets{{InstructionSet::sse2, "SSE2"}};
  if (fem::detail::machine_has(fem::detail::Isa::avx2)) sets.push_back({InstructionSet::avx2, "AVX2"});
  if (fem::detail::machine_has(fem::detail::Isa::avx512)) sets.push_back({InstructionSet::avx512, "AVX-512"});
  return sets;
}

const char* name_of(MaterialModel model) {
  return model == MaterialModel::springs ? "springs" : "neo_hookean";
}

int moving_tets(const World& world) {
  return int(world.elements.volumes.size() + world.elements.neo_hookeans.size());
}

// Sixteen rollouts of equal length.
struct Work {
  std::string name;
  World world;
  std::vector<State> starts;
  std::vector<Control> controls;
  double tet_steps() const { return double(rollouts) * controls[0].steps * moving_tets(world); }
};

struct Measurement {
  const Work* work;
  Set set;
  int lanes;
  std::vector<double> seconds;  // of the steps alone
  Cost cost;                    // of all repetitions
  std::uint64_t hash = 0;
  double best_ns() const {
    return 1e9 * *std::min_element(seconds.begin(), seconds.end()) / work->tet_steps();
  }
  double spread() const {  // of the middle one over the best
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2] / sorted[0] - 1;
  }
};

double contact_share(const Cost& cost) {  // of the force step
  return cost.force_step_s() > 0 ? cost.contact_s / cost.force_step_s() : 0;
}

void run(Measurement& m) {
  Batch batch(m.work->world, m.lanes, m.set.set);
  Hasher hasher;
  double seconds = 0;
  for (int first = 0; first < rollouts; first += m.lanes) {
    for (int l = 0; l < m.lanes; ++l)
      batch.load(l, m.work->starts[std::size_t(first + l)], m.work->controls[std::size_t(first + l)]);
    const double before = fem::thread_cpu_s();
    batch.advance();
    seconds += fem::thread_cpu_s() - before;
    for (int l = 0; l < m.lanes; ++l) {
      State end;
      batch.store(l, end);
      LIMBER_CHECK(batch.outcome(l).status == fem::RunStatus::ok, batch.outcome(l).reason);
      hasher.value(hash_of(end));
    }
  }
  m.hash = hasher.digest();
  m.seconds.push_back(seconds);
  m.cost += batch.cost();
}

void run_in_turns(std::vector<Measurement>& measurements, int repetitions) {
  for (int r = 0; r < repetitions; ++r)
    for (Measurement& m : measurements) run(m);
}

// The block of the tables in docs/dynamics.md: 0.4 m, six tets a cell.
TetMesh block(const Vec3& lower, int nx, int ny, int nz) {
  return fem::testing::leaning_grid(lower, Vec3::Constant(0.4), nx, ny, nz);
}
struct Cells {
  int x, y, z;
};
constexpr Cells block_sizes[] = {{4, 4, 4}, {7, 7, 8}, {15, 15, 15}};  // 384, 2,352, 20,250 tets
constexpr Cells large{25, 26, 26};                                     // 101,400

fem::BodySpec soft(const char* name, TetMesh mesh, MaterialModel model) {
  fem::BodySpec body;
  body.name = name, body.cage = std::move(mesh), body.material.model = model;
  return body;
}

int steps_for(int tets, double tet_steps) { return std::max(4, int(tet_steps / rollouts / tets)); }

// Stretched, and each rollout stirred in its own way.
Work in_free_space(std::string name, TetMesh mesh, MaterialModel model, double tet_steps) {
  Work work{std::move(name), build_world(fem::testing::alone(soft("block", std::move(mesh), model))), {}, {}};
  Control coast;
  coast.steps = steps_for(moving_tets(work.world), tet_steps);
  Rng rng(51, 0);
  for (int i = 0; i < rollouts; ++i) {
    State state = rest_state(work.world);
    for (float& x : state.positions) x *= 1.05f;
    for (float& v : state.velocities) v = float(rng.uniform(-0.05, 0.05));
    work.starts.push_back(state), work.controls.push_back(coast);
  }
  return work;
}

// The same body with every edge by itself, as kernels walked it before: two lists.
Work with_edges_alone(Work work) {
  using namespace fem::detail;
  const ElementLists& lists = work.world.elements;
  ElementTables<double>& all = work.world.tables64.elements;
  all = {};
  const auto add = [&]<int Kind>(std::integral_constant<int, Kind>, const auto& elements) {
    if (elements.empty()) return;
    all.runs.push_back({Kind, 0, 0, int(elements.size())});
    for (const auto& element : elements) {
      auto& added = std::get<Kind>(all.of_kind).elements.emplace_back();
      std::copy(std::begin(element.node), std::end(element.node), added.node);
      if constexpr (requires { added.law.solid; })
        added.law.solid = element.law;
      else
        added.law = element.law;
    }
  };
  add(std::integral_constant<int, spring_kind>(), lists.springs);
  add(std::integral_constant<int, dashpot_kind>(), lists.dashpots);
  add(std::integral_constant<int, spring_star_kind>(), lists.volumes);
  add(std::integral_constant<int, neo_hookean_star_kind>(), lists.neo_hookeans);
  all.runs_of_body = {{0, int(all.runs.size())}};
  work.world.tables = single_precision(work.world.tables64);
  work.name = "free, edges alone";
  return work;
}

Control push(const Vec3& force_n, int steps) {
  Control control;
  control.manipulation = Manipulation::body;
  control.force_n = force_n.cast<float>();
  control.steps = steps;
  return control;
}

Work in_free_space(const Cells& cells, MaterialModel model, double tet_steps) {
  return in_free_space("free", block({-0.2, -0.2, -0.2}, cells.x, cells.y, cells.z), model, tet_steps);
}

// Sixteen moments of a robot that is pressed by `force_n` for `seconds` and then on, pushed sixteen ways.
Work pressed(std::string name, World world, const Vec3& force_n, double seconds, double tet_steps) {
  Work work{std::move(name), std::move(world), {}, {}};
  State state = rest_state(work.world);
  Rng rng(31, 0);
  const int steps = steps_for(moving_tets(work.world), tet_steps);
  for (int i = 0; i < rollouts; ++i) {
    const double s = i == 0 ? seconds : seconds / rollouts;
    state = propagate(work.world, state, push(force_n, std::max(1, int(s / work.world.dt_s)))).end;
    work.starts.push_back(state);
    work.controls.push_back(push(force_n + 0.3 * force_n.norm() * rng.direction(), steps));
  }
  LIMBER_CHECK(deepest_penetration(work.world, state).depth_m > 0, work.name);
  return work;
}

// The block on a static slab.
Work on_a_slab(const Cells& cells, MaterialModel model, double tet_steps) {
  fem::WorldSpec spec =
      fem::testing::alone(soft("block", block({-0.2, -0.2, 0.001}, cells.x, cells.y, cells.z), model));
  spec.bodies.push_back(
      soft("slab", fem::testing::grid({-0.4, -0.4, -0.1}, {0.8, 0.8, 0.1}, 8, 8, 1), model));
  spec.bodies.back().kind = fem::BodyKind::immovable;
  return pressed("on a slab", build_world(spec), {0, 0, -60}, 0.1, tet_steps);
}

// Two soft blocks of 900 tets, face on face, the far side of the other held.
Work block_on_block(MaterialModel model, double tet_steps) {
  fem::WorldSpec spec = fem::testing::alone(soft("upper", block({-0.2, -0.2, 0.001}, 5, 5, 6), model));
  spec.bodies.push_back(soft("lower", block({-0.15, -0.25, -0.4}, 5, 5, 6), model));
  spec.bodies.back().fixed_nodes =
      fem::testing::nodes_where(spec.bodies.back().cage, [](const Vec3& p) { return p.z() < -0.4 + 1e-9; });
  return pressed("block on block", build_world(spec), {0, 0, -60}, 0.1, tet_steps);
}

// Barriers, the robot on its way over the first plate.
Work over_the_plate(int fineness, MaterialModel model, double tet_steps) {
  fem::Material material;
  material.model = model;
  World world = build_world(fem::testing::barriers(fineness, material));
  Work work{"over the plate", std::move(world), {}, {}};
  State state = rest_state(work.world);
  const auto go = [&](const Vec3& force_n, double seconds) {
    state = propagate(work.world, state, push(force_n, int(seconds / work.world.dt_s))).end;
  };
  go({100, 0, 400}, 0.8);
  Rng rng(31, 0);
  for (int i = 0; i < rollouts; ++i) {
    go({300, 0, 0}, 0.08);
    work.starts.push_back(state);
    work.controls.push_back(push(300 * rng.direction(), steps_for(moving_tets(work.world), tet_steps)));
  }
  return work;
}

// True when all measurements of the same work came to the same state.
bool same_bits(const std::vector<Measurement>& measurements) {
  bool same = true;
  for (const Measurement& m : measurements)
    for (const Measurement& other : measurements)
      if (m.work == other.work && m.hash != other.hash) {
        fmt::print(stderr, "DIFFERENT BITS: {}, {} tets, W = {} on {}: {}, but W = {} on {}: {}\n",
                   m.work->name, moving_tets(m.work->world), m.lanes, m.set.name, hex(m.hash), other.lanes,
                   other.set.name, hex(other.hash));
        same = false;
      }
  return same;
}

Json json_of(const Measurement& m) {
  return {{"work", m.work->name},
          {"tets", moving_tets(m.work->world)},
          {"material", name_of(m.work->world.bodies[0].material.model)},
          {"instructions", m.set.name},
          {"lanes", m.lanes},
          {"ns_a_tet_step", m.best_ns()},
          {"spread", m.spread()},
          {"contact_of_force_step", contact_share(m.cost)},
          {"hash", hex(m.hash)}};
}

Json print_operations(const OperationCounts& counts) {
  fmt::print(
      "\n## Arithmetic of one of each, one lane, counted by running the formulas\n\n"
      "| | + − | × | ÷ | √ | flops | comparisons |\n|---|---|---|---|---|---|---|\n");
  Json json;
  using namespace fem::detail;
  for (const auto& [name, o] : {std::pair("spring alone", counts.of_kind[spring_kind]),
                                std::pair("dashpot alone", counts.of_kind[dashpot_kind]),
                                std::pair("volume of a tet", counts.of_kind[spring_star_kind]),
                                std::pair("with three springs", counts.of_kind[spring_star_kind + 3]),
                                std::pair("Neo-Hookean tet", counts.of_kind[neo_hookean_star_kind]),
                                std::pair("with three dashpots", counts.of_kind[neo_hookean_star_kind + 3]),
                                std::pair("node, integrated", counts.node)}) {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} |\n", name, o.sums, o.products, o.divisions, o.roots,
               o.flops(), o.comparisons);
    json[name] = {{"flops", o.flops()}, {"comparisons", o.comparisons}};
  }
  return json;
}

struct Peak {
  Set set;
  double gflops;
};

double peak_of(const std::vector<Peak>& peaks, const Set& set) {
  for (const Peak& peak : peaks)
    if (peak.set.set == set.set) return peak.gflops;
  LIMBER_CHECK(false, set.name);
}

// One table a work: instruction sets down, lanes across.
void print_table(const std::vector<Measurement>& measurements, const std::vector<Peak>& peaks,
                 const OperationCounts& counts) {
  const Work* work = nullptr;
  const char* set = "";
  for (const Measurement& m : measurements) {
    const double flops = flops_a_tet_step(m.work->world, counts);
    if (m.work != work)
      fmt::print(
          "\n{} tets, {}, {}: {:.0f} flops a tet-step, {} steps, hash {}\n\n"
          "| ns a tet-step; M tet-steps/s; share of peak; spread | W = 1 | W = 4 | W = 8 | W = 16 "
          "|\n|---|---|---|---|---|",
          moving_tets(m.work->world), name_of(m.work->world.bodies[0].material.model), m.work->name, flops,
          m.work->controls[0].steps, hex(m.hash));
    if (m.work != work || m.set.name != set) fmt::print("\n| {} |", m.set.name);
    work = m.work, set = m.set.name;
    fmt::print(" {:.2f}; {:.0f}; {:.0f} %; {:.0f} % |", m.best_ns(), 1e3 / m.best_ns(),
               100 * flops / m.best_ns() / peak_of(peaks, m.set), 100 * m.spread());
  }
  fmt::print("\n");
}

void print_parts(const std::vector<Measurement>& measurements) {
  fmt::print(
      "\n| ns a tet-step, mean of all runs | elastic | integration | contact | contact / force step "
      "|\n|---|---|---|---|---|\n");
  for (const Measurement& m : measurements) {
    const double each = 1e9 / (double(m.cost.steps) * m.lanes * moving_tets(m.work->world));
    fmt::print("| {} tets, {}, {}, W = {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n",
               moving_tets(m.work->world), name_of(m.work->world.bodies[0].material.model), m.work->name,
               m.lanes, each * m.cost.elastic_s, each * m.cost.integration_s, each * m.cost.contact_s,
               m.cost.contact_s / m.cost.force_step_s());
  }
}

void print_moves(const std::vector<Measurement>& measurements) {
  fmt::print("\n| µs to load and to store a lane | load | store |\n|---|---|---|\n");
  for (const Measurement& m : measurements)
    fmt::print("| {} nodes, W = {} | {:.1f} | {:.1f} |\n", m.work->world.moving_nodes, m.lanes,
               1e6 * m.cost.load_s / double(m.cost.loads), 1e6 * m.cost.store_s / double(m.cost.stores));
}

template <class Step>
double best_seconds(int repetitions, const Step& step) {
  double best = 1e30;
  for (int r = 0; r < repetitions; ++r) {
    const double before = fem::thread_cpu_s();
    step();
    best = std::min(best, fem::thread_cpu_s() - before);
  }
  return best;
}

Json compare_with_bullet(const std::vector<Measurement>& free, int repetitions) {
  if (!has_bullet()) {
    fmt::print("\nBullet was not found when this was configured (Debian: libbullet-dev); no comparison.\n");
    return {};
  }
  constexpr double implicit_dt_s = 5e-3;
  fmt::print(
      "\n## Bullet's deformables, Neo-Hookean, the same block and moduli, the same run\n\n"
      "| tets | explicit, ns a tet-step | implicit at {:.0f} ms | limber W = 1 | W = 16 | explicit / W = 1 | "
      "/ W = 16 |\n"
      "|---|---|---|---|---|---|---|\n",
      1e3 * implicit_dt_s);
  Json json = Json::array();
  const char* best = sets_here().back().name;
  for (const Cells& cells : block_sizes) {
    const TetMesh mesh = block({-0.2, -0.2, -0.2}, cells.x, cells.y, cells.z);
    const int tets = int(mesh.tets.rows());
    double ours[2] = {0, 0}, dt_s = 0;
    for (const Measurement& m : free)
      if (moving_tets(m.work->world) == tets && m.set.name == best &&
          m.work->world.bodies[0].material.model == MaterialModel::neo_hookean &&
          (m.lanes == 1 || m.lanes == 16))
        ours[m.lanes == 16] = m.best_ns(), dt_s = m.work->world.dt_s;
    const auto measure = [&](bool implicit, double dt, int steps) {
      BulletBody body(mesh, {}, 1.05, implicit);
      const double ns = 1e9 / tets / steps * best_seconds(repetitions, [&] { body.step(dt, steps); });
      LIMBER_CHECK(std::abs(body.height_m() - 0.4) < 0.1, tets, implicit, body.height_m());
      return ns;
    };
    const double quick = measure(false, dt_s, std::max(4, 100'000 / tets));
    const double slow = measure(true, implicit_dt_s, std::max(1, 5'000 / tets));
    fmt::print("| {} | {:.0f} | {:.0f} | {:.1f} | {:.2f} | {:.1f} | {:.0f} |\n", tets, quick, slow, ours[0],
               ours[1], quick / ours[0], quick / ours[1]);
    json.push_back({{"tets", tets},
                    {"explicit_ns", quick},
                    {"implicit_ns", slow},
                    {"limber_w1_ns", ours[0]},
                    {"limber_w16_ns", ours[1]}});
  }
  fmt::print(
      "\nQuoted, not measured here (one core, Zen 5, the same sizes): Jolt (XPBD) 26.1 to 28.8 ns, "
      "PositionBasedDynamics\n"
      "(XPBD) 52 to 175 ns.\n");
  return json;
}

// Steps of a free body by its kernels alone, without what a Batch does besides: the nodes' places afterwards.
class KernelSteps {
 public:
  KernelSteps(const World& world, const std::vector<State>& starts, int lanes, const Kernels& kernels)
      : world_(world), lanes_(lanes), kernels_(kernels) {
    using namespace fem::detail;
    const Layout at = state_layout(lanes);
    first_velocity_ = lanes == 1 ? 4 : world.nodes * at.node;
    state_.resize(std::size_t(world.nodes) * std::size_t(lanes == 1 ? 8 : 6 * lanes));
    forces_.resize(std::size_t(world.nodes * force_layout(lanes).node));
    found_.resize(std::size_t(7 * lanes));
    for (int n = 0; n < world.nodes; ++n)
      for (int c = 0; c < 3; ++c)
        for (int l = 0; l < lanes; ++l) {
          const State& start = starts[std::size_t(l)];
          state_[std::size_t(at.at(n, c) + l)] = start.positions[std::size_t(3 * n + c)];
          state_[std::size_t(first_velocity_ + at.at(n, c) + l)] = start.velocities[std::size_t(3 * n + c)];
        }
  }
  void take(int steps) {
    fem::detail::Motion<float> motion{
        0,       world_.nodes,  world_.tables.inverse_mass.data(), float(world_.substep_s()),       {}, 1,
        nullptr, found_.data(), &found_[std::size_t(3 * lanes_)],  &found_[std::size_t(6 * lanes_)]};
    const auto elements = fem::detail::elements_of(world_.tables.elements);
    float *const x = state_.data(), *const v = &state_[std::size_t(first_velocity_)];
    for (int s = 0; s < steps; ++s) {
      kernels_.elastic(elements, x, v, forces_.data());
      kernels_.integrate(motion, x, v, forces_.data());
    }
  }
  const Numbers& state() const { return state_; }

 private:
  const World& world_;
  int lanes_, first_velocity_ = 0;
  const Kernels& kernels_;
  Numbers state_, forces_, found_;
};

// Kernels as they were, two lists and each operation rounded by itself, and as they are, one after the other.
// Where they take a body is the same within a hundredth of how far it moved.
Json compare_kernels(const std::vector<const Work*>& works, int repetitions) {
  const Set set = sets_here().back();
  if (set.set == InstructionSet::sse2) return {};
  const bool wide = set.set == InstructionSet::avx512;
  fmt::print(
      "\n## Kernels before and now, {}, steps without a Batch\n\n"
      "| ns a tet-step: two lists and no fused products, two lists, stars and no fused products, now; before "
      "/ now | "
      "W = 1 | W = 4 | W = 8 | W = 16 |\n|---|---|---|---|---|",
      set.name);
  Json json = Json::array();
  for (const Work* work : works) {
    const Work alone = with_edges_alone(*work);
    const int tets = moving_tets(work->world), steps = work->controls[0].steps;
    fmt::print("\n| {}, {} tets |", name_of(work->world.bodies[0].material.model), tets);
    for (int k = 0; k < 4; ++k) {
      const int lanes = lane_counts[k];
      const Kernels &now = fem::detail::kernels<float>(
                        wide ? fem::detail::Isa::avx512 : fem::detail::Isa::avx2, lanes),
                    &unfused = (wide ? fem::detail::unfused_avx512() : fem::detail::unfused_avx2())[k];
      const std::pair<const World*, const Kernels*> ways[] = {
          {&alone.world, &unfused}, {&alone.world, &now}, {&work->world, &unfused}, {&work->world, &now}};
      double best_ns[] = {1e30, 1e30, 1e30, 1e30};
      std::vector<Numbers> ends(4);
      for (int r = 0; r < repetitions; ++r)
        for (int way = 0; way < 4; ++way) {
          KernelSteps body(*ways[way].first, work->starts, lanes, *ways[way].second);
          const double ns = 1e9 / (double(steps) * tets * lanes) * best_seconds(1, [&] { body.take(steps); });
          best_ns[way] = std::min(best_ns[way], ns);
          ends[std::size_t(way)] = body.state();
        }
      const Numbers start = KernelSteps(work->world, work->starts, lanes, now).state();
      for (const Numbers& end : ends) {
        float moved = 0, apart = 0;
        for (std::size_t i = 0; i < end.size(); ++i)
          moved = std::max(moved, std::abs(ends[3][i] - start[i])),
          apart = std::max(apart, std::abs(ends[3][i] - end[i]));
        LIMBER_CHECK(apart <= 0.01f * moved, lanes, apart, moved);
      }
      fmt::print(" {:.2f}, {:.2f}, {:.2f}, {:.2f}; {:.2f} |", best_ns[0], best_ns[1], best_ns[2], best_ns[3],
                 best_ns[0] / best_ns[3]);
      json.push_back({{"material", name_of(work->world.bodies[0].material.model)},
                      {"tets", tets},
                      {"lanes", lanes},
                      {"ns_before", best_ns[0]},
                      {"ns_now", best_ns[3]}});
    }
  }
  fmt::print("\n");
  return json;
}

// The same work in one thread and in two, each with a Batch of its own.
Json compare_threads(const Work& work, int repetitions) {
  const auto million_a_second = [&](int threads) {
    double best = 0;
    for (int r = 0; r < repetitions; ++r) {
      std::vector<Measurement> each(std::size_t(threads), {&work, sets_here().back(), 16, {}, {}, 0});
      const auto before = std::chrono::steady_clock::now();
      std::vector<std::thread> running;
      for (Measurement& m : each) running.emplace_back([&m] { run(m); });
      for (std::thread& t : running) t.join();
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - before;
      best = std::max(best, 1e-6 * threads * work.tet_steps() / wall.count());
    }
    return best;
  };
  const double one = million_a_second(1), two = million_a_second(2);
  fmt::print(
      "\n## Threads\n\n{} tets, springs, W = 16 a thread, loads and stores with it, wall time: {:.0f} M "
      "tet-steps/s in one thread, {:.0f} in two, {:.2f} times.\n",
      moving_tets(work.world), one, two, two / one);
  return {{"one", one}, {"two", two}};
}

// The same mesh with its nodes and tets in other orders: what a step costs, and how far apart the ends of an
// edge are numbered.
Json compare_orders(const std::string& cage_file, int repetitions, double tet_steps) {
  const auto blocks = [](int x, int y, int z) {
    return fem::testing::leaning_grid(Vec3::Zero(), 0.016 * Vec3(x, y, z), x, y, z);
  };
  std::vector<std::pair<std::string, TetMesh>> meshes{{"block", blocks(large.x, large.y, large.z)},
                                                      {"plate, layer by layer", blocks(75, 75, 3)},
                                                      {"plate, row by row", blocks(3, 75, 75)}};
  if (!cage_file.empty()) meshes.push_back({cage_file, read_msh(cage_file)});
  const Set set = sets_here().back();
  fmt::print(
      "\n## Orders of nodes and tets, springs, {}\n\n"
      "| µs a step of one rollout: W = 1, W = 16; mean of |i − j| | as made | shuffled | and banded |\n"
      "|---|---|---|---|\n",
      set.name);
  Json json = Json::array();
  for (const auto& [name, made] : meshes) {
    const TetMesh shuffled = reordered(made, shuffled_order(made, 91));
    const TetMesh banded = reordered(shuffled, banded_order(shuffled));
    std::vector<Work> works;
    for (const TetMesh& mesh : {made, shuffled, banded})
      works.push_back(in_free_space(name, mesh, MaterialModel::springs, tet_steps));
    std::vector<Measurement> measurements;
    for (const Work& work : works)
      for (const int lanes : {1, 16}) measurements.push_back({&work, set, lanes, {}, {}, 0});
    run_in_turns(measurements, repetitions);
    fmt::print("| {}, {} tets |", name, made.tets.rows());
    for (const Measurement& m : measurements) {
      const double step_us = 1e-3 * m.best_ns() * double(made.tets.rows());
      if (m.lanes == 1)
        fmt::print(" {:.0f},", step_us);
      else
        fmt::print(" {:.0f}; {:.0f} |", step_us, mean_bandwidth(m.work->world.bodies[0].cage.tets));
      json.push_back(json_of(m));
    }
    fmt::print("\n");
  }
  return json;
}

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what was measured is seen, however the run ends
  CLI::App program("What dynamics cost.");
  int repetitions = 5;
  bool quick = false;
  std::string json_file;
  program.add_option("--repetitions", repetitions, "runs of each, taken in turns; the best counts")
      ->check(CLI::Range(1, 1000));
  program.add_flag("--quick", quick, "a tenth of the steps, and no large block");
  program.add_option("--json", json_file, "writes the same numbers there");
  bool orders = false;
  std::string cage_file;
  CLI::Option* const of_orders = program.add_flag("--orders", orders, "orders of nodes and tets, no more");
  program.add_option("--cage", cage_file, "a cage.msh besides")->needs(of_orders);
  CLI11_PARSE(program, argc, argv);

  const double tet_steps = quick ? 3e5 : 3e6;
  if (orders) {
    const Json json = compare_orders(cage_file, repetitions, 2 * tet_steps);
    if (!json_file.empty()) write_json(json_file, json);
    return 0;
  }
  const std::vector<Set> sets = sets_here();
  if (sets.size() < 3)
    fmt::print("This machine has no {}; no rows for it.\n", sets.size() < 2 ? "AVX2" : "AVX-512");
  const OperationCounts counts = count_operations();
  Json json;
  json["operations"] = print_operations(counts);

  // The peak is taken before and after, so that it has the best of the machine's moods too.
  std::vector<Peak> peaks;
  for (const Set& set : sets) peaks.push_back({set, 0});
  const auto look_for_peak = [&] {
    for (Peak& peak : peaks)
      for (int r = 0; r < repetitions; ++r) peak.gflops = std::max(peak.gflops, peak_gflops(peak.set.set));
  };
  look_for_peak();

  const auto measured = [&](const std::vector<Work>& works, const std::vector<Set>& with) {
    std::vector<Measurement> measurements;
    for (const Work& work : works)
      for (const Set& set : with)
        for (const int lanes : lane_counts) measurements.push_back({&work, set, lanes, {}, {}, 0});
    run_in_turns(measurements, repetitions);
    look_for_peak();
    for (const Measurement& m : measurements) json["measurements"].push_back(json_of(m));
    return measurements;
  };
  constexpr MaterialModel models[] = {MaterialModel::springs, MaterialModel::neo_hookean};
  std::vector<Work> free_works, slab_works, contact_works;
  for (const Cells& cells : block_sizes)
    for (const MaterialModel model : models) {
      free_works.push_back(in_free_space(cells, model, tet_steps));
      slab_works.push_back(on_a_slab(cells, model, tet_steps));
    }
  contact_works.push_back(block_on_block(MaterialModel::springs, tet_steps));
  for (const int fineness : {1, 2})
    contact_works.push_back(over_the_plate(fineness, MaterialModel::springs, tet_steps));

  const auto free = measured(free_works, sets), slab = measured(slab_works, sets);
  const auto contact = measured(contact_works, {sets.back()});
  std::vector<Work> alone_works;
  for (const std::size_t k : {2, 3}) alone_works.push_back(with_edges_alone(free_works[k]));
  const auto alone = measured(alone_works, {sets.back()});
  fmt::print("\nPeak of one core, Gflop/s, independent multiply-adds (SSE2: a product and a sum):");
  for (const Peak& peak : peaks) {
    fmt::print(" {} {:.0f}", peak.set.name, peak.gflops);
    json["peak_gflops"][peak.set.name] = peak.gflops;
  }
  fmt::print(".\n\n## In free space\n");
  print_table(free, peaks, counts);
  print_table(alone, peaks, counts);
  fmt::print("\n## Pressed on a static slab\n");
  print_table(slab, peaks, counts);
  fmt::print("\n## Where a step goes, {}\n", sets.back().name);
  std::vector<Work> long_works = free_works;  // long enough to be sampled
  for (Work& work : long_works)
    for (Control& control : work.controls) control.steps = std::max(control.steps, 3 * Cost::sampled);
  std::vector<Measurement> shown;
  for (const Work& work : long_works)
    for (const int lanes : {1, 16})
      run(shown.emplace_back(Measurement{&work, sets.back(), lanes, {}, {}, 0}));
  for (const Measurement& m : contact)
    if (m.lanes == 1 || m.lanes == 16) shown.push_back(m);
  print_parts(shown);
  std::erase_if(shown, [](const Measurement& m) {
    return m.work->name != "free" || m.work->world.bodies[0].material.model != MaterialModel::springs;
  });
  print_moves(shown);
  const double clock_s = best_seconds(5,
                                      [] {
                                        for (int i = 0; i < 1000; ++i) fem::thread_cpu_s();
                                      }) /
                         1000;
  fmt::print("\nLooking at the clock takes {:.0f} ns, five times in {} steps.\n", 1e9 * clock_s,
             Cost::sampled);
  json["bullet"] = compare_with_bullet(free, repetitions);
  json["kernels"] = compare_kernels({&free_works[2], &free_works[3]}, repetitions);
  json["threads"] = compare_threads(free_works[2], repetitions);

  bool same = same_bits(free) & same_bits(alone) & same_bits(slab) & same_bits(contact);
  if (!quick) {
    const double before_mb = peak_memory_mb();
    std::vector<Work> works;
    for (const MaterialModel model : models) works.push_back(in_free_space(large, model, 2 * tet_steps));
    const auto measurements = measured(works, {sets.back()});
    fmt::print("\n## Large\n");
    print_table(measurements, peaks, counts);
    fmt::print(
        "\nMemory grew by {:.0f} MB for both worlds, with their sixteen states before and after, and a "
        "Batch.\n",
        peak_memory_mb() - before_mb);
    same &= same_bits(measurements);
  }
  fmt::print("\n{}\n", same ? "Same bits everywhere." : "DIFFERENT BITS: see above.");
  if (!json_file.empty()) write_json(json_file, json);
  return same ? 0 : 1;
}

}  // namespace
}  // namespace limber::bench

int main(int argc, char** argv) {
  try {
    return limber::bench::main(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
