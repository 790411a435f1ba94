#include "fem/world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include <Eigen/LU>

#include "core/error.h"
#include "core/threads.h"
#include "fem/detail/locking.h"
#include "fem/detail/make_surface_tables.h"
#include "fem/detail/overlap.h"
#include "fem/detail/spring_weights.h"
#include "fem/detail/start.h"
#include "fem/detail/timestep.h"

namespace limber::fem {
namespace {

using detail::ElementTables;
using detail::Topology;

// Share of the largest stable elastic step that is taken: contact needs the rest (docs/contact.md).
// Neo-Hookean tets stiffen when stretched, and so need more.
constexpr double step_safety = 1.0 / 3, neo_hookean_step_safety = 0.25;
// Of a world in which only rigid bodies move, and so no elastic step exists.
constexpr double rigid_step_s = 1e-3;
// Inverted tets are pushed back with at least this many μV, which springs cannot hold against
// (docs/dynamics.md).
constexpr double inversion_stiffness = 6;

constexpr int tet_edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

void require_range(const BodySpec& spec, const std::string& name, double value, double lower, double upper,
                   const char* text) {
  if (!(value >= lower && value <= upper))
    throw InputError(fmt::format("body {}: {} is {}; it must be {}", spec.name, name, value, text));
}

void check(const BodySpec& spec) {
  validate(spec.cage, fmt::format("body {}: cage", spec.name));
  const Material& m = spec.material;
  const auto require_modulus = [&](const std::string& name, double value) {
    require_range(spec, name, value, 1e-3, 1e13, "from 0.001 to 1e13");
  };
  const auto require_density = [&](const std::string& name, double value) {
    require_range(spec, name, value, 1e-9, 1e6, "from 1e-9 to 1e6");
  };
  const std::size_t tets = std::size_t(spec.cage.tets.rows());
  const auto &moduli = spec.youngs_modulus_from_tet_pa, &densities = spec.density_from_tet_kg_m3;
  LIMBER_CHECK(moduli.empty() || moduli.size() == tets, moduli.size(), tets);
  LIMBER_CHECK(densities.empty() || densities.size() == tets, densities.size(), tets);
  for (std::size_t t = 0; t < moduli.size(); ++t)
    require_modulus(fmt::format("youngs_modulus_pa of tet {}", t), moduli[t]);
  for (std::size_t t = 0; t < densities.size(); ++t)
    require_density(fmt::format("density_kg_m3 of tet {}", t), densities[t]);
  require_modulus("youngs_modulus_pa", m.youngs_modulus_pa);
  if (m.model == MaterialModel::springs)
    require_range(spec, "poisson_ratio", m.poisson_ratio, 0.25, 0.495, "from 0.25 to 0.495 for springs");
  else
    require_range(spec, "poisson_ratio", m.poisson_ratio, 0, 0.495, "from 0 to 0.495");
  require_density("density_kg_m3", m.density_kg_m3);
  require_range(spec, "damping_ratio", m.damping_ratio, 0, 1, "from 0 to 1");
  require_range(spec, "friction", m.friction, 0, 2, "from 0 to 2");
  const int nodes = int(spec.cage.positions.rows());
  for (int n : spec.fixed_nodes)
    if (n < 0 || n >= nodes)
      throw InputError(
          fmt::format("body {}: fixed node {} does not exist; nodes are 0 to {}", spec.name, n, nodes - 1));
  for (std::size_t k = 0; k < spec.track.keyframes.size(); ++k)
    if (!(spec.track.keyframes[k].at_s > (k == 0 ? 0 : spec.track.keyframes[k - 1].at_s)))
      throw InputError(fmt::format("body {}: keyframe {} is at {} s; keyframes begin after 0 and ascend",
                                   spec.name, k, spec.track.keyframes[k].at_s));
  if (!spec.velocity_m_s.allFinite() || !spec.angular_velocity_rad_s.allFinite())
    throw InputError(fmt::format("body {}: its velocity at the start is not finite", spec.name));
  if (spec.kind == BodyKind::rigid && !spec.fixed_nodes.empty())
    throw InputError(fmt::format(
        "body {}: node {} of a rigid body is fixed; fix none, or make the body immovable or deformable",
        spec.name, spec.fixed_nodes.front()));
  std::vector<bool> used(std::size_t(nodes), false);
  for (int t = 0; t < spec.cage.tets.rows(); ++t)
    for (int i = 0; i < 4; ++i) used[spec.cage.tets(t, i)] = true;
  for (int n = 0; n < nodes; ++n)
    if (!used[n])
      throw InputError(
          fmt::format("body {}: node {} belongs to no tet and so has no mass; remove it", spec.name, n));
  // Float32 resolves 6e-8 of a coordinate; forces need the edges to a thousandth.
  const double far = spec.cage.positions.cwiseAbs().maxCoeff();
  double shortest = 1e300;
  for (int t = 0; t < spec.cage.tets.rows(); ++t)
    for (const auto& [i, j] : tet_edges)
      shortest = std::min(shortest, (spec.cage.positions.row(spec.cage.tets(t, i)) -
                                     spec.cage.positions.row(spec.cage.tets(t, j)))
                                        .norm());
  if (far * 6e-8 > 1e-3 * shortest)
    throw InputError(fmt::format(
        "body {}: its shortest edge, {:.3g} m, is too short for coordinates of {:.3g} m in float32; "
        "move the scene to the origin or mesh coarser",
        spec.name, shortest, far));
}

Body make_body(const BodySpec& spec) {
  check(spec);
  Body body;
  body.name = spec.name;
  body.material = spec.material;
  body.cage = spec.cage;
  body.cage.positions = spec.cage.positions.cast<float>().cast<double>();
  validate(body.cage, fmt::format("body {}: cage in float32", spec.name));
  body.surface = boundary_triangles(body.cage.tets);
  body.surface_nodes = vertices_of(body.surface);
  const int nodes = body.node_count();
  body.kind = spec.kind;
  body.velocity_m_s = spec.velocity_m_s, body.angular_velocity_rad_s = spec.angular_velocity_rad_s;
  body.track = spec.track;
  const bool kinematic = spec.kind == BodyKind::kinematic;
  body.fixed.assign(std::size_t(nodes), spec.kind == BodyKind::immovable || kinematic);
  body.max_volume_change = spec.max_volume_change;
  body.shape = spec.shape;
  body.max_stretch = spec.max_stretch;
  body.self_contact = spec.self_contact && spec.kind == BodyKind::deformable;
  for (int n : spec.fixed_nodes) body.fixed[n] = true;
  body.moving = kinematic || std::find(body.fixed.begin(), body.fixed.end(), false) != body.fixed.end();
  body.node_mass_kg.assign(std::size_t(nodes), 0.0);
  body.phong = spec.phong && spec.shape && body.moving && spec.kind == BodyKind::deformable;
  body.rest_volume_m3 = volume(body.cage);
  const std::size_t tets = std::size_t(spec.cage.tets.rows());
  body.youngs_modulus_from_tet_pa = spec.youngs_modulus_from_tet_pa;
  body.youngs_modulus_from_tet_pa.resize(tets, body.material.youngs_modulus_pa);
  body.density_from_tet_kg_m3 = spec.density_from_tet_kg_m3;
  body.density_from_tet_kg_m3.resize(tets, body.material.density_kg_m3);
  body.mass_kg = body.material.density_kg_m3 * body.rest_volume_m3;
  body.stiffness_share = 1;
  body.elastic_dt_limit_s = std::numeric_limits<double>::infinity();
  const auto& x = body.cage.positions;
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const auto q = body.cage.tets.row(t);
    const double v = signed_volume(x.row(q[0]), x.row(q[1]), x.row(q[2]), x.row(q[3]));
    const double density = body.density_from_tet_kg_m3[t];
    body.mass_kg += (density - body.material.density_kg_m3) * v;
    for (int i = 0; i < 4; ++i) body.node_mass_kg[q[i]] += density * v / 4;
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = x.row(q[i + 1]) - x.row(q[0]);
    body.inverse_rest_edges.push_back(edges.inverse());
  }
  return body;
}

std::vector<double> tet_volumes(const TetMesh& mesh) {
  std::vector<double> volumes;
  const auto& x = mesh.positions;
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    const auto q = mesh.tets.row(t);
    volumes.push_back(signed_volume(x.row(q[0]), x.row(q[1]), x.row(q[2]), x.row(q[3])));
  }
  return volumes;
}

