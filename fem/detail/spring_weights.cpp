#include "fem/detail/spring_weights.h"

#include <algorithm>

namespace limber::fem::detail {
namespace {

// A fully symmetric fourth-order tensor: xxxx yyyy zzzz, xxxy xxxz yyyx yyyz zzzx zzzy, xxyy xxzz yyzz,
// xxyz yyxz zzxy, each times the root of how often it stands in the full tensor: then dot products are those
// of the full ones.
using Quartic = Eigen::Matrix<double, 15, 1>;

Quartic quartic(const Vec3& n) {
  const double x = n.x(), y = n.y(), z = n.z(), two = 2, root6 = std::sqrt(6.0), root12 = std::sqrt(12.0);
  Quartic q;
  q << x * x * x * x, y * y * y * y, z * z * z * z, two * x * x * x * y, two * x * x * x * z,
      two * y * y * y * x, two * y * y * y * z, two * z * z * z * x, two * z * z * z * y,
      root6 * x * x * y * y, root6 * x * x * z * z, root6 * y * y * z * z, root12 * x * x * y * z,
      root12 * y * y * x * z, root12 * z * z * x * y;
  return q;
}

// δ_ij δ_kl + δ_ik δ_jl + δ_il δ_jk.
Quartic isotropic() {
  Quartic q = Quartic::Zero();
  q.head<3>().setConstant(3);
  q.segment<3>(9).setConstant(std::sqrt(6.0));
  return q;
}

// The same of third order: xxx yyy zzz, xxy xxz yyx yyz zzx zzy, xyz.
using Cubic = Eigen::Matrix<double, 10, 1>;
Cubic cubic(const Vec3& n) {
  const double x = n.x(), y = n.y(), z = n.z(), root3 = std::sqrt(3.0), root6 = std::sqrt(6.0);
  Cubic q;
  q << x * x * x, y * y * y, z * z * z, root3 * x * x * y, root3 * x * x * z, root3 * y * y * x,
      root3 * y * y * z, root3 * z * z * x, root3 * z * z * y, root6 * x * y * z;
  return q;
}

// How much a spring's distance from the even share counts beside anisotropy: the fit alone leaves freedom.
constexpr double pull_to_even_share = 0.02;
// How much more an unbalanced pull counts than anisotropy, and how little the nodes at the surface count,
// whose springs cannot be isotropic. Figures of other choices: docs/dynamics-measured.md.
constexpr double balance = 5, weight_at_surface = 0.1;
constexpr int sweeps = 100;

struct Edge {
  int a, b;
  double length;
  Quartic even_part;
  Cubic odd_part;  // seen from a; from b it is the opposite
  double share, k;
};
struct Node {
  double weight = 0;           // 1 over a quarter of μV of its tets
  double mean_edge = 0;        // 0 at the surface, where the surroundings are lopsided anyway
  Quartic anisotropy;          // springs − material
  Cubic pull = Cubic::Zero();  // what an affine strain pulls the node with, as if all edges were mean
};

}  // namespace

std::map<std::pair<int, int>, double> isotropic_springs(const TetMesh& mesh,
                                                        const std::vector<double>& mu_volume) {
  constexpr int tet_edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  std::map<std::pair<int, int>, double> springs;
  std::vector<double> quarter(std::size_t(mesh.positions.rows()), 0.0);
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    for (int i = 0; i < 4; ++i) quarter[mesh.tets(t, i)] += mu_volume[t] / 4;
    for (const auto& [i, j] : tet_edges)
      springs[std::minmax(mesh.tets(t, i), mesh.tets(t, j))] += 2.5 * mu_volume[t];
  }
  std::vector<Node> nodes(quarter.size());
  std::vector<int> degree(nodes.size(), 0);
  std::vector<Edge> edges;
  for (const auto& [ends, k] : springs) {
    const auto [a, b] = ends;
    const Vec3 way = (mesh.positions.row(b) - mesh.positions.row(a)).transpose();
    edges.push_back({a, b, way.norm(), quartic(way.normalized()), cubic(way.normalized()), k, k});
    for (const int n : {a, b}) nodes[n].mean_edge += way.norm(), ++degree[n];
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    nodes[n].weight = 1 / quarter[n], nodes[n].mean_edge *= balance / degree[n];
    nodes[n].anisotropy = -quarter[n] * isotropic();
  }
  for (const int n : vertices_of(boundary_triangles(mesh.tets))) {
    nodes[n].mean_edge = 0;
    nodes[n].weight *= weight_at_surface;
  }
  const auto change = [&](const Edge& e, double k) {
    Node &a = nodes[e.a], &b = nodes[e.b];
    a.anisotropy += 0.5 * k * e.even_part, b.anisotropy += 0.5 * k * e.even_part;
    a.pull += k * a.mean_edge / e.length * e.odd_part, b.pull -= k * b.mean_edge / e.length * e.odd_part;
  };
  for (const Edge& e : edges) change(e, e.k);
  // Least squares of (anisotropy² + pull²)/quarter over the nodes, one spring after the other.
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (Edge& e : edges) {
      double slope = 0, stiffness = 0;
      for (const int n : {e.a, e.b}) {
        const Node& node = nodes[n];
        const double lever = (n == e.a ? 1 : -1) * node.mean_edge / e.length;
        slope += node.weight * (0.5 * node.anisotropy.dot(e.even_part) + lever * node.pull.dot(e.odd_part));
        stiffness += node.weight * (0.25 + lever * lever);
      }
      const double hold = pull_to_even_share * stiffness;
      const double k = std::max(0.0, e.k - (slope + hold * (e.k - e.share)) / (stiffness + hold));
      change(e, k - e.k);
      e.k = k;
    }
  // All together as much as before: the bulk modulus is the material's.
  double before = 0, after = 0;
  for (const Edge& e : edges) before += e.share, after += e.k;
  for (const Edge& e : edges) springs[{e.a, e.b}] = e.k * before / after;
  return springs;
}

}  // namespace limber::fem::detail
