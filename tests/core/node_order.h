// The order in which a tet mesh's nodes and tets lie in memory. Forces walk the tets and touch their nodes: a
// mesh whose order is shuffled is slower by what docs/dynamics-measured.md tells. All that limber makes is
// numbered along the coordinates, which is as good as a band; tests and benchmarks make the other orders.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "core/mesh.h"
#include "core/random.h"

namespace limber {

// Each edge once, the lower node first, ascending.
inline std::vector<std::pair<int, int>> edges_of(const Tets& tets) {
  std::vector<std::pair<int, int>> edges;
  for (Eigen::Index t = 0; t < tets.rows(); ++t)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) edges.push_back(std::minmax({tets(t, i), tets(t, j)}));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// The graph of a mesh's edges. Neighbours are sorted by how many neighbours they have, then by number.
inline std::vector<std::vector<int>> neighbours_of(const TetMesh& mesh) {
  std::vector<std::vector<int>> neighbours(std::size_t(mesh.positions.rows()));
  for (const auto& [a, b] : edges_of(mesh.tets))
    neighbours[std::size_t(a)].push_back(b), neighbours[std::size_t(b)].push_back(a);
  const auto rank = [&](int n) { return std::pair(neighbours[std::size_t(n)].size(), n); };
  for (std::vector<int>& of_node : neighbours)
    std::sort(of_node.begin(), of_node.end(), [&](int a, int b) { return rank(a) < rank(b); });
  return neighbours;
}

class BreadthFirst {
 public:
  explicit BreadthFirst(const TetMesh& mesh)
      : neighbours_(neighbours_of(mesh)), seen_(neighbours_.size(), 0) {}

  // The nodes that hang together with this one, the nearest first.
  std::vector<int> from(int start) {
    ++walk_;
    std::vector<int> reached{start};
    seen_[std::size_t(start)] = walk_;
    for (std::size_t i = 0; i < reached.size(); ++i)
      for (const int n : neighbours_[std::size_t(reached[i])])
        if (std::exchange(seen_[std::size_t(n)], walk_) != walk_) reached.push_back(n);
    return reached;
  }

 private:
  std::vector<std::vector<int>> neighbours_;
  std::vector<int> seen_;  // in which walk, from 1 on
  int walk_ = 0;
};

struct MeshOrder {
  std::vector<int> node_from_place, tet_from_place;  // each index of the mesh once
};

// Reverse Cuthill-McKee (Cuthill and McKee 1969; George 1971), begun at a node that is far from others
// (George and Liu 1979), part by part; tets by their nodes, the lowest first.
inline MeshOrder banded_order(const TetMesh& mesh) {
  const Eigen::Index nodes = mesh.positions.rows();
  MeshOrder order;
  BreadthFirst walks(mesh);
  std::vector<bool> placed(std::size_t(nodes), false);
  for (int n = 0; n < nodes; ++n) {
    if (placed[std::size_t(n)]) continue;
    // The last node of a walk lies at an end of the part, and that of a walk from there at the other end.
    const int one_end = walks.from(n).back(), other_end = walks.from(one_end).back();
    for (const int reached : walks.from(other_end))
      order.node_from_place.push_back(reached), placed[std::size_t(reached)] = true;
  }
  std::reverse(order.node_from_place.begin(), order.node_from_place.end());

  std::vector<int> place_from_node(static_cast<std::size_t>(nodes));
  for (int p = 0; p < nodes; ++p) place_from_node[std::size_t(order.node_from_place[std::size_t(p)])] = p;
  std::vector<std::array<int, 4>> places(std::size_t(mesh.tets.rows()));
  for (std::size_t t = 0; t < places.size(); ++t) {
    for (std::size_t i = 0; i < 4; ++i)
      places[t][i] = place_from_node[std::size_t(mesh.tets(Eigen::Index(t), Eigen::Index(i)))];
    std::sort(places[t].begin(), places[t].end());
  }
  order.tet_from_place.resize(places.size());
  std::iota(order.tet_from_place.begin(), order.tet_from_place.end(), 0);
  std::stable_sort(order.tet_from_place.begin(), order.tet_from_place.end(),
                   [&](int a, int b) { return places[std::size_t(a)] < places[std::size_t(b)]; });
  return order;
}

// Nodes and tets in any order.
inline MeshOrder shuffled_order(const TetMesh& mesh, std::uint64_t seed) {
  Rng rng(seed, 0);
  const auto shuffled = [&](Eigen::Index count) {
    std::vector<int> order(std::size_t(count), 0);
    for (int i = 1; i < count; ++i) {
      order[std::size_t(i)] = i;
      std::swap(order[std::size_t(i)], order[std::size_t(rng.below(i + 1))]);
    }
    return order;
  };
  std::vector<int> nodes = shuffled(mesh.positions.rows());
  return {std::move(nodes), shuffled(mesh.tets.rows())};
}

// The same mesh. Each tet keeps the order of its corners.
inline TetMesh reordered(const TetMesh& mesh, const MeshOrder& order) {
  TetMesh other{Points(mesh.positions.rows(), 3), Tets(mesh.tets.rows(), 4)};
  std::vector<int> place_from_node(order.node_from_place.size());
  for (std::size_t p = 0; p < place_from_node.size(); ++p) {
    const int node = order.node_from_place[p];
    place_from_node[std::size_t(node)] = int(p);
    other.positions.row(Eigen::Index(p)) = mesh.positions.row(node);
  }
  for (Eigen::Index t = 0; t < other.tets.rows(); ++t)
    for (int i = 0; i < 4; ++i)
      other.tets(t, i) = place_from_node[std::size_t(mesh.tets(order.tet_from_place[std::size_t(t)], i))];
  return other;
}

// How far apart the ends of an edge are numbered, on average.
inline double mean_bandwidth(const Tets& tets) {
  double sum = 0;
  const std::vector<std::pair<int, int>> edges = edges_of(tets);
  for (const auto& [a, b] : edges) sum += b - a;
  return edges.empty() ? 0 : sum / double(edges.size());
}

}  // namespace limber
