// What the steppers read of a World: flat arrays in the order in which they are walked.
#pragma once

#include <vector>

#include "fem/detail/kernels.h"

namespace limber::fem::detail {

template <class Real>
struct Tables {
  std::vector<Spring<Real>> springs;             // every edge of the moving bodies once, i < j, ascending
  std::vector<VolumeElement<Real>> volumes;      // tets of the moving bodies
  std::vector<SpringBlock<Real>> spring_blocks;  // the same in columns
  std::vector<VolumeBlock<Real>> volume_blocks;
  std::vector<Real> node_mass;       // a world node
  std::vector<Real> inverse_mass;    // a world node; 0: never moves
  std::vector<Real> rest_positions;  // (3 × nodes)
  std::vector<Real>
      rest_from_center;             // (3 × robot nodes) place in the rest shape seen from its centre of mass
  std::vector<Real> pair_friction;  // [body a × bodies + body b]
  std::vector<Real> skin;           // a body: share of its mean edge by which contact candidates may be old
};

template <class Real>
Elements<Real> elements_of(const Tables<Real>& t) {
  return {t.springs.data(), t.spring_blocks.data(), int(t.springs.size()),
          t.volumes.data(), t.volume_blocks.data(), int(t.volumes.size())};
}

// Connectivity for contact, world nodes and world tets. Face i of a tet is opposite its node i.
struct Topology {
  struct Tet {
    int node[4];
    int face[4][3];  // nodes of each face, ascending: two tets compute the same plane from the same face
    float sign[4];   // +1 or −1: makes det(face − p) positive for p inside
    int across[4];   // the tet behind each face, −1 outside
  };
  std::vector<Tet> tets;
  // Where a body may touch another: its surface vertices, then the middles of its surface edges. (Vertices
  // alone miss an edge that cuts an edge: measured, up to 16 % of a coarse robot's size.)
  struct Point {
    int node[2];                       // a vertex: twice the same
    float share[2];                    // of the two nodes: 1 and 0, or a half each
    int neighbor_begin, neighbor_end;  // in neighbors
  };
  std::vector<Point> points;
  std::vector<int>
      neighbors;  // nodes that share a tet with all of a point's nodes, without the vertex itself, ascending
  struct Body {
    int first_node, last_node, first_tet, last_tet, first_point, last_point;
    bool moving;
    std::vector<int> surface_nodes;  // world nodes, ascending
  };
  std::vector<Body> bodies;
};

}  // namespace limber::fem::detail
