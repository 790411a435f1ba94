#include "fem/detail/self_contact.h"

#include <set>

#include "fem/detail/tables.h"

namespace limber::fem::detail {
namespace {

Lists lists_of(const std::vector<std::set<int>>& sets) {
  Lists lists{{0}, {}};
  for (const auto& set : sets) {
    lists.items.insert(lists.items.end(), set.begin(), set.end());
    lists.begin.push_back(int(lists.items.size()));
  }
  return lists;
}

}  // namespace

SelfContact self_contact(const Topology& topology, int index) {
  const Topology::Body& body = topology.bodies[index];
  const std::size_t nodes = std::size_t(body.last_node - body.first_node),
                    tets = std::size_t(body.last_tet - body.first_tet);
  std::vector<std::set<int>> tets_of_node(nodes), ring(nodes), near_tets(nodes), near_faces(tets),
      node_faces(nodes);
  for (int t = body.first_tet; t < body.last_tet; ++t)
    for (const int n : topology.tets[t].node) {
      tets_of_node[n - body.first_node].insert(t);
      for (const int m : topology.tets[t].node) ring[n - body.first_node].insert(m - body.first_node);
    }
  for (std::size_t n = 0; n < nodes; ++n)
    for (const int m : ring[n]) near_tets[n].insert(tets_of_node[m].begin(), tets_of_node[m].end());
  for (int t = body.first_tet; t < body.last_tet; ++t)
    for (int i = 0; i < 4; ++i) {
      if (topology.tets[t].across[i] >= 0) continue;
      for (const int n : topology.tets[t].node)
        for (const int near : tets_of_node[n - body.first_node])
          near_faces[near - body.first_tet].insert(4 * t + i);
      for (const int n : topology.tets[t].face[i]) node_faces[n - body.first_node].insert(4 * t + i);
    }
  return {lists_of(near_tets), lists_of(near_faces), lists_of(node_faces)};
}

}  // namespace limber::fem::detail
