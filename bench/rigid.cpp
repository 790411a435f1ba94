// What a rigid body costs beside the same body soft, what a long spin keeps, and how deep a thrown cube goes:
// the figures of docs/dynamics-measured.md, "Rigid bodies".
#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

double cpu_s() { return double(std::clock()) / CLOCKS_PER_SEC; }

State coast(const World& world, const State& state, int steps) {
  Control control;
  control.steps = steps;
  return propagate(world, state, control).end;
}

Vec3 row(const std::vector<float>& v, int n) { return Eigen::Map<const Vec3f>(&v[3 * n]).cast<double>(); }

void print_cost() {
  fmt::print("ns a node of one rollout-step, free, best of five\n nodes  tets      W   rigid    soft\n");
  for (const int cells : {3, 5, 8})
    for (const int lanes : {1, 4, 8, 16}) {
      double ns[2] = {1e9, 1e9};
      int nodes = 0, tets = 0;
      for (const BodyKind kind : {BodyKind::rigid, BodyKind::deformable}) {
        const World world =
            build_world(testing::alone({"cube", testing::cube({0, 0, 0}, 1, cells), {}, {}, kind}));
        nodes = world.nodes, tets = int(world.bodies[0].cage.tets.rows());
        Batch batch(world, lanes);
        State state = rest_state(world);
        std::fill(state.velocities.begin(), state.velocities.end(), 0.01f);
        Control control;
        control.steps = 2000;
        double& best = ns[kind == BodyKind::deformable];
        for (int repeat = 0; repeat < 5; ++repeat) {
          for (int lane = 0; lane < lanes; ++lane) batch.load(lane, state, control);
          const double start = cpu_s();
          batch.advance();
          best = std::min(best, 1e9 * (cpu_s() - start) / control.steps / lanes / nodes);
        }
      }
      fmt::print("{:6}{:6}{:7}{:8.1f}{:8.1f}\n", nodes, tets, lanes, ns[0], ns[1]);
    }
}

void print_spin() {
  const World world = build_world(testing::alone(
      {"brick", testing::grid({-0.5, -0.3, -0.1}, {1, 0.6, 0.2}, 3, 2, 1), {}, {}, BodyKind::rigid}));
  const Body& body = world.bodies[0];
  State state = rest_state(world);
  for (int n = 0; n < world.nodes; ++n)
    Eigen::Map<Vec3f>(&state.velocities[3 * n]) = Vec3(2, 1, -3).cross(row(state.positions, n)).cast<float>();
  const auto spin = [&](const State& s) {
    Vec3 sum = Vec3::Zero();
    for (int n = 0; n < world.nodes; ++n)
      sum += body.node_mass_kg[n] * row(s.positions, n).cross(row(s.velocities, n));
    return sum;
  };
  const auto distortion = [&](const State& s) {
    double worst = 0;
    for (int a = 0; a < world.nodes; ++a)
      for (int b = 0; b < a; ++b)
        worst = std::max(worst, std::abs((row(s.positions, a) - row(s.positions, b)).norm() -
                                         (body.cage.positions.row(a) - body.cage.positions.row(b)).norm()));
    return worst;
  };
  const double energy = kinetic_energy_j(world, state);
  const Vec3 before = spin(state);
  fmt::print("a brick of 1 m spins at 3.7 rad/s, h {:.3g} ms\n    steps   shape, m     energy       spin\n",
             1e3 * world.dt_s);
  for (const int steps : {100, 10'000, 1'000'000}) {
    state = coast(world, state, steps - int(state.step));
    fmt::print("{:9}{:11.1e}{:11.1e}{:11.1e}\n", steps, distortion(state),
               std::abs(kinetic_energy_j(world, state) / energy - 1),
               (spin(state) - before).norm() / before.norm());
  }
}

void print_throws() {
  fmt::print(
      "a cube of 1 m thrown at a plate 0.35 m thick, deepest, mm\n  m/s   rigid at static   soft at static   "
      "rigid at soft   soft at soft\n");
  for (const double speed : {1.0, 2.0, 4.0, 8.0, 16.0}) {
    fmt::print("{:5}", speed);
    for (const BodyKind plate : {BodyKind::immovable, BodyKind::deformable})
      for (const BodyKind cube : {BodyKind::rigid, BodyKind::deformable}) {
        WorldSpec spec = testing::alone({"cube", testing::cube({0, 0, 0}, 1, 3), {}, {}, cube});
        const TetMesh mesh = testing::grid({1, -1.5, -1.1}, {0.35, 3, 2.2}, 2, 6, 4);
        spec.bodies.push_back(
            {"plate",
             mesh,
             {},
             testing::nodes_where(mesh, [](const Vec3& p) { return std::abs(p.y()) > 1.49; }),
             plate});
        const World world = build_world(spec);
        State state = rest_state(world);
        for (int n = 0; n < world.bodies[0].node_count(); ++n) state.velocities[3 * n] = float(speed);
        double deepest = 0;
        for (int i = 0; i < 150; ++i) {
          state = coast(world, state, std::max(1, int(0.02 / speed / world.dt_s)));
          deepest = std::max(deepest, deepest_penetration(world, state).depth_m);
        }
        fmt::print("{:16.1f}", 1e3 * deepest);
      }
    fmt::print("\n");
  }
}

}  // namespace
}  // namespace limber::fem

int main() {
  limber::fem::print_cost();
  limber::fem::print_spin();
  limber::fem::print_throws();
}