// k_d = τ k, so that the lowest longitudinal mode of a cube of the body's volume and all of this tet's stuff
// has the damping ratio asked for.
double damping_time(const Body& body, int tet) {
  const double speed = std::sqrt(body.youngs_modulus_from_tet_pa[tet] / body.density_from_tet_kg_m3[tet]);
  const double frequency = M_PI * speed / std::cbrt(body.rest_volume_m3);
  return 2 * body.material.damping_ratio / frequency;
}

using detail::Lame;
Lame lame_of(const Body& body, int tet) {
  const double young = body.stiffness_share * body.youngs_modulus_from_tet_pa[tet],
               poisson = body.material.poisson_ratio;
  return {young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))};
}

// Each edge once, with what its tets are together: the sum of `of_tet`, or the least.
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

// An edge between parts has most of its stiffness from the stiffest, and so its damping time.
OverEdges damping_times(const Body& body) {
  return over_edges(body, Together::least, [&](int t) { return damping_time(body, t); });
}

// The energies of `springs` on the body's own node numbers. Sources and derivations: docs/dynamics.md.
void make_springs(const Body& body, ElementTables<double>& tables) {
  const auto& x = body.cage.positions;
  const std::vector<double> volumes = tet_volumes(body.cage);
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const auto [mu, lambda] = lame_of(body, t);
    const double tau = damping_time(body, t);
    const auto q = body.cage.tets.row(t);
    const double v = volumes[t], k = (lambda - mu) * v, scale = 1 / (36 * v * v);
    const double inverted = std::max(0.0, inversion_stiffness * mu * v - k);
    tables.volumes.elements.push_back(
        {{q[0], q[1], q[2], q[3]}, {6 * v, k * scale, inverted * scale, tau * k * scale}});
  }
  // Shares are fitted as if the body were all of one stuff: where parts meet, an affine strain has to leave a
  // pull. Then an edge gets the mean stiffness of its tets.
  const double young = body.youngs_modulus_from_tet_pa[0], mu = lame_of(body, 0).mu;
  std::vector<double> mu_volume;
  for (const double v : volumes) mu_volume.push_back(mu * v);
  const OverEdges volume_round = over_edges(body, Together::sum, [&](int t) { return volumes[t]; });
  const OverEdges stiffness_round = over_edges(
      body, Together::sum, [&](int t) { return body.youngs_modulus_from_tet_pa[t] / young * volumes[t]; });
  const OverEdges taus = damping_times(body);
  for (const auto& [edge, share] : detail::isotropic_springs(body.cage, mu_volume)) {
    const double rest = (x.row(edge.first) - x.row(edge.second)).norm();
    const double k = share * (stiffness_round.at(edge) / volume_round.at(edge)), tau = taus.at(edge);
    tables.springs.elements.push_back(
        {{edge.first, edge.second}, {rest, k / (rest * rest), tau * k / (rest * rest)}});
  }
}

