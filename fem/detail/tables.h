// What the steppers read of a World: flat arrays in the order in which they are walked.
#pragma once

#include <tuple>
#include <utility>
#include <vector>

#include "fem/detail/kernels.h"
#include "fem/detail/self_contact.h"

namespace limber::fem::detail {

// What materials give to edges and tets.
struct ElementLists {
  std::vector<Spring<double>> springs;         // every edge of a body of springs once, i < j, ascending
  std::vector<Dashpot<double>> dashpots;       // every edge of a Neo-Hookean body
  std::vector<VolumeElement<double>> volumes;  // tets
  std::vector<NeoHookeanElement<double>> neo_hookeans;
};

// The same as the kernels walk it (make_stars.h).
template <class E>
struct ElementTable {
  std::vector<E> elements;
  std::vector<Block<E>> blocks;  // the same in columns; a run begins with a block of its own
};
template <class Real, class Kinds = std::make_integer_sequence<int, kinds>>
struct ElementTables;
template <class Real, int... Kind>
struct ElementTables<Real, std::integer_sequence<int, Kind...>> {
  std::tuple<ElementTable<ElementOfKind<Real, Kind>>...> of_kind;
  std::vector<Run> runs;                          // in the order of the forces' sums
  std::vector<std::pair<int, int>> runs_of_body;  // [first, last)
};

// Those of the runs [first, last).
template <class Real>
Elements<Real> elements_of(const ElementTables<Real>& tables, int first, int last) {
  Elements<Real> all{tables.runs.data() + first, last - first, {}, {}};
  std::apply(
      [&](const auto&... table) {
        int kind = 0;
        ((all.elements[kind] = table.elements.data(), all.blocks[kind++] = table.blocks.data()), ...);
      },
      tables.of_kind);
  return all;
}
template <class Real>
Elements<Real> elements_of(const ElementTables<Real>& tables) {
  return elements_of(tables, 0, int(tables.runs.size()));
}
// Those of one body.
template <class Real>
Elements<Real> elements_of(const ElementTables<Real>& tables, int body) {
  const auto [first, last] = tables.runs_of_body[std::size_t(body)];
  return elements_of(tables, first, last);
}

template <class Real>
struct Tables {
  ElementTables<Real> elements;
  std::vector<Real> node_mass;       // a world node
  std::vector<Real> inverse_mass;    // a world node; 0: never moves
  std::vector<Real> rest_positions;  // (3 × nodes)
  std::vector<Real>
      goal_from_center;             // (3 × robot nodes) place in the goal shape seen from its centre of mass
  std::vector<Real> pair_friction;  // [body a × bodies + body b]
  std::vector<Real> skin;           // a body: share of its mean edge by which contact candidates may be old
};

// What RigidBody points to.
struct RigidTable {
  std::vector<double> mass, place;
  RigidBody body() const {
    RigidBody b = sums;
    b.mass = mass.data(), b.place = place.data();
    return b;
  }
  RigidBody sums;  // without the pointers
};

// Connectivity for contact, world nodes and world tets. Face i of a tet is opposite its node i.
struct Topology {
  struct Tet {
    int node[4];
    int face[4][3];  // nodes of each face, ascending: two tets compute the same plane from the same face
    float sign[4];   // +1 or −1: makes det(face − p) positive for p inside
    int across[4];   // the tet behind each face, −1 outside
  };
  std::vector<Tet> tets;
  // Where a body may touch another: its surface vertices, then the middles of its surface edges, at last of
  // those that stick out, its ridges. (Vertices alone miss an edge that cuts an edge: measured, up to 16 % of
  // a coarse robot's size.)
  struct Point {
    int node[2];                       // a vertex: twice the same
    float share[2];                    // of the two nodes: 1 and 0, or a half each
    int neighbor_begin, neighbor_end;  // in neighbors
  };
  std::vector<Point> points;
  std::vector<int>
      neighbors;  // nodes that share a tet with all of a point's nodes, without the vertex itself, ascending
  struct Body {
    int first_node, last_node, first_tet, last_tet, first_point, first_ridge, last_point;
    bool moving, pushed;             // as of Body
    std::vector<int> surface_nodes;  // world nodes, ascending
    SelfContact self;                // empty where the body does not touch itself
  };
  std::vector<Body> bodies;
};

}  // namespace limber::fem::detail
