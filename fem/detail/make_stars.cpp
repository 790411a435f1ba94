// Which edges go with which tet is chosen greedily: of the edges that are left, the one with the fewest tets
// that are still free takes the tet and the end of its own that bring most other edges along. Of grids and
// balls of 135 to 5,000 tets no edge stays alone (tests/fem/stars_test.cpp), of a cube of five tets some
// must.
//
// What always holds: the energy is the sum it was, whatever the choice. A tet's nodes are put in another
// order that keeps its orientation; the volume law does not see that, and a metric is carried over exactly.
#include "fem/detail/make_stars.h"

#include <algorithm>
#include <array>
#include <map>
#include <queue>
#include <utility>

#include <Eigen/LU>

#include "fem/detail/tet_edges.h"

namespace limber::fem::detail {
namespace {

// As many elements of a kind are in a run, but for the last of a body: two blocks. Longer runs walk farther
// through memory, shorter ones ask more often of which kind they are.
constexpr std::size_t run_size = 2 * block_size;

// A tet's own node numbers in the order in which it is walked, and the edges from the first to the next ones.
struct Star {
  std::array<int, 4> node{0, 1, 2, 3};
  std::vector<int> edges;
};

struct Stars {
  std::vector<Star> of_tet;
  std::vector<int> alone;  // edges
};

// Even permutations keep a tet's orientation.
bool is_even(const std::array<int, 4>& node) {
  int inversions = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) inversions += node[std::size_t(j)] > node[std::size_t(i)];
  return inversions % 2 == 0;
}

class StarMaker {
 public:
  template <class Edge, class Tet>
  StarMaker(const std::vector<Edge>& edges, const std::vector<Tet>& tets) : free_tets_(edges.size()) {
    std::map<std::pair<int, int>, int> number;
    for (std::size_t e = 0; e < edges.size(); ++e)
      number[std::minmax(edges[e].node[0], edges[e].node[1])] = int(e);
    for (const Tet& tet : tets) {
      std::array<int, 6> of_tet;
      for (std::size_t k = 0; k < 6; ++k) {
        const auto [i, j] = tet_edges[k];
        of_tet[k] = number.at(std::minmax(tet.node[i], tet.node[j]));
        tets_of_edge_.resize(edges.size());
        tets_of_edge_[std::size_t(of_tet[k])].push_back(int(edges_of_tet_.size()));
        ++free_tets_[std::size_t(of_tet[k])];
      }
      edges_of_tet_.push_back(of_tet);
    }
    is_left_.assign(edges.size(), true), is_free_.assign(tets.size(), true);
  }

  Stars make() {
    Stars stars{std::vector<Star>(edges_of_tet_.size()), {}};
    for (std::size_t e = 0; e < free_tets_.size(); ++e) waiting_.push({free_tets_[e], int(e)});
    while (!waiting_.empty()) {
      const auto [tets, edge] = waiting_.top();
      waiting_.pop();
      const std::size_t e = std::size_t(edge);
      if (!is_left_[e] || tets != free_tets_[e]) continue;
      if (tets == 0)
        stars.alone.push_back(edge), is_left_[e] = false;
      else
        take(best_for(edge), stars);
    }
    std::sort(stars.alone.begin(), stars.alone.end());
    return stars;
  }

 private:
  struct Choice {
    int tet, end;  // its own number of the node
  };

  // The edges that are left of a tet from one of its nodes.
  template <class Visit>
  void for_each_left(const Choice& choice, const Visit& visit) const {
    for (std::size_t k = 0; k < 6; ++k) {
      const auto [i, j] = tet_edges[k];
      const int edge = edges_of_tet_[std::size_t(choice.tet)][k];
      if ((i == choice.end || j == choice.end) && is_left_[std::size_t(edge)])
        visit(edge, i == choice.end ? j : i);
    }
  }

  // Most edges first, then those that are scarce; the first of equals.
  Choice best_for(int edge) const {
    Choice best{-1, 0};
    double most = 0;
    for (const int tet : tets_of_edge_[std::size_t(edge)]) {
      if (!is_free_[std::size_t(tet)]) continue;
      for (std::size_t k = 0; k < 6; ++k) {
        if (edges_of_tet_[std::size_t(tet)][k] != edge) continue;
        for (const int end : tet_edges[k]) {
          double gain = 0;
          for_each_left({tet, end},
                        [&](int other, int) { gain += 1 + 1.0 / free_tets_[std::size_t(other)]; });
          if (gain > most) most = gain, best = {tet, end};
        }
      }
    }
    return best;
  }

  void take(const Choice& choice, Stars& stars) {
    Star& star = stars.of_tet[std::size_t(choice.tet)];
    star.node[0] = choice.end;
    std::size_t next = 1;
    for_each_left(choice, [&](int edge, int far) { star.edges.push_back(edge), star.node[next++] = far; });
    for (int n = 0; n < 4; ++n)
      if (std::find(star.node.begin(), star.node.begin() + std::ptrdiff_t(next), n) ==
          star.node.begin() + std::ptrdiff_t(next))
        star.node[next++] = n;
    if (!is_even(star.node)) {
      const bool by_edges = star.edges.size() > 1;  // two nodes with edges change places, or two without
      const std::size_t a = by_edges ? 1 : 2, b = by_edges ? 2 : 3;
      std::swap(star.node[a], star.node[b]);
      if (by_edges) std::swap(star.edges[0], star.edges[1]);
    }
    for (const int edge : star.edges) is_left_[std::size_t(edge)] = false;
    is_free_[std::size_t(choice.tet)] = false;
    for (const int edge : edges_of_tet_[std::size_t(choice.tet)])
      if (const int tets = --free_tets_[std::size_t(edge)]; is_left_[std::size_t(edge)])
        waiting_.push({tets, edge});
  }