// The same of `neo_hookean`. Its μ and λ are not Lamé's, but give them at small strain; its damping is that
// of springs.
void make_neo_hookean(const Body& body, ElementTables<double>& tables) {
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
    tables.neo_hookeans.elements.push_back(
        {{q[0], q[1], q[2], q[3]},
         {{6 * v * (1 + 0.75 * mu / lambda), lambda * v * scale, 0, damping},
          {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)},
          mu * v}});
  }
  const OverEdges taus = damping_times(body);
  for (const auto& [edge, k] :
       over_edges(body, Together::sum, [&](int t) { return 2.5 * lame_of(body, t).mu * volumes[t]; })) {
    const double rest = (x.row(edge.first) - x.row(edge.second)).norm(), tau = taus.at(edge);
    tables.dashpots.elements.push_back({{edge.first, edge.second}, {tau * k / (rest * rest)}});
  }
}

ElementTables<double> make_elements(const Body& body) {
  ElementTables<double> elements;
  body.material.model == MaterialModel::springs ? make_springs(body, elements)
                                                : make_neo_hookean(body, elements);
  return elements;
}

void find_stiffness_shares(std::vector<Body>& bodies) {
  parallel_for(int(bodies.size()), [&](int b) {
    Body& body = bodies[std::size_t(b)];
    if (!body.moving || body.kind != BodyKind::deformable || !body.material.mesh_independent) return;
    std::vector<Lame> of_tet;
    for (int t = 0; t < body.cage.tets.rows(); ++t) of_tet.push_back(lame_of(body, t));
    body.stiffness_share =
        detail::locking_share(body.cage, body.fixed, of_tet, body.node_mass_kg, make_elements(body));
  });
}

