#include "fem/detail/timestep.h"

#include <cmath>

#include "core/random.h"

namespace limber::fem::detail {
namespace {

using Vector = std::vector<double>;

Vec3 row(const Vector& v, int i) { return {v[3 * i], v[3 * i + 1], v[3 * i + 2]}; }
void add(Vector& v, int i, const Vec3& w) {
  for (int c = 0; c < 3; ++c) v[3 * i + c] += w[c];
}

struct Gradient {
  int node[4];
  Vec3 of[4];  // of 6V
  double stiffness;
};

}  // namespace

double highest_frequency2(std::span<const Spring<double>> springs,
                          std::span<const VolumeElement<double>> volumes,
                          const std::vector<double>& positions, const std::vector<double>& inverse_mass) {
  std::vector<Gradient> gradients;
  for (const auto& q : volumes) {
    Gradient g{{q.node[0], q.node[1], q.node[2], q.node[3]}, {}, q.stiffness};
    const Vec3 a = row(positions, q.node[0]);
    const Vec3 b = row(positions, q.node[1]) - a, c = row(positions, q.node[2]) - a,
               d = row(positions, q.node[3]) - a;
    g.of[1] = c.cross(d), g.of[2] = d.cross(b), g.of[3] = b.cross(c);
    g.of[0] = -(g.of[1] + g.of[2] + g.of[3]);
    gradients.push_back(g);
  }
  // Symmetric form M^-½ K M^-½, so that the Rayleigh quotient converges with the square of the vector's
  // error.
  const std::size_t nodes = inverse_mass.size();
  Vector root(nodes), u(3 * nodes), moved(3 * nodes), force(3 * nodes);
  for (std::size_t n = 0; n < nodes; ++n) root[n] = std::sqrt(inverse_mass[n]);
  Rng rng(1, 0);
  for (double& c : u) c = rng.uniform(-1, 1);
  const auto normalize = [&] {
    double norm2 = 0;
    for (double c : u) norm2 += c * c;
    for (double& c : u) c /= std::sqrt(norm2);
  };
  for (std::size_t k = 0; k < 3 * nodes; ++k) u[k] *= root[k / 3] > 0;
  double frequency2 = 0;
  for (int iteration = 0; iteration < 300; ++iteration) {
    normalize();
    for (std::size_t k = 0; k < 3 * nodes; ++k) moved[k] = u[k] * root[k / 3], force[k] = 0;
    for (const auto& s : springs) {
      const Vec3 d = (row(positions, s.j) - row(positions, s.i)).normalized();
      const Vec3 pull = s.stiffness * d.dot(row(moved, s.j) - row(moved, s.i)) * d;
      add(force, s.i, -pull), add(force, s.j, pull);
    }
    for (const Gradient& g : gradients) {
      double rate = 0;
      for (int i = 0; i < 4; ++i) rate += g.of[i].dot(row(moved, g.node[i]));
      for (int i = 0; i < 4; ++i) add(force, g.node[i], g.stiffness * rate * g.of[i]);
    }
    double quotient = 0;
    for (std::size_t k = 0; k < 3 * nodes; ++k) {
      force[k] *= root[k / 3];
      quotient += u[k] * force[k];
    }
    frequency2 = quotient;
    u.swap(force);
  }
  return 1.02 * frequency2;
}

double stable_step(double frequency2, double damping_time) {
  const double frequency = std::sqrt(frequency2), ratio = damping_time * frequency / 2;
  return 2 * (std::sqrt(1 + ratio * ratio) - ratio) / frequency;
}

}  // namespace limber::fem::detail
