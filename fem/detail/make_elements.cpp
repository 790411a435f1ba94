// From the material of a body to the elements of its cage. L and V are the length of an edge and the volume
// of a tet, D and V₀ the same at rest, μ and λ Lamé's constants; energies are joules.
//
// - `springs` (Teschner, Heidelberger, Müller and Gross 2004, as Rodriguez, Lien and Amato 2006 use them):
//   E = ½ k_D ((L − D)/D)² for every edge, and E = ½ k_V ((V − V₀)/V₀)² for every tet.
// - `neo_hookean` (stable Neo-Hookean, Smith, de Goes and Kim 2018): for every tet V₀ Ψ, with
//     Ψ = ½ μ' (I − 3 − ln(I + 1)) + ½ λ' (J − α)²,    I = tr FᵀF,    J = det F.
//
// What always holds: at small strain either has the moduli asked for, springs as well as the mesh lets
// them. Damping acts along the gradients of the same constraints with k_d = τ k, so it takes neither
// momentum nor rigid motion, and is the same for any mesh and step. A body of one modulus throughout has
// the same bits whether or not it is given tet by tet.
//
// Tried and not kept (docs/dynamics.md, "Traps"): choosing the stiffness of springs tet by tet. Six springs
// of one tet are not isotropic, and a corner tet by itself wants more weight on the axes where the
// assembled grid wants less; so stiffness is fitted over the tets round a node (spring_weights.h).
#include "fem/detail/make_elements.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/LU>

#include "core/log.h"
#include "core/threads.h"
#include "fem/detail/locking.h"
#include "fem/detail/make_body.h"
#include "fem/detail/spring_weights.h"
#include "fem/detail/tet_edges.h"
#include "fem/detail/timestep.h"
#include "fem/stiffness_share.h"

namespace limber::fem::detail {
namespace {

// Inverted tets are pushed back with at least this many μV. Near ν = ¼ the volume term vanishes and six
// springs are content with a mirrored tet; with this they are not (docs/dynamics.md, "Inversion").
constexpr double inversion_stiffness = 6;

std::vector<double> tet_volumes(const TetMesh& mesh) {
  std::vector<double> volumes;
  const auto& x = mesh.positions;
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    const auto q = mesh.tets.row(t);
    volumes.push_back(signed_volume(x.row(q[0]), x.row(q[1]), x.row(q[2]), x.row(q[3])));
  }
  return volumes;
}

// τ in k_d = τ k, seconds: 2ζ/ω₁ with ω₁ = π √(E/ρ)/V^⅓, the lowest longitudinal mode of a cube that has
// the body's volume and all of this tet's material. That mode then has the damping ratio ζ that was asked
// for.
double damping_time(const Body& body, int tet) {
  const double speed = std::sqrt(body.youngs_modulus_from_tet_pa[tet] / body.density_from_tet_kg_m3[tet]);
  const double frequency = M_PI * speed / std::cbrt(body.rest_volume_m3);
  return 2 * body.material.damping_ratio / frequency;
}

// μ = E / 2(1+ν) and λ = E ν / (1+ν)(1−2ν) of a tet, in Pa, times the body's share of stiffness.
Lame lame_of(const Body& body, int tet) {
  const double young = body.stiffness_share * body.youngs_modulus_from_tet_pa[tet],
               poisson = body.material.poisson_ratio;
  return {young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))};
}

// Each edge of the mesh once, with what its tets are together: the sum of of_tet(t) over them, or the
// least.
enum class Together { sum, least };
using OverEdges = std::map<std::pair<int, int>, double>;
template <class OfTet>
OverEdges over_edges(const Body& body, Together how, const OfTet& of_tet) {
  OverEdges values;
  for (int t = 0; t < body.cage.tets.rows(); ++t)
    for (const auto& [i, j] : tet_edges) {
      const auto [at, is_new] =
          values.try_emplace(std::minmax(body.cage.tets(t, i), body.cage.tets(t, j)), of_tet(t));
      if (!is_new)
        at->second = how == Together::sum ? at->second + of_tet(t) : std::min(at->second, of_tet(t));
    }
  return values;
}

// τ of edges. An edge between parts has most of its stiffness from the stiffest, and so takes its τ, the
// least.
OverEdges damping_times(const Body& body) {
  return over_edges(body, Together::least, [&](int t) { return damping_time(body, t); });
}