double largest_stable_step(const Body& body, const ElementTables<double>& elements) {
  const std::vector<double> positions(body.cage.positions.data(),
                                      body.cage.positions.data() + body.cage.positions.size());
  std::vector<double> inverse_mass;
  for (int n = 0; n < body.node_count(); ++n)
    inverse_mass.push_back(body.fixed[n] ? 0 : 1 / body.node_mass_kg[n]);
  return detail::stable_step(detail::fastest_mode(elements, positions, inverse_mass));
}

void append(const ElementTables<double>& of_body, int body, int first_node, ElementTables<double>& all) {
  detail::for_each_table(
      [&](const auto& from, auto& to) {
        to.ranges[std::size_t(body)] = {int(to.elements.size()), 0, int(from.elements.size())};
        for (auto element : from.elements) {
          for (int& n : element.node) n += first_node;
          to.elements.push_back(element);
        }
      },
      of_body, all);
}

void append_nodes(const Body& body, detail::Tables<double>& tables) {
  for (int n = 0; n < body.node_count(); ++n) {
    tables.node_mass.push_back(body.node_mass_kg[n]);
    tables.inverse_mass.push_back(body.fixed[n] ? 0 : 1 / body.node_mass_kg[n]);
    for (int c = 0; c < 3; ++c) tables.rest_positions.push_back(body.cage.positions(n, c));
  }
}

Vec3 center_of(const Body& body, const Points& positions) {
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < body.node_count(); ++n) sum += body.node_mass_kg[n] * positions.row(n).transpose();
  return sum / body.mass_kg;
}

detail::RigidTable make_rigid(const Body& body) {
  const Vec3 center = center_of(body, body.cage.positions);
  detail::RigidTable table{body.node_mass_kg, {}, {}};
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int n = 0; n < body.node_count(); ++n) {
    const Vec3 place = body.cage.positions.row(n).transpose() - center;
    table.place.insert(table.place.end(), place.data(), place.data() + 3);
    spread += body.node_mass_kg[n] * place * place.transpose();
  }
  const auto put = [](const Eigen::Matrix3d& m, double* six) {
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) *six++ = m(i, j);
  };
  put(spread.inverse(), table.sums.inverse_spread);
  put((spread.trace() * Eigen::Matrix3d::Identity() - spread).inverse(), table.sums.inverse_inertia);
  table.sums.inverse_mass = 1 / body.mass_kg;
  return table;
}

double mean_edge(const Body& body) {
  double sum = 0;
  for (int t = 0; t < body.cage.tets.rows(); ++t)
    for (const auto& [i, j] : tet_edges)
      sum += (body.cage.positions.row(body.cage.tets(t, i)) - body.cage.positions.row(body.cage.tets(t, j)))
                 .norm();
  return sum / double(6 * body.cage.tets.rows());
}

// Each body's last block repeats its last element.
template <class E>
void pack(detail::ElementTable<E>& table) {
  constexpr std::size_t size = detail::block_size;
  for (auto& range : table.ranges) {
    range.block = int(table.blocks.size());
    const std::size_t count = std::size_t(range.count), blocks = (count + size - 1) / size;
    table.blocks.resize(table.blocks.size() + blocks);
    for (std::size_t e = 0; e < blocks * size; ++e) {
      const E& element = table.elements[std::size_t(range.element) + std::min(e, count - 1)];
      auto& block = table.blocks[std::size_t(range.block) + e / size];
      for (int i = 0; i < E::nodes; ++i) block.node[i][e % size] = element.node[i];
      const float* numbers = reinterpret_cast<const float*>(&element.law);
      for (int i = 0; i < detail::Block<E>::numbers; ++i) block.law[i][e % size] = numbers[i];
    }
  }
}

// A law of another kind of number, member by member.
template <class To, class From>
void convert(const From& from, To& to) {
  const double* numbers = reinterpret_cast<const double*>(&from);
  float* out = reinterpret_cast<float*>(&to);
  for (std::size_t i = 0; i < sizeof(From) / sizeof(double); ++i) out[i] = float(numbers[i]);
}

