#include "meshing/detail/edit_tets.h"

#include <algorithm>
#include <iterator>

namespace limber::meshing::detail {

EditTets::EditTets(const TetMesh& mesh)
    : positions(std::size_t(mesh.positions.rows())),
      tets(std::size_t(mesh.tets.rows())),
      star(positions.size()),
      tet_count(int(mesh.tets.rows())) {
  for (std::size_t v = 0; v < positions.size(); ++v) positions[v] = mesh.positions.row(Eigen::Index(v));
  for (int t = 0; t < int(tets.size()); ++t)
    for (int k = 0; k < 4; ++k) {
      tets[t][k] = mesh.tets(t, k);
      star[tets[t][k]].push_back(t);
    }
}

TetMesh EditTets::mesh() const {
  std::vector<int> row(positions.size(), -1);
  int vertices = 0;
  for (std::size_t v = 0; v < row.size(); ++v)
    if (!star[v].empty()) row[v] = vertices++;
  TetMesh m{Points(vertices, 3), Tets(tet_count, 4)};
  for (std::size_t v = 0; v < row.size(); ++v)
    if (row[v] >= 0) m.positions.row(row[v]) = positions[v];
  Eigen::Index next = 0;
  for (const auto& tet : tets) {
    if (tet[0] < 0) continue;
    for (int k = 0; k < 4; ++k) m.tets(next, k) = row[tet[k]];
    ++next;
  }
  return m;
}

std::array<Vec3, 4> EditTets::corners(int tet) const {
  const auto& [a, b, c, d] = tets[tet];
  return {positions[a], positions[b], positions[c], positions[d]};
}

std::array<Vec3, 4> EditTets::corners_with(int tet, int v, const Vec3& place) const {
  std::array<Vec3, 4> p = corners(tet);
  for (int k = 0; k < 4; ++k)
    if (tets[tet][k] == v) p[k] = place;
  return p;
}

std::vector<int> EditTets::tets_round(int v, int w) const {
  std::vector<int> ring;
  std::set_intersection(star[v].begin(), star[v].end(), star[w].begin(), star[w].end(),
                        std::back_inserter(ring));
  return ring;
}

std::vector<std::array<int, 2>> EditTets::boundary_round(int v) const {
  static constexpr int face[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::vector<std::array<int, 2>> sides;
  for (int t : star[v])
    for (const auto& f : face)
      for (int k = 0; k < 3; ++k)
        if (tets[t][f[k]] == v) sides.push_back({tets[t][f[(k + 1) % 3]], tets[t][f[(k + 2) % 3]]});
  // Inside the mesh each is there twice, once in each direction.
  std::vector<std::array<int, 2>> sorted = sides, boundary;
  std::sort(sorted.begin(), sorted.end());
  for (const auto& [a, b] : sides)
    if (!std::binary_search(sorted.begin(), sorted.end(), std::array{b, a})) boundary.push_back({a, b});
  return boundary;
}

}  // namespace limber::meshing::detail