// Springs, on the body's own node numbers. Edges in all directions with Σ k_D = 15 μV have the shear
// modulus μ and, as central forces must, λ = μ. So each tet gives each of its six edges 2.5 μV, and its
// volume term has what is missing, k_V = (λ − μ)V. The even shares are then fitted to the mesh. Laws are
// stored as kernels.h has them: k/D² for lengths, k/(6V₀)² for six times the volume.
void make_springs(const Body& body, ElementLists& lists) {
  const auto& x = body.cage.positions;
  const std::vector<double> volumes = tet_volumes(body.cage);
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const auto [mu, lambda] = lame_of(body, t);
    const double tau = damping_time(body, t);
    const auto q = body.cage.tets.row(t);
    const double v = volumes[t], k = (lambda - mu) * v, scale = 1 / (36 * v * v);
    const double inverted = std::max(0.0, inversion_stiffness * mu * v - k);
    lists.volumes.push_back(
        {{q[0], q[1], q[2], q[3]}, {6 * v, k * scale, inverted * scale, tau * k * scale}});
  }
  // Shares are fitted as if the body were all of one material: where parts meet, an affine strain has to
  // leave a pull, and a fit would take that for a fault of the mesh. Then an edge gets its share times the
  // mean modulus of its tets, by volume.
  const double young = body.youngs_modulus_from_tet_pa[0], mu = lame_of(body, 0).mu;
  std::vector<double> mu_volume;
  for (const double v : volumes) mu_volume.push_back(mu * v);
  const OverEdges volume_round = over_edges(body, Together::sum, [&](int t) { return volumes[t]; });
  const OverEdges stiffness_round = over_edges(
      body, Together::sum, [&](int t) { return body.youngs_modulus_from_tet_pa[t] / young * volumes[t]; });
  const OverEdges taus = damping_times(body);
  for (const auto& [edge, share] : isotropic_springs(body.cage, mu_volume)) {
    const double rest = (x.row(edge.first) - x.row(edge.second)).norm();
    const double k = share * (stiffness_round.at(edge) / volume_round.at(edge)), tau = taus.at(edge);
    lists.springs.push_back({{edge.first, edge.second}, {rest, k / (rest * rest), tau * k / (rest * rest)}});
  }
}

// Stable Neo-Hookean, on the body's own node numbers. With μ' = 4/3 μ, λ' = λ + 5/6 μ and α = 1 + ¾ μ'/λ'
// small strains have Lamé's moduli exactly, on any mesh. The J part is the volume law of springs with α V₀
// for V₀. For the other, I = tr FᵀF = tr(EᵀE M) with E the edges from node 0 as columns and M = (E₀ᵀE₀)⁻¹,
// so no F is needed; stored is μ'V₀ M. Damping is that of springs of the same material, as dashpots along
// the edges.
void make_neo_hookean(const Body& body, ElementLists& lists) {
  const auto& x = body.cage.positions;
  const std::vector<double> volumes = tet_volumes(body.cage);
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const auto q = body.cage.tets.row(t);
    const auto [lame_mu, lame_lambda] = lame_of(body, t);
    const double mu = 4.0 / 3 * lame_mu, lambda = lame_lambda + 5.0 / 6 * lame_mu;
    const double tau = damping_time(body, t);
    const double v = volumes[t], scale = 1 / (36 * v * v);
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = x.row(q[i + 1]) - x.row(q[0]);
    const Eigen::Matrix3d m = mu * v * (edges.transpose() * edges).inverse();
    const double damping = tau * std::max(0.0, lame_lambda - lame_mu) * v * scale;
    lists.neo_hookeans.push_back({{q[0], q[1], q[2], q[3]},
                                  {{6 * v * (1 + 0.75 * mu / lambda), lambda * v * scale, 0, damping},
                                   {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)},
                                   mu * v}});
  }
  const OverEdges taus = damping_times(body);
  for (const auto& [edge, k] :
       over_edges(body, Together::sum, [&](int t) { return 2.5 * lame_of(body, t).mu * volumes[t]; })) {
    const double rest = (x.row(edge.first) - x.row(edge.second)).norm(), tau = taus.at(edge);
    lists.dashpots.push_back({{edge.first, edge.second}, {tau * k / (rest * rest)}});
  }
}

}  // namespace

ElementLists make_elements(const Body& body) {
  ElementLists elements;
  body.material.model == MaterialModel::springs ? make_springs(body, elements)
                                                : make_neo_hookean(body, elements);
  return elements;
}

// Linear tets are too stiff, and coarse ones more so. The share is by how much all stiffness of a body is
// to be multiplied so that it gives way to its softest loads as its material would (locking.h).
void find_stiffness_shares(std::vector<Body>& bodies) {
  parallel_for(int(bodies.size()), [&](int b) {
    Body& body = bodies[std::size_t(b)];
    if (body.stiffness_share > 0) return;
    body.stiffness_share = 1;
    if (!body.moving || body.kind != BodyKind::deformable || !body.material.mesh_independent) return;
    std::vector<Lame> of_tet;
    for (int t = 0; t < body.cage.tets.rows(); ++t) of_tet.push_back(lame_of(body, t));
    const LockingShare found =
        locking_share(body.cage, body.fixed, of_tet, body.node_mass_kg, make_elements(body));
    body.stiffness_share = found.share;
    if (!found.is_found)
      log::warn(
          "body {}: by how much its cage is too stiff is a guess, {:.3f}: its tets or their moduli are too "
          "unlike (docs/dynamics.md, \"One material, any mesh\"); make a cage of other tets",
          body.name, found.share);
  });
}

}  // namespace limber::fem::detail

double limber::fem::stiffness_share_of(const BodySpec& spec) {
  std::vector<Body> one{detail::make_body(spec)};
  detail::find_stiffness_shares(one);
  return one[0].stiffness_share;
}

namespace limber::fem::detail {

// 2 (√(1 + ζ²) − ζ)/ω with ω and ζ of the fastest mode at rest (timestep.h). Fixed nodes do not move: their
// inverse mass is 0.
double largest_stable_step(const Body& body, const ElementLists& elements) {
  const std::vector<double> positions(body.cage.positions.data(),
                                      body.cage.positions.data() + body.cage.positions.size());
  std::vector<double> inverse_mass;
  for (int n = 0; n < body.node_count(); ++n)
    inverse_mass.push_back(body.fixed[n] ? 0 : 1 / body.node_mass_kg[n]);
  return stable_step(fastest_mode(elements, positions, inverse_mass));
}

}  // namespace limber::fem::detail