  std::vector<std::array<int, 6>> edges_of_tet_;
  std::vector<std::vector<int>> tets_of_edge_;
  std::vector<int> free_tets_;  // of an edge
  std::vector<char> is_left_, is_free_;
  using Waiting = std::pair<int, int>;  // free tets, edge
  std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> waiting_;
};

// A law for a tet whose nodes are in another order. The new edges are E P, so M becomes P⁻¹ M P⁻ᵀ.
VolumeLaw<double> turned(const VolumeLaw<double>& law, const std::array<int, 4>&) { return law; }
NeoHookeanLaw<double> turned(const NeoHookeanLaw<double>& law, const std::array<int, 4>& node) {
  const auto unit = [](int n) -> Eigen::Vector3d {
    return n == 0 ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(Eigen::Vector3d::Unit(n - 1));
  };
  Eigen::Matrix3d p, m;
  for (int i = 0; i < 3; ++i) p.col(i) = unit(node[std::size_t(i + 1)]) - unit(node[0]);
  const double* six = law.metric;
  m << six[0], six[1], six[2], six[1], six[3], six[4], six[2], six[4], six[5];
  const Eigen::Matrix3d inverse = p.inverse().array().round();  // of −1, 0 and 1, as P
  m = inverse * m * inverse.transpose();
  return {law.volume, {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)}, law.scale};
}

// Adds elements of one kind as a run.
template <int Kind, class Make>
void add_run(ElementTables<double>& all, const std::vector<int>& numbers, const Make& make) {
  auto& table = std::get<Kind>(all.of_kind);
  all.runs.push_back({Kind, int(table.elements.size()), 0, int(numbers.size())});
  for (const int n : numbers) table.elements.push_back(make(n));
}

// A tet as a star of as many edges as the kind has.
template <class Element, class Edge, class Tet>
Element star_element(const Tet& tet, const Star& star, const std::vector<Edge>& edges, int first_node) {
  Element element;
  for (std::size_t i = 0; i < 4; ++i) element.node[i] = first_node + tet.node[star.node[i]];
  element.law.solid = turned(tet.law, star.node);
  if constexpr (requires { element.law.edge; })
    for (std::size_t k = 0; k < star.edges.size(); ++k)
      element.law.edge[k] = edges[std::size_t(star.edges[k])].law;
  return element;
}

template <int AloneKind, int StarKind, class Edge, class Tet>
void append(const std::vector<Edge>& edges, const std::vector<Tet>& tets, int first_node,
            ElementTables<double>& all) {
  const Stars stars = StarMaker(edges, tets).make();
  if (!stars.alone.empty())
    add_run<AloneKind>(all, stars.alone, [&](int e) {
      Edge edge = edges[std::size_t(e)];
      for (int& n : edge.node) n += first_node;
      return edge;
    });
  std::array<std::vector<int>, 4> gathered;
  const auto put_out = [&]<int Edges>(std::integral_constant<int, Edges>) {
    constexpr int kind = StarKind + Edges;
    auto& numbers = gathered[Edges];
    if (numbers.empty()) return;
    add_run<kind>(all, numbers, [&](int t) {
      return star_element<ElementOfKind<double, kind>>(tets[std::size_t(t)], stars.of_tet[std::size_t(t)],
                                                       edges, first_node);
    });
    numbers.clear();
  };
  const auto put_out_of = [&](std::size_t count) {
    if (count == 0) put_out(std::integral_constant<int, 0>());
    if (count == 1) put_out(std::integral_constant<int, 1>());
    if (count == 2) put_out(std::integral_constant<int, 2>());
    if (count == 3) put_out(std::integral_constant<int, 3>());
  };
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const std::size_t count = stars.of_tet[t].edges.size();
    gathered[count].push_back(int(t));
    if (gathered[count].size() == run_size) put_out_of(count);
  }
  for (std::size_t count = 0; count < 4; ++count) put_out_of(count);
}

}  // namespace

void append_stars(const ElementLists& of_body, int body, int first_node, ElementTables<double>& all) {
  const int first = int(all.runs.size());
  append<spring_kind, spring_star_kind>(of_body.springs, of_body.volumes, first_node, all);
  append<dashpot_kind, neo_hookean_star_kind>(of_body.dashpots, of_body.neo_hookeans, first_node, all);
  if (int(all.runs_of_body.size()) <= body) all.runs_of_body.resize(std::size_t(body) + 1);
  all.runs_of_body[std::size_t(body)] = {first, int(all.runs.size())};
}

ElementTables<double> stars_of(const ElementLists& lists) {
  ElementTables<double> tables;
  append_stars(lists, 0, 0, tables);
  return tables;
}

}  // namespace limber::fem::detail