detail::Tables<float> single_precision(const detail::Tables<double>& t) {
  detail::Tables<float> out;
  detail::for_each_table(
      [](const auto& from, auto& to) {
        for (const auto& element : from.elements) {
          auto& copy = to.elements.emplace_back();
          std::copy(std::begin(element.node), std::end(element.node), copy.node);
          convert(element.law, copy.law);
        }
        for (const auto& [element, block, count] : from.ranges) to.ranges.push_back({element, block, count});
        pack(to);
      },
      t.elements, out.elements);
  const auto copy = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
  out.node_mass = copy(t.node_mass), out.inverse_mass = copy(t.inverse_mass);
  out.rest_positions = copy(t.rest_positions), out.goal_from_center = copy(t.goal_from_center);
  out.pair_friction = copy(t.pair_friction), out.skin = copy(t.skin);
  return out;
}

// Each tet's faces, and through each face the next tet.
void append_tets(const Body& body, Topology& topology) {
  std::map<std::array<int, 3>, std::pair<int, int>> faces;  // nodes → the tet and face that wait; −1: matched
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    Topology::Tet tet;
    for (int i = 0; i < 4; ++i) tet.node[i] = body.cage.tets(t, i) + body.first_node;
    for (int i = 0; i < 4; ++i) {
      std::array<int, 3> face;
      for (int k = 0, m = 0; k < 4; ++k)
        if (k != i) face[m++] = tet.node[k];
      // The face's nodes in the tet's own order make det(face − p) positive inside for i = 0 and 2; each swap
      // turns it.
      float sign = i % 2 ? -1.f : 1.f;
      for (int pass = 0; pass < 2; ++pass)
        for (int k = 0; k < 2; ++k)
          if (face[k] > face[k + 1]) std::swap(face[k], face[k + 1]), sign = -sign;
      std::copy(face.begin(), face.end(), tet.face[i]);
      tet.sign[i] = sign;
      tet.across[i] = -1;
      const auto [waiting, is_new] = faces.try_emplace(face, body.first_tet + t, i);
      if (is_new) continue;
      auto& [other_tet, other_face] = waiting->second;
      if (other_tet < 0)
        throw InputError(
            fmt::format("body {}: cage: tet {} shares a face with two others; a face may join two tets only",
                        body.name, t));
      tet.across[i] = other_tet;
      topology.tets[other_tet].across[other_face] = body.first_tet + t;
      other_tet = -1;
    }
    topology.tets.push_back(tet);
  }
}

// Surface edges that stick out, by at least 3° at rest: of what is flat or hollow no edge is met first.
std::set<std::pair<int, int>> ridges_of(const Body& body) {
  const double min_cosine = std::cos(3 * std::numbers::pi / 180);
  std::map<std::pair<int, int>, std::vector<int>> faces;
  for (int f = 0; f < body.surface.rows(); ++f)
    for (int i = 0; i < 3; ++i)
      faces[std::minmax(body.surface(f, i), body.surface(f, (i + 1) % 3))].push_back(f);
  const auto corner = [&](int f, int i) -> Vec3 { return body.cage.positions.row(body.surface(f, i)); };
  const auto normal = [&](int f) {
    return Vec3((corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0)).normalized());
  };
  const auto center = [&](int f) { return Vec3((corner(f, 0) + corner(f, 1) + corner(f, 2)) / 3); };
  std::set<std::pair<int, int>> ridges;
  for (const auto& [edge, beside] : faces)
    if (beside.size() != 2 || (normal(beside[0]).dot(normal(beside[1])) <= min_cosine &&
                               normal(beside[0]).dot(center(beside[1]) - corner(beside[0], 0)) < 0))
      ridges.insert(edge);
  return ridges;
}

