// What the steppers read of a World: flat arrays in the order in which they are walked.
#pragma once

#include <vector>

#include "fem/detail/kernels.h"
#include "fem/detail/self_contact.h"

namespace limber::fem::detail {

template <class E>
struct ElementTable {
  std::vector<E> elements;
  std::vector<Block<E>> blocks;  // the same in columns; a body begins with a block of its own
  struct Range {
    int element, block, count;
  };
  std::vector<Range> ranges;  // of a body
};

template <class E>
List<E> list_of(const ElementTable<E>& table) {
  return {table.elements.data(), table.blocks.data(), int(table.elements.size())};
}

// Those of one body.
template <class E>
List<E> list_of(const ElementTable<E>& table, int body) {
  const auto [element, block, count] = table.ranges[std::size_t(body)];
  return {table.elements.data() + element, table.blocks.data() + block, count};
}

// Of the moving bodies.
template <class Real>
struct ElementTables {
  ElementTable<Spring<Real>> springs;         // every edge of a body of springs once, i < j, ascending
  ElementTable<Dashpot<Real>> dashpots;       // every edge of a Neo-Hookean body
  ElementTable<VolumeElement<Real>> volumes;  // tets
  ElementTable<NeoHookeanElement<Real>> neo_hookeans;
};
template <class Real>
Elements<Real> elements_of(const ElementTables<Real>& t) {
  return {list_of(t.springs), list_of(t.dashpots), list_of(t.volumes), list_of(t.neo_hookeans)};
}
template <class Real>
Elements<Real> elements_of(const ElementTables<Real>& t, int body) {
  return {list_of(t.springs, body), list_of(t.dashpots, body), list_of(t.volumes, body),
          list_of(t.neo_hookeans, body)};
}
// Calls each(table) for the four of them, or each(a, b) for those of two.
template <class Each, class... Tables>
void for_each_table(const Each& each, Tables&&... t) {
  each(t.springs...), each(t.dashpots...), each(t.volumes...), each(t.neo_hookeans...);
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
