// The rest cage of a body and what follows from it and the material alone.
//
// Masses are lumped: a node has density × a quarter of each of its tets, Σ m = Σ ρ V. So inertia is that of
// points at the nodes, which is larger than the true one of coarse cages: for a cube of n³ cells 1 + 2/n²
// times (docs/dynamics.md, "Traps"). The cage's positions are rounded to float32 first, since that is what
// the steppers have, and all else is derived from the rounded ones.
//
// A static body keeps masses too, although nothing moves it: contact on fine surfaces counts held nodes
// with theirs.
#include "fem/detail/make_body.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <Eigen/LU>

#include "core/error.h"
#include "fem/detail/check_world.h"
#include "fem/detail/tet_edges.h"

namespace limber::fem::detail {

namespace {

// Pieces of the surface that hold less than nothing are the walls of hollows. Those are blown up, seen from
// within; else the whole surface is.
Triangles blown_faces(const Points& positions, const Triangles& surface) {
  std::vector<int> leader(std::size_t(positions.rows()));
  std::iota(leader.begin(), leader.end(), 0);
  const auto leader_of = [&](int node) {
    while (leader[std::size_t(node)] != node) node = leader[std::size_t(node)];
    return node;
  };
  for (Eigen::Index t = 0; t < surface.rows(); ++t)
    for (const int i : {1, 2}) {
      const int a = leader_of(surface(t, 0)), b = leader_of(surface(t, i));
      leader[std::size_t(std::max(a, b))] = std::min(a, b);
    }
  const Vec3 origin = positions.colwise().mean();
  std::vector<double> held(std::size_t(positions.rows()), 0);
  const auto corner = [&](Eigen::Index t, int i) -> Vec3 { return positions.row(surface(t, i)); };
  for (Eigen::Index t = 0; t < surface.rows(); ++t)
    held[std::size_t(leader_of(surface(t, 0)))] +=
        signed_volume(origin, corner(t, 0), corner(t, 1), corner(t, 2));
  std::vector<Eigen::Index> walls;
  for (Eigen::Index t = 0; t < surface.rows(); ++t)
    if (held[std::size_t(leader_of(surface(t, 0)))] < 0) walls.push_back(t);
  if (walls.empty()) return surface;
  Triangles blown(Eigen::Index(walls.size()), 3);
  for (std::size_t w = 0; w < walls.size(); ++w)
    blown.row(Eigen::Index(w)) << surface(walls[w], 0), surface(walls[w], 2), surface(walls[w], 1);
  return blown;
}

}  // namespace

// `moving` means that the body is part of State: some node of it is free, or keyframes move it. Phong
// Deformation and self-contact are for deformable bodies alone. inverse_rest_edges has, for each tet, the
// inverse of the matrix of its edges from node 0, in 1/m: F = E E₀⁻¹.
Body make_body(const BodySpec& spec) {
  check(spec);
  Body body;
  body.name = spec.name;
  body.material = spec.material;
  body.cage = spec.cage;
  body.cage.positions = spec.cage.positions.cast<float>().cast<double>();
  validate(body.cage, fmt::format("body {}: cage in float32", spec.name));
  body.surface = boundary_triangles(body.cage.tets);
  body.blown = blown_faces(body.cage.positions, body.surface);
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
  body.max_contact_load_n = spec.max_contact_load_n;
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
  body.stiffness_share = spec.stiffness_share;
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

// Σ mᵢ xᵢ / Σ mᵢ.
Vec3 center_of(const Body& body, const Points& positions) {
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < body.node_count(); ++n) sum += body.node_mass_kg[n] * positions.row(n).transpose();
  return sum / body.mass_kg;
}

double mean_edge(const Body& body) {
  double sum = 0;
  for (int t = 0; t < body.cage.tets.rows(); ++t)
    for (const auto& [i, j] : tet_edges)
      sum += (body.cage.positions.row(body.cage.tets(t, i)) - body.cage.positions.row(body.cage.tets(t, j)))
                 .norm();
  return sum / double(6 * body.cage.tets.rows());
}

}  // namespace limber::fem::detail
