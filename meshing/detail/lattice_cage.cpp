#include "meshing/detail/lattice_cage.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "core/mass_properties.h"
#include "core/threads.h"
#include "meshing/detail/edges.h"

namespace limber::meshing::detail {
namespace {

enum State : std::uint8_t { unknown, outside, inside, touched, filled };

bool kept(std::uint8_t state) { return state > outside; }

struct Grid {
  Lattice lattice;
  std::vector<std::uint8_t> state;  // of each tet
};

Box box_of_triangles(const SurfaceMesh& surface) {
  Box all;
  for (Eigen::Index i = 0; i < surface.triangles.size(); ++i)
    all.include(Vec3(surface.positions.row(surface.triangles.data()[i])));
  return all;
}

Lattice lattice_round(const Box& box, double spacing, const Vec3& phase) {
  constexpr int margin = 3;  // cells: room for what mending adds, and for neighbours of neighbours
  Lattice lattice;
  lattice.spacing = spacing;
  lattice.origin = box.lower - spacing * (Vec3::Constant(margin) + phase);
  const Vec3 cells = (box.size() / spacing).array().ceil() + 2 * margin + 1;
  // As doubles first: a product of ints would overflow.
  lattice.cells = cells.prod() <= double(max_cells) ? LatticeCell(cells.cast<int>()) : LatticeCell::Zero();
  return lattice;
}

// The cells whose tets, wherever their nodes were moved to, may meet the surface.
std::vector<int> cells_near(const CageModel& model, const Lattice& lattice) {
  // The tets of a cell reach from half a cell below its lower corner to its upper corner, and nodes move by
  // less than a half: so they lie within [−1, 1.5] cells of the lower corner.
  const double to_middle = 0.25, half_width = 1.25;
  std::vector<char> near(std::size_t(lattice.cell_count()));
  const std::vector<TrianglePiece> pieces =
      pieces_of(model.surface.positions, model.surface.triangles, lattice.spacing);
  parallel_for_many(int(pieces.size()), [&](int i) {
    const TrianglePiece& piece = pieces[std::size_t(i)];
    std::array<Vec3, 3> p;
    for (int k = 0; k < 3; ++k)
      p[k] = (model.surface.positions.row(model.surface.triangles(piece.triangle, k)).transpose() -
              lattice.origin) /
             lattice.spacing;
    const Box box{(piece.box.lower - lattice.origin) / lattice.spacing,
                  (piece.box.upper - lattice.origin) / lattice.spacing};
    const Vec3 n = (p[1] - p[0]).cross(p[2] - p[0]);
    const double reach = (half_width + 1e-6) * n.cwiseAbs().sum();  // of a cell's box along n
    const LatticeCell first = (box.lower.array() - 1.5).floor().cast<int>(),
                      last = (box.upper.array() + 1).floor().cast<int>();
    for (int z = first.z(); z <= last.z(); ++z)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int x = first.x(); x <= last.x(); ++x)
          if (std::abs(n.dot(Vec3(x + to_middle, y + to_middle, z + to_middle) - p[0])) <= reach)
            std::atomic_ref(near[std::size_t(lattice.index({x, y, z}))]).store(1, std::memory_order_relaxed);
  });
  std::vector<int> cells;
  for (int cell = 0; cell < int(near.size()); ++cell)
    if (near[cell]) cells.push_back(cell);
  return cells;
}

// Moves nodes that lie a little inside the surface to a little outside, as in isosurface stuffing (Labelle
// and Shewchuk 2007): a tet that the surface barely enters is then not needed at all. Nodes of a tet that
// would come out badly stay. At 1,000 tets this takes the bunny's volume ratio from 1.23 to 1.15, the camel's
// from 1.36 to 1.29.
void warp(const CageModel& model, const std::vector<int>& cells, const DihedralRange& limits,
          Lattice& lattice) {
  constexpr double reach = 0.35, beyond = 0.12;  // in cells; 0.3 … 0.4 and 0.1 … 0.15 do alike
  std::vector<Vec3> place(2 * std::size_t(lattice.cell_count()));
  for (std::size_t n = 0; n < place.size(); ++n) place[n] = lattice.place(lattice.node(int(n)));
  lattice.moved = place;
  parallel_for(int(cells.size()), [&](int i) {
    for (int n : {2 * cells[i], 2 * cells[i] + 1}) {
      const Vec3& p = place[n];
      const std::optional<Vec3> nearest = model.tree.closest_point_within(p, reach * lattice.spacing);
      if (!nearest || *nearest == p) continue;
      const double distance = (p - *nearest).norm(), aim = beyond * lattice.spacing;
      if (model.winding.inside(p))
        lattice.moved[n] = *nearest - aim / distance * (p - *nearest);
      else if (distance < aim)
        lattice.moved[n] = *nearest + aim / distance * (p - *nearest);
    }
  });
  for (bool all_good = false; !all_good;) {
    std::vector<int> back;
    for (int cell : cells)
      for (int tet = cell * tets_a_cell; tet < (cell + 1) * tets_a_cell; ++tet) {
        const auto [a, b, c, d] = lattice.tet_positions(tet);
        const DihedralRange range = dihedral_range(a, b, c, d);
        if (signed_volume(a, b, c, d) > 0 && range.min_deg > limits.min_deg && range.max_deg < limits.max_deg)
          continue;
        for (int k = 0; k < 4; ++k) back.push_back(lattice.node_index(lattice.tet_corner(tet, k)));
      }
    for (int n : back) lattice.moved[n] = place[n];
    all_good = back.empty();
  }
}

void mark_touched(const CageModel& model, const std::vector<int>& cells, Grid& grid) {
  parallel_for(int(cells.size()), [&](int i) {
    for (int tet = cells[i] * tets_a_cell; tet < (cells[i] + 1) * tets_a_cell; ++tet) {
      const auto [a, b, c, d] = grid.lattice.tet_positions(tet);
      if (model.tree.meets_tet(a, b, c, d)) grid.state[tet] = touched;
    }
  });
}

// From each touched tet to the untouched ones beside it, and on through those that are inside.
void mark_inside(const CageModel& model, const std::vector<int>& touched_tets, Grid& grid) {
  const auto judge = [&](int tet) -> std::uint8_t {
    const auto [a, b, c, d] = grid.lattice.tet_positions(tet);
    return model.winding.inside(0.25 * (a + b + c + d)) ? inside : outside;
  };
  std::vector<int> pending;
  for (int start : touched_tets)
    for (int corner = 0; corner < 4; ++corner) {
      const int seed = grid.lattice.neighbour(start, corner);
      if (seed < 0 || grid.state[seed] != unknown) continue;
      grid.state[seed] = judge(seed);
      pending.push_back(seed);
      while (!pending.empty()) {
        const int tet = pending.back();
        pending.pop_back();
        // The verdict of one tet holds for all that it reaches when the model is closed. When it is open,
        // each is asked.
        if (!model.closed && grid.state[tet] == outside) continue;
        for (int k = 0; k < 4; ++k) {
          const int next = grid.lattice.neighbour(tet, k);
          if (next < 0 || grid.state[next] != unknown) continue;
          grid.state[next] = model.closed ? grid.state[tet] : judge(next);
          pending.push_back(next);
        }
      }
    }
}

using StarMask = std::uint32_t;  // of the tets round a node
constexpr StarMask whole_star = (1u << tets_a_node) - 1;

// The tets of `mask` that the lowest of them reaches through shared faces.
StarMask first_group(int kind, StarMask mask) {
  StarMask group = mask & -mask, grown = group;
  while (grown != 0) {
    StarMask next = 0;
    for (StarMask rest = grown; rest != 0; rest &= rest - 1)
      for (int j : pattern().star_neighbours[kind][std::countr_zero(rest)]) next |= 1u << j;
    grown = next & mask & ~group;
    group |= grown;
  }
  return group;
}

struct Star {
  std::array<int, tets_a_node> tets;  // −1 outside the lattice
  StarMask kept = 0;
};

Star star_of(const Grid& grid, const LatticeNode& node) {
  Star star;
  for (int i = 0; i < tets_a_node; ++i) {
    const LatticeTet& t = pattern().star[node.kind][i];
    const LatticeCell cell = node.cell + t.cell;
    star.tets[i] = grid.lattice.holds(cell) ? grid.lattice.tet_index({cell, t.which}) : -1;
    if (star.tets[i] >= 0 && kept(grid.state[star.tets[i]])) star.kept |= 1u << i;
  }
  return star;
}

// The tets that are missing round a node: each group of kept tets must leave the rest of the star in one
// piece, so that its boundary is one fan of triangles. The largest piece of the rest stays open, the others
// are filled.
StarMask missing(int kind, StarMask kept_tets) {
  for (StarMask todo = kept_tets; todo != 0;) {
    const StarMask group = first_group(kind, todo);
    todo &= ~group;
    StarMask largest = 0;
    for (StarMask rest = whole_star & ~group; rest != 0;) {
      const StarMask piece = first_group(kind, rest);
      rest &= ~piece;
      if (std::popcount(piece) > std::popcount(largest)) largest = piece;
    }
    const StarMask wanted = whole_star & ~group & ~largest & ~kept_tets;
    if (wanted != 0) return wanted;
  }
  return 0;
}

std::vector<int> nodes_of(const Lattice& lattice, const std::vector<int>& tets) {
  std::vector<int> nodes;
  nodes.reserve(4 * tets.size());
  for (int tet : tets)
    for (int k = 0; k < 4; ++k) nodes.push_back(lattice.node_index(lattice.tet_corner(tet, k)));
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::vector<int> kept_tets(const Grid& grid) {
  std::vector<int> tets;
  for (int t = 0; t < int(grid.state.size()); ++t)
    if (kept(grid.state[t])) tets.push_back(t);
  return tets;
}

// Only ever adds tets, so it ends.
void mend(Grid& grid) {
  for (std::vector<int> nodes = nodes_of(grid.lattice, kept_tets(grid)); !nodes.empty();) {
    std::vector<int> added;
    for (int index : nodes) {
      const LatticeNode node = grid.lattice.node(index);
      const Star star = star_of(grid, node);
      for (StarMask wanted = missing(node.kind, star.kept); wanted != 0; wanted &= wanted - 1) {
        const int tet = star.tets[std::countr_zero(wanted)];
        LIMBER_CHECK(tet >= 0, tet);
        grid.state[tet] = filled;
        added.push_back(tet);
      }
    }
    nodes = nodes_of(grid.lattice, added);
  }
}

}  // namespace

CageModel::CageModel(const SurfaceMesh& given)
    : surface(given),
      box(box_of_triangles(given)),
      tree(given.positions, given.triangles),
      winding(given.positions, given.triangles),
      side_before(std::size_t(given.triangles.size()), -1),
      closed(is_closed(given.triangles)) {
  for_each_edge(edge_uses(given.triangles), [&](std::span<const EdgeUse> uses) {
    for (std::size_t i = 1; i < uses.size(); ++i)
      side_before[std::size_t(3 * uses[i].triangle + uses[i].side)] =
          3 * uses[i - 1].triangle + uses[i - 1].side;
  });
}

Selection select_tets(const CageModel& model, double spacing, const Vec3& phase,
                      const std::optional<DihedralRange>& warp_within) {
  Grid grid{lattice_round(model.box, spacing, phase), {}};
  if (grid.lattice.cell_count() == 0) return {grid.lattice, {}, {}};
  grid.state.assign(std::size_t(grid.lattice.cell_count() * tets_a_cell), unknown);
  const std::vector<int> cells = cells_near(model, grid.lattice);
  if (warp_within) warp(model, cells, *warp_within, grid.lattice);
  mark_touched(model, cells, grid);
  mark_inside(model, kept_tets(grid), grid);
  mend(grid);
  Selection selection{grid.lattice, kept_tets(grid), {}};
  for (int tet : selection.tets) selection.touched.push_back(grid.state[tet] == touched);
  return selection;
}

LatticeMesh build_mesh(const Selection& selection) {
  const Lattice& lattice = selection.lattice;
  Grid grid{lattice, std::vector<std::uint8_t>(std::size_t(lattice.cell_count() * tets_a_cell), outside)};
  std::vector<int> row_from_tet(grid.state.size(), -1);
  for (std::size_t row = 0; row < selection.tets.size(); ++row) {
    grid.state[selection.tets[row]] = touched;
    row_from_tet[selection.tets[row]] = int(row);
  }
  LatticeMesh result;
  result.mesh.tets.setConstant(Eigen::Index(selection.tets.size()), 4, -1);
  std::vector<Vec3> positions;
  for (int index : nodes_of(lattice, selection.tets)) {
    const LatticeNode node = lattice.node(index);
    const Star star = star_of(grid, node);
    int copies = 0;
    for (StarMask todo = star.kept; todo != 0; ++copies) {
      const StarMask group = first_group(node.kind, todo);
      todo &= ~group;
      for (StarMask rest = group; rest != 0; rest &= rest - 1) {
        const int tet = star.tets[std::countr_zero(rest)];
        for (int k = 0; k < 4; ++k)
          if (lattice.tet_corner(tet, k) == node)
            result.mesh.tets(row_from_tet[tet], k) = int(positions.size());
      }
      positions.push_back(lattice.position(node));
    }
    result.split_vertices += copies > 1;
  }
  result.mesh.positions.resize(Eigen::Index(positions.size()), 3);
  for (std::size_t i = 0; i < positions.size(); ++i)
    result.mesh.positions.row(Eigen::Index(i)) = positions[i];
  return result;
}

}  // namespace limber::meshing::detail
