#include "meshing/detail/paper_cage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "meshing/detail/delaunay.h"
#include "meshing/repair.h"

namespace limber::meshing::detail {

namespace {

using Pair = std::pair<int, int>;

// Of corners or faces and the shells that have them: the pairs of shells with one in common.
template <class Thing>
std::set<Pair> pairs_that_share(const std::map<Thing, std::set<int>>& owners) {
  std::set<Pair> pairs;
  for (const auto& [thing, shells] : owners)
    for (const int a : shells)
      for (const int b : shells)
        if (a < b) pairs.insert({a, b});
  return pairs;
}

// How far a point lies beyond the farthest plane of a shell; negative inside.
double stands_off(const ConvexShell& shell, const Vec3& p) {
  double farthest = -1e300;
  for (const auto t : shell.triangles.rowwise()) {
    const Vec3 a = shell.vertices.row(t[0]), b = shell.vertices.row(t[1]), c = shell.vertices.row(t[2]);
    farthest = std::max(farthest, (b - a).cross(c - a).normalized().dot(p - a));
  }
  return farthest;
}

}  // namespace

PaperCage paper_cage(const std::vector<ConvexShell>& shells, double diagonal) {
  Eigen::Index corners = 0;
  for (const ConvexShell& shell : shells) corners += shell.vertices.rows();
  Points all(corners, 3);
  Eigen::Index first = 0;
  for (const ConvexShell& shell : shells) {
    all.middleRows(first, shell.vertices.rows()) = shell.vertices;
    first += shell.vertices.rows();
  }
  const std::vector<int> lowest = weld(all, paper_weld * diagonal);

  PaperCage cage;
  std::vector<int> node_from_corner(std::size_t(corners), -1);
  std::vector<std::array<int, 4>> tets;
  std::vector<Vec3> nodes;
  std::map<int, std::set<int>> owners_of_node;
  std::map<std::array<int, 3>, std::set<int>> owners_of_face;
  first = 0;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    std::set<int> distinct;  // corners after the weld
    for (Eigen::Index v = 0; v < shells[s].vertices.rows(); ++v)
      distinct.insert(lowest[std::size_t(first + v)]);
    first += shells[s].vertices.rows();
    for (Eigen::Index v = 0; v < corners; ++v)
      if (lowest[std::size_t(v)] == int(v) && stands_off(shells[s], all.row(v)) <= paper_weld * diagonal)
        distinct.insert(int(v));  // of a neighbour, on the face between them
    const std::vector<int> own(distinct.begin(), distinct.end());
    Points points(Eigen::Index(own.size()), 3);
    for (std::size_t i = 0; i < own.size(); ++i) points.row(Eigen::Index(i)) = all.row(own[i]);
    for (const std::array<int, 4>& tet : delaunay_tets(points)) {
      std::array<int, 4> named;
      for (std::size_t k = 0; k < 4; ++k) {
        int& node = node_from_corner[std::size_t(own[std::size_t(tet[k])])];
        if (node < 0) {
          node = int(nodes.size());
          nodes.push_back(points.row(tet[k]));
        }
        named[k] = node;
        owners_of_node[node].insert(int(s));
      }
      for (std::size_t k = 0; k < 4; ++k) {
        std::array<int, 3> face{named[(k + 1) % 4], named[(k + 2) % 4], named[(k + 3) % 4]};
        std::sort(face.begin(), face.end());
        owners_of_face[face].insert(int(s));
      }
      tets.push_back(named);
      cage.shell_from_tet.push_back(int(s));
    }
  }
  cage.mesh.positions.resize(Eigen::Index(nodes.size()), 3);
  for (std::size_t v = 0; v < nodes.size(); ++v) cage.mesh.positions.row(Eigen::Index(v)) = nodes[v];
  cage.mesh.tets.resize(Eigen::Index(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t)
    cage.mesh.tets.row(Eigen::Index(t)) << tets[t][0], tets[t][1], tets[t][2], tets[t][3];

  cage.notes.push_back(
      "mode paper: tets as the shells give them; the budget, the dihedrals and enclosure are not heeded");
  cage.notes.push_back(fmt::format(
      "mode paper: corners within {} of the diagonal of each other or of another shell are shared, which "
      "leaves {} of {}; "
      "{} of the {} pairs of shells that share corners share a face: elsewhere neighbours overlap or gape",
      paper_weld, nodes.size(), corners, pairs_that_share(owners_of_face).size(),
      pairs_that_share(owners_of_node).size()));
  return cage;
}

}  // namespace limber::meshing::detail
