#include "meshing/detail/lattice.h"

#include <algorithm>

#include "core/error.h"

namespace limber::meshing::detail {
namespace {

LatticeCell half_units(const LatticeNode& n) { return 2 * n.cell + LatticeCell::Constant(n.kind); }

// Each edge between two A neighbours has a ring of four B nodes; the edge and two successive ones make a tet.
std::array<std::array<LatticeNode, 4>, tets_a_cell> corners_of_cell() {
  std::array<std::array<LatticeNode, 4>, tets_a_cell> corners;
  for (int axis = 0; axis < 3; ++axis) {
    const LatticeCell e = LatticeCell::Unit(axis), u = LatticeCell::Unit((axis + 1) % 3),
                      v = LatticeCell::Unit((axis + 2) % 3);
    const std::array<LatticeCell, 4> ring{LatticeCell(0, 0, 0), LatticeCell(-u), LatticeCell(-u - v),
                                          LatticeCell(-v)};
    for (int k = 0; k < 4; ++k) {
      auto& c = corners[4 * axis + k];
      c = {LatticeNode{LatticeCell::Zero(), 0}, LatticeNode{e, 0}, LatticeNode{ring[k], 1},
           LatticeNode{ring[(k + 1) % 4], 1}};
      std::array<Vec3, 4> p;
      std::transform(c.begin(), c.end(), p.begin(),
                     [](const LatticeNode& n) -> Vec3 { return half_units(n).cast<double>(); });
      if (signed_volume(p[0], p[1], p[2], p[3]) < 0) std::swap(c[2], c[3]);
    }
  }
  return corners;
}

bool has(const std::array<LatticeNode, 4>& corners, const LatticeCell& shift, const LatticeNode& node) {
  return std::any_of(corners.begin(), corners.end(), [&](const LatticeNode& n) {
    return LatticeNode{n.cell + shift, n.kind} == node;
  });
}

template <class Visit>
void for_cells_around(Visit visit) {
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) visit(LatticeCell(x, y, z));
}

Pattern make_pattern() {
  Pattern p;
  p.corners = corners_of_cell();
  const auto find_across = [&](int which, int corner) {
    LatticeTet found{LatticeCell::Zero(), -1};
    for_cells_around([&](const LatticeCell& shift) {
      for (int other = 0; other < tets_a_cell; ++other) {
        if (shift == LatticeCell::Zero() && other == which) continue;
        bool shares = true;
        for (int k = 0; k < 4; ++k)
          if (k != corner) shares = shares && has(p.corners[other], shift, p.corners[which][k]);
        if (shares) found = {shift, other};
      }
    });
    LIMBER_CHECK(found.which >= 0, which, corner);
    return found;
  };
  for (int which = 0; which < tets_a_cell; ++which)
    for (int corner = 0; corner < 4; ++corner) p.neighbours[which][corner] = find_across(which, corner);

  for (int kind = 0; kind < 2; ++kind) {
    const LatticeNode node{LatticeCell::Zero(), kind};
    int count = 0;
    for_cells_around([&](const LatticeCell& shift) {
      for (int which = 0; which < tets_a_cell; ++which)
        if (has(p.corners[which], shift, node)) p.star[kind].at(count++) = {shift, which};
    });
    LIMBER_CHECK(count == tets_a_node, count);
    for (int i = 0; i < tets_a_node; ++i) {
      const LatticeTet& tet = p.star[kind][i];
      int found = 0;
      for (int corner = 0; corner < 4; ++corner) {
        const LatticeTet& across = p.neighbours[tet.which][corner];
        for (int j = 0; j < tets_a_node; ++j)
          if (p.star[kind][j].cell == tet.cell + across.cell && p.star[kind][j].which == across.which)
            p.star_neighbours[kind][i].at(found++) = j;
      }
      LIMBER_CHECK(found == 3, found);
    }
  }
  return p;
}

}  // namespace

const Pattern& pattern() {
  static const Pattern p = make_pattern();
  return p;
}

LatticeNode Lattice::tet_corner(int tet, int corner) const {
  const LatticeNode& n = pattern().corners[tet % tets_a_cell][corner];
  return {cell(tet / tets_a_cell) + n.cell, n.kind};
}

std::array<Vec3, 4> Lattice::tet_positions(int tet) const {
  return {position(tet_corner(tet, 0)), position(tet_corner(tet, 1)), position(tet_corner(tet, 2)),
          position(tet_corner(tet, 3))};
}

int Lattice::neighbour(int tet, int corner) const {
  const LatticeTet& across = pattern().neighbours[tet % tets_a_cell][corner];
  const LatticeCell c = cell(tet / tets_a_cell) + across.cell;
  return holds(c) ? tet_index({c, across.which}) : -1;
}

}  // namespace limber::meshing::detail
