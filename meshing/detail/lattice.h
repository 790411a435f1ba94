// The body-centred cubic lattice: two cubic grids A and B, B shifted by half a cell, and twelve congruent
// tets a cell with dihedrals of 60 and 90 degrees (Labelle and Shewchuk 2007, section 2). Here only the
// pattern; cage.cpp chooses tets from it.
#pragma once

#include <array>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

using LatticeCell = Eigen::Vector3i;

// A node is (cell, kind): A sits in the cell's lower corner, B in its middle.
struct LatticeNode {
  LatticeCell cell;
  int kind;  // 0: A, 1: B
  bool operator==(const LatticeNode&) const = default;
};
// A tet is (cell, which of twelve).
struct LatticeTet {
  LatticeCell cell;
  int which;
};

constexpr int tets_a_cell = 12;
constexpr int tets_a_node = 24;

// The pattern round cell 0; shift the cells to use it elsewhere.
struct Pattern {
  std::array<std::array<LatticeNode, 4>, tets_a_cell> corners;    // positive
  std::array<std::array<LatticeTet, 4>, tets_a_cell> neighbours;  // across the face opposite corner i
  // Round each kind of node: its tets, and for each the three of them that share a face with it.
  std::array<std::array<LatticeTet, tets_a_node>, 2> star;
  std::array<std::array<std::array<int, 3>, tets_a_node>, 2> star_neighbours;
};
const Pattern& pattern();

// A box of cells, and where it lies.
struct Lattice {
  Vec3 origin;                   // of cell 0
  double spacing;                // edge of a cell
  LatticeCell cells;             // how many along each axis
  std::vector<Vec3> moved = {};  // by node_index, where each node went; empty when none did

  std::int64_t cell_count() const { return std::int64_t(cells.x()) * cells.y() * cells.z(); }
  bool holds(const LatticeCell& c) const {
    return (c.array() >= 0).all() && (c.array() < cells.array()).all();
  }
  int index(const LatticeCell& c) const { return (c.z() * cells.y() + c.y()) * cells.x() + c.x(); }
  LatticeCell cell(int index) const {
    return {index % cells.x(), index / cells.x() % cells.y(), index / cells.x() / cells.y()};
  }
  int tet_index(const LatticeTet& t) const { return index(t.cell) * tets_a_cell + t.which; }
  int node_index(const LatticeNode& n) const { return 2 * index(n.cell) + n.kind; }
  LatticeNode node(int node_index) const { return {cell(node_index / 2), node_index % 2}; }
  Vec3 place(const LatticeNode& n) const {
    return origin + 0.5 * spacing * (2 * n.cell.array() + n.kind).matrix().cast<double>();
  }
  Vec3 position(const LatticeNode& n) const {
    return moved.empty() || !holds(n.cell) ? place(n) : moved[node_index(n)];
  }
  std::array<Vec3, 4> tet_positions(int tet) const;
  LatticeNode tet_corner(int tet, int corner) const;
  // −1 outside the box of cells.
  int neighbour(int tet, int corner) const;
};

}  // namespace limber::meshing::detail