// The body's contact points: surface vertices, then middles of surface edges, flat ones and then ridges, each
// ascending. Returns the first ridge.
int append_points(const Body& body, Topology& topology) {
  std::map<std::pair<int, int>, std::set<int>> around;  // body's own numbers; a vertex is the pair of itself
  for (int v : body.surface_nodes) around[{v, v}];
  std::map<std::pair<int, int>, std::set<int>> edges;
  for (int f = 0; f < body.surface.rows(); ++f)
    for (int i = 0; i < 3; ++i) edges[std::minmax(body.surface(f, i), body.surface(f, (i + 1) % 3))];
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const auto q = body.cage.tets.row(t);
    for (int i = 0; i < 4; ++i)
      for (int j = i; j < 4; ++j) {
        auto& list = i == j ? around : edges;
        if (const auto found = list.find(std::minmax(q[i], q[j])); found != list.end())
          found->second.insert(q.begin(), q.end());
      }
  }
  const auto append = [&](const std::pair<int, int>& pair, const std::set<int>& nodes) {
    const auto [a, b] = pair;
    const int begin = int(topology.neighbors.size());
    for (int n : nodes)
      if (a != b || n != a) topology.neighbors.push_back(body.first_node + n);
    const float share = a == b ? 1.f : 0.5f;
    topology.points.push_back({{body.first_node + a, body.first_node + b},
                               {share, 1 - share},
                               begin,
                               int(topology.neighbors.size())});
  };
  const auto ridges = ridges_of(body);
  for (const auto& [vertex, nodes] : around) append(vertex, nodes);
  for (const auto& [edge, nodes] : edges)
    if (!ridges.contains(edge)) append(edge, nodes);
  const int first_ridge = int(topology.points.size());
  for (const auto& [edge, nodes] : edges)
    if (ridges.contains(edge)) append(edge, nodes);
  return first_ridge;
}

void append_topology(const Body& body, int index, Topology& topology) {
  Topology::Body& range = topology.bodies[index];
  range.first_node = body.first_node, range.last_node = body.first_node + body.node_count();
  range.first_tet = body.first_tet, range.last_tet = body.first_tet + int(body.cage.tets.rows());
  range.moving = body.moving, range.pushed = body.pushed();
  for (int n : body.surface_nodes) range.surface_nodes.push_back(body.first_node + n);
  append_tets(body, topology);
  range.first_point = int(topology.points.size());
  range.first_ridge = append_points(body, topology);
  range.last_point = int(topology.points.size());
  if (body.self_contact) range.self = detail::self_contact(topology, index);
}

void check_places(const World& world) {
  const double size = world.bounds_m.diagonal();
  for (const Body& body : world.bodies)
    for (int n = 0; n < body.node_count() && world.walls && body.pushed(); ++n)
      for (int c = 0; c < 3; ++c) {
        const double x = body.cage.positions(n, c);
        if (x < world.bounds_m.lower[c] - 1e-6 * size || x > world.bounds_m.upper[c] + 1e-6 * size)
          throw InputError(fmt::format(
              "body {}: node {} at {} = {:.6g} m is outside the bounds {:.6g} to {:.6g}; move the "
              "body or widen bounds_m",
              body.name, n, "xyz"[c], x, world.bounds_m.lower[c], world.bounds_m.upper[c]));
      }
  for (std::size_t a = 0; a < world.bodies.size(); ++a)
    for (std::size_t b = a + 1; b < world.bodies.size(); ++b) {
      const Body &one = world.bodies[a], &two = world.bodies[b];
      if ((!one.pushed() && !two.pushed()) || world.touches_on_surfaces()) continue;
      const auto overlap = detail::deepest_overlap({one.cage.positions, one.cage.tets, one.surface},
                                                   {two.cage.positions, two.cage.tets, two.surface});
      if (overlap.depth_m > 1e-6 * size)
        throw InputError(fmt::format(
            "bodies {} and {} overlap at the start, {:.3g} m deep at ({:.4g}, {:.4g}, {:.4g}); move "
            "them apart",
            one.name, two.name, overlap.depth_m, overlap.place.x(), overlap.place.y(), overlap.place.z()));
    }
}

void check(const WorldSpec& spec) {
  if (spec.bodies.empty()) throw InputError("the world has no body; add at least the robot");
  if (spec.robot < 0 || spec.robot >= int(spec.bodies.size()))
    throw InputError(
        fmt::format("robot is body {}, but there are {} bodies", spec.robot, spec.bodies.size()));
  const auto& box = spec.bounds_m;
  if (!box.lower.allFinite() || !box.upper.allFinite() || !(box.size().array() > 0).all())
    throw InputError("bounds_m must be two finite corners, the first below the second on every axis");
  if (!spec.gravity_m_s2.allFinite()) throw InputError("gravity_m_s2 is not finite");
  if (!(spec.rest_speed_m_s >= 0 && std::isfinite(spec.rest_speed_m_s)))
    throw InputError(
        fmt::format("rest_speed_m_s is {}; it must be 0 (bodies never fall asleep) or a positive speed",
                    spec.rest_speed_m_s));
  if (!(spec.max_dt_s >= 0 && std::isfinite(spec.max_dt_s)))
    throw InputError(
        fmt::format("max_dt_s is {}; it must be 0 (automatic) or a positive time", spec.max_dt_s));
}

