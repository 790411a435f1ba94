// What contact between cages needs to know of meshes: the faces of tets and the tets behind them, and the
// points where a body may touch another.
//
// What always holds: a face has its nodes in ascending order and each tet a sign for it, so the two tets at
// a face compute its plane from the same numbers in the same order, and nothing falls between them
// (contact_touches.cpp). Points are surface vertices, then middles of flat edges, then middles of ridges,
// each ascending, which is the order of contacts and so of sums. A point's mesh edges lead to the nodes
// that share a tet with it.
//
// Ridges are surface edges that stick out by 3° or more. What is flat or hollow is not met first by an edge
// of its own: the other body's ridge or vertex that is in it is found from that side. With ridges from 15°
// on the edges of a finely meshed ball are left out, and it went 11 mm into a slit in place of 4
// (docs/contact.md, "Traps").
#include "fem/detail/make_topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "core/error.h"
#include "fem/detail/self_contact.h"

namespace limber::fem::detail {
namespace {

// Each tet's faces, and through each face the next tet. A face waits in the map until its second tet comes;
// a third is refused. Face i is opposite to node i, and sign × det(face − p) is positive for p inside.
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

// The ridges of a body, as pairs of its own node numbers. An edge between two surface triangles sticks out
// where their normals differ by 3° or more and the middle of the one lies below the plane of the other. An
// edge that has not two triangles, where surfaces meet along a line, counts as well.
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

// The body's contact points: surface vertices, then middles of surface edges, flat ones and then ridges,
// each ascending. Returns the number of the first ridge. The neighbours of a point are all nodes that share
// a tet with all of its nodes.
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

}  // namespace

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
  if (body.self_contact) range.self = self_contact(topology, index);
}

}  // namespace limber::fem::detail
