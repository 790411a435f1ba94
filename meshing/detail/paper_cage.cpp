#include "meshing/detail/paper_cage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

#include "meshing/detail/delaunay.h"

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

// The least of its heights: three times its volume over its largest face.
double thickness(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double largest = std::max({(b - a).cross(c - a).norm(), (b - a).cross(d - a).norm(),
                                   (c - a).cross(d - a).norm(), (c - b).cross(d - b).norm()}) /
                         2;
  return largest > 0 ? 3 * signed_volume(a, b, c, d) / largest : 0;
}

// For each point the first that is a place of its own and nearer than `reach`, or itself.
std::vector<int> places_of(const Points& points, double reach) {
  std::vector<int> place(std::size_t(points.rows())), own;
  for (int v = 0; v < int(points.rows()); ++v) {
    const auto near = std::find_if(own.begin(), own.end(), [&](int other) {
      return (points.row(other) - points.row(v)).norm() <= reach;
    });
    place[std::size_t(v)] = near == own.end() ? v : *near;
    if (near == own.end()) own.push_back(v);
  }
  return place;
}

struct Tet {
  std::array<int, 4> corners;
  int shell;
};

class Tetrahedra {
 public:
  Tetrahedra(const std::vector<ConvexShell>& shells, double weld_m, double share_m) : weld_m_(weld_m) {
    Eigen::Index corners = 0;
    for (const ConvexShell& shell : shells) corners += shell.vertices.rows();
    all_.resize(corners, 3);
    Eigen::Index first = 0;
    for (const ConvexShell& shell : shells) {
      all_.middleRows(first, shell.vertices.rows()) = shell.vertices;
      first += shell.vertices.rows();
    }
    const std::vector<int> place = places_of(all_, weld_m);
    first = 0;
    for (std::size_t s = 0; s < shells.size(); ++s) {
      std::set<int> own;  // corners after the weld
      for (Eigen::Index v = 0; v < shells[s].vertices.rows(); ++v) own.insert(place[std::size_t(first + v)]);
      first += shells[s].vertices.rows();
      for (int v = 0; v < int(corners); ++v)
        if (place[std::size_t(v)] == v && stands_off(shells[s], all_.row(v)) <= share_m)
          own.insert(v);  // of a neighbour, on the face between them
      add({own.begin(), own.end()}, int(s));
    }
  }

  const Points& corners() const { return all_; }
  const std::vector<Tet>& tets() const { return tets_; }
  int thin() const { return thin_; }
  int in_the_way() const { return in_the_way_; }

 private:
  Vec3 corner(int c) const { return all_.row(c); }

  void add(const std::vector<int>& own, int shell) {
    Points points(Eigen::Index(own.size()), 3);
    for (std::size_t i = 0; i < own.size(); ++i) points.row(Eigen::Index(i)) = all_.row(own[i]);
    for (const std::array<int, 4>& tet : delaunay_tets(points)) {
      std::array<int, 4> named;
      for (std::size_t k = 0; k < 4; ++k) named[k] = own[std::size_t(tet[k])];
      if (thickness(corner(named[0]), corner(named[1]), corner(named[2]), corner(named[3])) <
          paper_thinnest * weld_m_)
        ++thin_;
      else if (!fits(named))
        ++in_the_way_;
      else
        tets_.push_back({named, shell});
    }
  }

  // Whether no face has a tet on that side yet; takes those sides then.
  bool fits(const std::array<int, 4>& tet) {
    std::array<std::pair<std::array<int, 3>, bool>, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<int, 3> face{tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      sides[k] = {face, signed_volume(corner(face[0]), corner(face[1]), corner(face[2]), corner(tet[k])) > 0};
      if (taken_.contains(sides[k])) return false;
    }
    taken_.insert(sides.begin(), sides.end());
    return true;
  }

  const double weld_m_;
  Points all_;  // corners of all shells
  std::vector<Tet> tets_;
  std::set<std::pair<std::array<int, 3>, bool>> taken_;  // faces, and on which side of them
  int thin_ = 0, in_the_way_ = 0;
};

}  // namespace

PaperCage paper_cage(const std::vector<ConvexShell>& shells, double diagonal, int max_tets) {
  double weld = paper_weld;
  std::optional<Tetrahedra> made(std::in_place, shells, weld * diagonal, paper_weld * diagonal);
  while (int(made->tets().size()) > max_tets && weld < paper_max_weld) {
    weld *= 1.1;
    made.emplace(shells, weld * diagonal, paper_weld * diagonal);
  }

  PaperCage cage;
  std::vector<int> node_from_corner(std::size_t(made->corners().rows()), -1);
  std::vector<Vec3> nodes;
  std::map<int, std::set<int>> owners_of_node;
  std::map<std::array<int, 3>, std::set<int>> owners_of_face;
  cage.mesh.tets.resize(Eigen::Index(made->tets().size()), 4);
  for (std::size_t t = 0; t < made->tets().size(); ++t) {
    const auto& [corners, shell] = made->tets()[t];
    for (std::size_t k = 0; k < 4; ++k) {
      int& node = node_from_corner[std::size_t(corners[k])];
      if (node < 0) {
        node = int(nodes.size());
        nodes.push_back(made->corners().row(corners[k]));
      }
      cage.mesh.tets(Eigen::Index(t), Eigen::Index(k)) = node;
      owners_of_node[node].insert(shell);
      std::array<int, 3> face{corners[(k + 1) % 4], corners[(k + 2) % 4], corners[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      owners_of_face[face].insert(shell);
    }
    cage.shell_from_tet.push_back(shell);
  }
  cage.mesh.positions.resize(Eigen::Index(nodes.size()), 3);
  for (std::size_t v = 0; v < nodes.size(); ++v) cage.mesh.positions.row(Eigen::Index(v)) = nodes[v];

  cage.notes.push_back(
      fmt::format("mode paper: {} tets as the shells give them, of at most {} that were asked for; dihedrals "
                  "and enclosure are not heeded",
                  made->tets().size(), max_tets));
  if (shells.size() > 1)
    cage.notes.push_back(
        fmt::format("mode paper: corners within {:.3g} of the diagonal of each other or of another shell are "
                    "shared, which leaves {} of {}; {} of the {} pairs of shells that share corners share a "
                    "face: elsewhere neighbours overlap or gape",
                    weld, nodes.size(), made->corners().rows(), pairs_that_share(owners_of_face).size(),
                    pairs_that_share(owners_of_node).size()));
  if (made->thin() + made->in_the_way() > 0)
    cage.notes.push_back(fmt::format(
        "mode paper: left out are {} tets thinner than {} of that, and {} where a neighbour's are",
        made->thin(), paper_thinnest, made->in_the_way()));
  return cage;
}

}  // namespace limber::meshing::detail