// As seen from its centre of mass.
Points goal_shape(const Body& robot, const Points& given) {
  if (given.rows() != 0 && given.rows() != robot.node_count())
    throw InputError(
        fmt::format("body {}: the goal shape has {} nodes, the robot {}; give the same cage, deformed",
                    robot.name, given.rows(), robot.node_count()));
  if (!given.allFinite())
    throw InputError(fmt::format("body {}: the goal shape has a node that is not finite", robot.name));
  Points shape = given.rows() ? given : robot.cage.positions;
  shape.rowwise() -= center_of(robot, shape).transpose();
  return shape;
}

void choose_step(double max_dt_s, World& world) {
  const auto step_of = [](const Body& body) {
    const bool springs = body.material.model == MaterialModel::springs;
    return (springs ? step_safety : neo_hookean_step_safety) * body.elastic_dt_limit_s;
  };
  const auto stiffest =
      std::min_element(world.bodies.begin(), world.bodies.end(),
                       [&](const Body& a, const Body& b) { return step_of(a) < step_of(b); });
  world.contact_dt_s = float(std::isfinite(step_of(*stiffest)) ? step_of(*stiffest) : rigid_step_s);
  world.dt_s = max_dt_s > 0 ? std::min(world.contact_dt_s, double(float(max_dt_s))) : world.contact_dt_s;
  if (!(world.dt_s >= 1e-7))
    throw InputError(fmt::format(
        "body {}: its stable time step is {:.2g} s, too short to be of use; soften it, or mesh it "
        "without slivers",
        stiffest->name, world.dt_s));
}

Force make_force(const ForceSpec& spec, const World& world) {
  const auto refuse = [](const std::string& why) { throw InputError(why); };
  if (spec.body < 0 || spec.body >= int(world.bodies.size()))
    refuse(fmt::format("a force acts on body {}, and there are {}", spec.body, world.bodies.size()));
  const Body& body = world.bodies[std::size_t(spec.body)];
  if (!body.pushed())
    refuse(fmt::format("body {}: a force acts on it, and none of its nodes can be pushed", body.name));
  if (!(spec.from_s >= 0 && spec.to_s > spec.from_s && spec.to_s / world.dt_s < 1e15))
    refuse(fmt::format("body {}: a force acts on it from {} to {} s, which is no time", body.name,
                       spec.from_s, spec.to_s));
  if (!spec.force_n.allFinite()) refuse(fmt::format("body {}: a force on it is not finite", body.name));
  Force force{spec.body,
              std::llround(spec.from_s / world.dt_s),
              std::llround(spec.to_s / world.dt_s),
              spec.force_n,
              {},
              body.mass_kg};
  std::vector<int> nodes = spec.nodes;
  if (nodes.empty()) {
    nodes.resize(std::size_t(body.node_count()));
    std::iota(nodes.begin(), nodes.end(), 0);
  } else {
    force.mass_kg = 0;
    for (const int n : nodes) force.mass_kg += body.node_mass_kg.at(std::size_t(n));
  }
  std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(force.nodes),
               [&](int n) { return !body.fixed[std::size_t(n)]; });
  if (force.nodes.empty())
    refuse(fmt::format("body {}: a force acts on nodes of it that are all held", body.name));
  return force;
}

}  // namespace

