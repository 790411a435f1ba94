// Ligaments are few, and each step computes them in Stepper::add_ligaments, so here is only what is found
// once.
//
// Of the step: in coordinates in which all masses are 1 the stiffness of all is Σ u uᵀ, with u uᵀ of one
// ligament of norm ω² = k/m, m⁻¹ its inverse mass. Its largest eigenvalue is that of the matrix of products
// u·u', which is 0 where they share no body, and at most √(ω² ω'²) else; a row sum bounds it (Gershgorin).
// The same holds for the damping with c/m. Both bounds together are taken for one oscillator, whose limit is
// 2 (√(1 + ζ²) − ζ)/ω (docs/dynamics.md, "Step").
#include "fem/detail/ligaments.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/detail/make_body.h"
#include "fem/detail/overlap.h"

namespace limber::fem::detail {
namespace {

// Of a point in a tet, by its rest shape; they sum to 1, and the least is negative outside.
Eigen::Vector4d weights_in(const Body& body, Eigen::Index tet, const Vec3& point) {
  const Vec3 first = body.cage.positions.row(body.cage.tets(tet, 0)).transpose();
  const Vec3 rest = body.inverse_rest_edges[std::size_t(tet)] * (point - first);
  return {1 - rest.sum(), rest.x(), rest.y(), rest.z()};
}

// The tet that holds the point, or, as far as a tenth of the body's size away, that of the nearest point of
// its cage.
void hang_at_point(const LigamentSpec& spec, const LigamentSpec::End& end, const Body& body,
                   Ligament::End& made) {
  Vec3 point = end.point_m;
  Eigen::Index tet = 0;
  const auto find = [&] {
    double best = -std::numeric_limits<double>::infinity();
    for (Eigen::Index t = 0; t < body.cage.tets.rows(); ++t)
      if (const double least = weights_in(body, t, point).minCoeff(); least > best) best = least, tet = t;
    return best;
  };
  if (find() < 0) {
    const auto corner = [&](int node) -> Vec3 { return body.cage.positions.row(node); };
    Vec3 nearest = corner(body.surface(0, 0));
    for (const auto& t : body.surface.rowwise())
      if (const Vec3 on = nearest_on_triangle(end.point_m, corner(t[0]), corner(t[1]), corner(t[2]));
          (on - point).norm() < (nearest - point).norm())
        nearest = on;
    constexpr double farthest = 0.1;
    if (const double away_m = (nearest - point).norm();
        away_m > farthest * bounding_box(body.cage.positions).diagonal())
      throw InputError(
          fmt::format("ligament {}: its end is {:.3g} m away from body {}, at {:.4g}, {:.4g}, {:.4g} the "
                      "nearest; put it there",
                      spec.name, away_m, body.name, nearest.x(), nearest.y(), nearest.z()));
    point = nearest;
    find();
  }
  Eigen::Vector4d weights = weights_in(body, tet, point).cwiseMax(0);
  weights /= weights.sum();
  for (int i = 0; i < 4; ++i)
    if (weights[i] > 0)
      made.nodes.push_back(body.first_node + body.cage.tets(tet, i)), made.weights.push_back(weights[i]);
}

void hang_in_ball(const LigamentSpec& spec, const LigamentSpec::End& end, const Body& body,
                  Ligament::End& made) {
  double mass = 0;
  for (int n = 0; n < body.node_count(); ++n)
    if ((body.cage.positions.row(n).transpose() - end.point_m).norm() <= end.radius_m) {
      made.nodes.push_back(body.first_node + n), made.weights.push_back(body.node_mass_kg[std::size_t(n)]);
      mass += made.weights.back();
    }
  if (made.nodes.empty())
    throw InputError(
        fmt::format("ligament {}: within {:.3g} m of its end body {} has no node of its cage; enlarge "
                    "radius_m, or leave it out",
                    spec.name, end.radius_m, body.name));
  for (double& weight : made.weights) weight /= mass;
}

// What a force of 1 N at the end gives it at most, m/s².
double inverse_mass(const Ligament::End& end, const World& world) {
  if (end.body < 0) return 0;
  const Body& body = world.bodies[std::size_t(end.body)];
  if (!body.pushed()) return 0;
  double sum = 0;
  if (body.kind == BodyKind::rigid) {
    const Vec3 center = center_of(body, body.cage.positions);
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    for (int n = 0; n < body.node_count(); ++n) {
      const Vec3 r = body.cage.positions.row(n).transpose() - center;
      inertia += body.node_mass_kg[std::size_t(n)] *
                 (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
    }
    Vec3 place = Vec3::Zero();
    for (std::size_t i = 0; i < end.nodes.size(); ++i)
      place += end.weights[i] * body.cage.positions.row(end.nodes[i] - body.first_node).transpose();
    const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues()[0];
    return 1 / body.mass_kg + (place - center).squaredNorm() / least;
  }
  for (std::size_t i = 0; i < end.nodes.size(); ++i) {
    const std::size_t n = std::size_t(end.nodes[i] - body.first_node);
    if (!body.fixed[n]) sum += end.weights[i] * end.weights[i] / body.node_mass_kg[n];
  }
  return sum;
}

bool share_a_body(const Ligament& a, const Ligament& b) {
  return std::any_of(a.ends.begin(), a.ends.end(), [&](const Ligament::End& one) {
    return one.body >= 0 && (one.body == b.ends[0].body || one.body == b.ends[1].body);
  });
}

}  // namespace

Ligament make_ligament(const LigamentSpec& spec, const World& world) {
  const auto require = [&](bool holds, const std::string& why) {
    if (!holds) throw InputError(fmt::format("ligament {}: {}", spec.name, why));
  };
  const auto require_range = [&](const char* name, double value, double lower, double upper) {
    require(value >= lower && value <= upper,
            fmt::format("{} is {}; it must be from {} to {}", name, value, lower, upper));
  };
  require_range("stiffness_n_m", spec.stiffness_n_m, 1e-9, 1e9);
  require_range("damping_ratio", spec.damping_ratio, 0, 2);
  require_range("rest_length", spec.rest_length, 0, 10);
  require(spec.ends[0].body != spec.ends[1].body,
          spec.ends[0].body < 0
              ? "it hangs on no body; name one"
              : "both its ends are on one body; put one of them on another, or in the world");
  Ligament made{spec.name, {}, spec.stiffness_n_m, 0, 0, spec.pushes, 0};
  std::array<Vec3, 2> places;
  for (std::size_t e = 0; e < 2; ++e) {
    const LigamentSpec::End& end = spec.ends[e];
    require(end.body < int(world.bodies.size()), fmt::format("there is no body {}", end.body));
    require(end.point_m.allFinite(), "its end is not finite");
    require_range("radius_m", end.radius_m, 0, 1e9);
    made.ends[e] = {end.body, {}, {}, end.point_m};
    places[e] = end.point_m;
    if (end.body < 0) continue;
    const Body& body = world.bodies[std::size_t(end.body)];
    end.radius_m > 0 ? hang_in_ball(spec, end, body, made.ends[e])
                     : hang_at_point(spec, end, body, made.ends[e]);
    places[e].setZero();
    for (std::size_t i = 0; i < made.ends[e].nodes.size(); ++i)
      places[e] += made.ends[e].weights[i] *
                   body.cage.positions.row(made.ends[e].nodes[i] - body.first_node).transpose();
    made.inverse_mass_per_kg += inverse_mass(made.ends[e], world);
  }
  require(made.inverse_mass_per_kg > 0, "neither of its ends can be moved; hang one on what moves");
  const double length_m = (places[1] - places[0]).norm();
  require(length_m > 1e-6, "its ends are at one place, so it has no direction; part them");
  made.rest_length_m = spec.rest_length * length_m;
  made.damping_n_s_m = 2 * spec.damping_ratio * std::sqrt(spec.stiffness_n_m / made.inverse_mass_per_kg);
  return made;
}

double largest_stable_step(const std::vector<Ligament>& ligaments) {
  double stiffness = 0, damping = 0;  // ω², 1/s² and 2 ζ ω, 1/s
  for (const Ligament& one : ligaments) {
    double row = 0, damping_row = 0;
    for (const Ligament& other : ligaments) {
      if (!share_a_body(one, other)) continue;
      const double masses = std::sqrt(one.inverse_mass_per_kg * other.inverse_mass_per_kg);
      row += masses * std::sqrt(one.stiffness_n_m * other.stiffness_n_m);
      damping_row += masses * std::sqrt(one.damping_n_s_m * other.damping_n_s_m);
    }
    stiffness = std::max(stiffness, row), damping = std::max(damping, damping_row);
  }
  if (stiffness == 0) return std::numeric_limits<double>::infinity();
  const double omega = std::sqrt(stiffness), ratio = damping / (2 * omega);
  return 2 * (std::hypot(1, ratio) - ratio) / omega;
}

}  // namespace limber::fem::detail
