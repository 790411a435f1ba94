// What contact of a body with itself needs to know of its mesh. Method: docs/contact.md.
#pragma once

#include <vector>

namespace limber::fem::detail {

struct Topology;

// Lists, one after another: list k is items [begin[k], begin[k + 1]).
struct Lists {
  std::vector<int> begin, items;
};

struct SelfContact {
  Lists near_tets;   // a node (from the body's first): tets with a node that shares a tet with it, ascending
  Lists near_faces;  // a tet (from the body's first): surface faces of the tets that share a node with it
  Lists node_faces;  // a node: surface faces that have it. Faces are 4 × tet + face.
};

// Of one body; numbers in the lists are those of the world.
SelfContact self_contact(const Topology&, int body);

}  // namespace limber::fem::detail