World build_world(const WorldSpec& spec) {
  check(spec);
  World world;
  world.robot = spec.robot;
  world.bounds_m = spec.bounds_m;
  world.walls = spec.walls;
  world.gravity_m_s2 = spec.gravity_m_s2;
  world.rest_speed_m_s = spec.rest_speed_m_s;
  world.part_overlaps = spec.part_overlaps;
  world.max_overlap_m = spec.max_overlap_m;
  for (const BodySpec& body : spec.bodies) world.bodies.push_back(make_body(body));
  if (!world.bodies[spec.robot].pushed())
    throw InputError(
        fmt::format("body {}: the robot has no node that can move", world.bodies[spec.robot].name));

  find_stiffness_shares(world.bodies);
  auto& tables = world.tables64;
  detail::for_each_table([&](auto& table) { table.ranges.resize(world.bodies.size()); }, tables.elements);
  world.topology.bodies.resize(world.bodies.size());
  world.rigid_tables.resize(world.bodies.size());
  world.nodes = 0;
  int tets = 0;
  for (const bool moving : {true, false}) {
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
      Body& body = world.bodies[b];
      if (body.moving != moving) continue;
      body.first_node = world.nodes, body.first_tet = tets;
      world.nodes += body.node_count(), tets += int(body.cage.tets.rows());
      append_nodes(body, tables);
      append_topology(body, int(b), world.topology);
      if (body.kind == BodyKind::rigid) world.rigid_tables[b] = make_rigid(body);
      if (!moving || body.kind != BodyKind::deformable) continue;
      const ElementTables<double> elements = make_elements(body);
      body.elastic_dt_limit_s = largest_stable_step(body, elements);
      append(elements, int(b), body.first_node, tables.elements);
    }
    if (moving) world.moving_nodes = world.nodes;
  }
  const Body& robot = world.bodies[world.robot];
  world.goal_shape_m = goal_shape(robot, spec.goal_shape_m);
  for (int n = 0; n < robot.node_count(); ++n)
    for (int c = 0; c < 3; ++c) tables.goal_from_center.push_back(world.goal_shape_m(n, c));
  for (const Body& a : world.bodies) {
    for (const Body& b : world.bodies)
      tables.pair_friction.push_back(std::sqrt(a.material.friction * b.material.friction));
    tables.skin.push_back(0.2 * mean_edge(a));
  }
  world.tables = single_precision(tables);
  choose_step(spec.max_dt_s, world);
  for (const ForceSpec& force : spec.forces) world.forces.push_back(make_force(force, world));
  detail::make_surface_tables(spec.contact_offset_m, world);
  check_places(world);
  detail::set_start(spec, world);
  return world;
}

CageOverlap cage_overlap(const TetMesh& one, const TetMesh& two) {
  const Triangles surface_of_one = boundary_triangles(one.tets),
                  surface_of_two = boundary_triangles(two.tets);
  const auto overlap = detail::deepest_overlap({one.positions, one.tets, surface_of_one},
                                               {two.positions, two.tets, surface_of_two});
  return {overlap.depth_m, overlap.way_m};
}

State rest_state(const World& world) {
  State state;
  state.positions.assign(world.tables.rest_positions.begin(),
                         world.tables.rest_positions.begin() + 3 * world.moving_nodes);
  state.velocities.assign(std::size_t(3 * world.moving_nodes), 0.f);
  return state;
}

State start_state(const World& world) {
  State state = rest_state(world);
  state.positions = world.start_positions;
  for (const Body& body : world.bodies) {
    if (!body.pushed()) continue;
    using Rows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
    const Eigen::Map<const Rows> places(&state.positions[std::size_t(3 * body.first_node)], body.node_count(),
                                        3);
    const Vec3 center = center_of(body, places.cast<double>());
    for (int n = 0; n < body.node_count(); ++n) {
      if (body.fixed[std::size_t(n)]) continue;
      const Vec3 from_center = places.row(n).cast<double>().transpose() - center;
      const Vec3f velocity =
          (body.velocity_m_s + body.angular_velocity_rad_s.cross(from_center)).cast<float>();
      std::copy_n(velocity.data(), 3, &state.velocities[std::size_t(3 * (body.first_node + n))]);
    }
  }
  follow_keyframes(world, state);
  return state;
}

void follow_keyframes(const World& world, State& state) {
  for (const Body& body : world.bodies) {
    if (body.kind != BodyKind::kinematic) continue;
    const Pose now = pose_at(body.track, double(state.step) * world.dt_s),
               next = pose_at(body.track, double(state.step + 1) * world.dt_s);
    for (int n = 0; n < body.node_count(); ++n) {
      const Vec3 from_pivot = body.cage.positions.row(n).transpose() - body.track.pivot_m;
      const Vec3f place = (now.place_m + now.turn * from_pivot).cast<float>();
      const Vec3f velocity =
          ((next.place_m - now.place_m + (next.turn - now.turn) * from_pivot) / world.dt_s).cast<float>();
      const std::size_t k = std::size_t(3 * (body.first_node + n));
      std::copy_n(place.data(), 3, &state.positions[k]),
          std::copy_n(velocity.data(), 3, &state.velocities[k]);
    }
  }
}

}  // namespace limber::fem
