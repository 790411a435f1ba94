#include "fem/detail/timestep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "fem/detail/make_stars.h"

namespace limber::fem::detail {
namespace {

using Values = std::vector<double>;

// Differences are taken over this share of the shortest edge: their error is its square.
constexpr double nudge = 1e-5;
constexpr int iterations = 300;
constexpr double margin = 1.02;  // the iteration comes from below

double shortest_edge(const ElementLists& lists, const Values& x) {
  double shortest2 = std::numeric_limits<double>::infinity();
  const auto look_at = [&](const auto& edges) {
    for (const auto& edge : edges) {
      double length2 = 0;
      for (int c = 0; c < 3; ++c) length2 += std::pow(x[3 * edge.node[1] + c] - x[3 * edge.node[0] + c], 2);
      shortest2 = std::min(shortest2, length2);
    }
  };
  look_at(lists.springs), look_at(lists.dashpots);
  return std::sqrt(shortest2);
}

}  // namespace

std::vector<double> forces_of(const ElementTables<double>& elements, const Values& positions,
                              const Values& velocities) {
  const Layout state = state_layout(1), force = force_layout(1);
  const int nodes = int(positions.size()) / 3;
  Values records(std::size_t(nodes * state.node), 0.0), f(std::size_t(nodes * force.node), 0.0), forces;
  for (int n = 0; n < nodes; ++n)
    for (int c = 0; c < 3; ++c) {
      records[state.at(n, c)] = positions[3 * n + c];
      records[state.at(n, c) + 4] = velocities[3 * n + c];
    }
  kernels<double>(best_isa(), 1).elastic(elements_of(elements), records.data(), records.data() + 4, f.data());
  for (int n = 0; n < nodes; ++n)
    for (int c = 0; c < 3; ++c) forces.push_back(f[force.at(n, c)]);
  return forces;
}

FastestMode fastest_mode(const ElementLists& lists, const Values& rest, const Values& inverse_mass) {
  const ElementTables<double> elements = stars_of(lists);
  const double shortest = shortest_edge(lists, rest);
  // Symmetric form M^-½ K M^-½, so that the Rayleigh quotient converges with the square of the vector's
  // error.
  const std::size_t numbers = rest.size();
  Values root(numbers), u(numbers), moved(numbers), back(numbers), velocity(numbers);
  const Values still(numbers, 0.0);
  for (std::size_t k = 0; k < numbers; ++k) root[k] = std::sqrt(inverse_mass[k / 3]);
  Rng rng(1, 0);
  for (std::size_t k = 0; k < numbers; ++k) u[k] = rng.uniform(-1, 1) * (root[k] > 0);
  double frequency2 = 0, rate = 0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    double norm2 = 0, farthest = 0;
    for (double c : u) norm2 += c * c;
    for (double& c : u) c /= std::sqrt(norm2);
    for (std::size_t k = 0; k < numbers; ++k) farthest = std::max(farthest, std::abs(root[k] * u[k]));
    const double step = nudge * shortest / farthest;
    for (std::size_t k = 0; k < numbers; ++k) {
      velocity[k] = root[k] * u[k];
      moved[k] = rest[k] + step * velocity[k];
      back[k] = rest[k] - step * velocity[k];
    }
    const Values ahead = forces_of(elements, moved, still), behind = forces_of(elements, back, still);
    const Values drag = iteration + 1 < iterations ? still : forces_of(elements, rest, velocity);
    frequency2 = rate = 0;
    for (std::size_t k = 0; k < numbers; ++k) {
      const double ku = root[k] * (behind[k] - ahead[k]) / (2 * step);
      frequency2 += u[k] * ku;
      rate -= velocity[k] * drag[k];
      u[k] = ku;
    }
  }
  frequency2 *= margin, rate *= margin;
  return {frequency2, rate / (2 * std::sqrt(frequency2))};
}

double stable_step(const FastestMode& mode) {
  const double zeta = mode.damping_ratio;
  return 2 * (std::sqrt(1 + zeta * zeta) - zeta) / std::sqrt(mode.frequency2);
}

}  // namespace limber::fem::detail
