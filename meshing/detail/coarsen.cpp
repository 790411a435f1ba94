#include "meshing/detail/coarsen.h"

#include <algorithm>
#include <optional>
#include <set>

#include "meshing/detail/edit_tets.h"

namespace limber::meshing::detail {
namespace {

class Coarsener {
 public:
  Coarsener(const CageModel& model, const TetLimits& limits, const TetMesh& mesh)
      : model_(model),
        limits_(limits),
        tets_(mesh),
        on_boundary_(tets_.positions.size()),
        glued_(tets_.tets.size()) {
    for (int v : vertices_of(boundary_triangles(mesh.tets))) on_boundary_[v] = true;
  }

  void run(int max_tets) {
    std::vector<bool> changed(tets_.positions.size(), true);
    while (tets_.tet_count > max_tets) {
      // What was refused before is asked again only where something changed since.
      std::vector<bool> changes(changed.size(), false);
      bool any = false;
      for (const Collapse& c : collapses(changed)) {
        if (tets_.tet_count <= max_tets) return;
        // An earlier one may have taken the edge.
        if (tets_.tets_round(c.from, c.to).empty() || !allowed(c.from, c.to)) continue;
        for (int t : tets_.star[c.from])
          for (int v : tets_.tets[t]) changes[v] = true;
        apply(c.from, c.to);
        any = true;
      }
      if (!any) return;
      changed = std::move(changes);
    }
  }
  TetMesh mesh() const { return tets_.mesh(); }

 private:
  struct Collapse {
    double length;
    int from, to;
    auto operator<=>(const Collapse&) const = default;
  };

  std::vector<Collapse> collapses(const std::vector<bool>& changed) const {
    std::set<std::array<int, 2>> edges;
    for (const auto& tet : tets_.tets)
      for (int i = 0; i < 4 && tet[0] >= 0; ++i)
        for (int j = 0; j < 4; ++j)
          if (i != j) edges.insert({tet[i], tet[j]});
    std::vector<Collapse> all;
    for (const auto& [v, w] : edges)
      if ((changed[v] || changed[w]) && (!on_boundary_[v] || on_boundary_[w]))
        all.push_back({(tets_.positions[v] - tets_.positions[w]).norm(), v, w});
    std::sort(all.begin(), all.end());
    return all;
  }

  bool allowed(int v, int w) const {
    return (!on_boundary_[v] || keeps_boundary(v, w)) && keeps_links(v, w) && keeps_tets(v, w);
  }

  // Inwards of every boundary triangle, through nothing of the surface, and along the boundary.
  bool keeps_boundary(int v, int w) const {
    const Vec3 &from = tets_.positions[v], &to = tets_.positions[w];
    std::set<int> beside_v, beside_w;
    int at_edge = 0;
    const auto round_v = tets_.boundary_round(v);
    for (const auto& [a, b] : round_v) at_edge += a == w || b == w;
    if (at_edge != 2) return false;
    for (const auto& [a, b] : round_v) beside_v.insert(a);
    for (const auto& [a, b] : tets_.boundary_round(w)) beside_w.insert(a);
    int shared = 0;
    for (int a : beside_v) shared += int(beside_w.count(a));
    if (shared != 2) return false;
    for (const auto& [a, b] : round_v) {
      if (a == w || b == w) continue;
      const Vec3 &p = tets_.positions[a], &q = tets_.positions[b];
      if (orientation(from, p, q, to) > 0 || model_.tree.meets_tet(from, p, q, to)) return false;
    }
    return true;
  }

  // What touches both ends must touch the edge (the link condition of Dey, Edelsbrunner, Guha, Nekhayev
  // 1999); else the mesh would be pinched.
  bool keeps_links(int v, int w) const {
    std::set<int> near_v, near_edge;
    std::set<std::array<int, 2>> edges_v, edges_edge;
    const auto sorted = [](int a, int b) { return std::array{std::min(a, b), std::max(a, b)}; };
    const auto add = [&](int t, int skip, int skip_too, std::set<int>& near, auto& edges) {
      const auto& tet = tets_.tets[t];
      for (int i = 0; i < 4; ++i) {
        if (tet[i] == skip || tet[i] == skip_too) continue;
        near.insert(tet[i]);
        for (int j = 0; j < i; ++j)
          if (tet[j] != skip && tet[j] != skip_too) edges.insert(sorted(tet[i], tet[j]));
      }
    };
    const std::vector<int> ring = tets_.tets_round(v, w);
    for (int t : ring) add(t, v, w, near_edge, edges_edge);
    for (int t : tets_.star[v]) add(t, v, w, near_v, edges_v);
    for (int t : tets_.star[w]) {
      std::set<int> near;
      std::set<std::array<int, 2>> edges;
      add(t, v, w, near, edges);
      for (int a : near)
        if (near_v.count(a) && !near_edge.count(a)) return false;
      for (const auto& e : edges)
        if (edges_v.count(e) && !edges_edge.count(e)) return false;
      if (near.size() < 3) continue;
      // A tet on the same triangle at each end.
      for (int s : tets_.star[v]) {
        int same = 0;
        for (int a : tets_.tets[s]) same += int(near.count(a));
        if (same == 3) return false;
      }
    }
    return true;
  }

  bool keeps_tets(int v, int w) const {
    std::vector<std::array<Vec3, 4>> after;
    for (int t : tets_.star[v]) {
      const auto& tet = tets_.tets[t];
      if (std::find(tet.begin(), tet.end(), w) != tet.end()) continue;
      after.push_back(tets_.corners_with(t, v, tets_.positions[w]));
      const auto& [a, b, c, d] = after.back();
      if (!keeps_limits(limits_, a, b, c, d)) return false;
    }
    int glued = 0, glued_before = -1;
    for (const auto& corners : after) {
      if (!is_glued(model_, corners)) continue;
      if (glued_before < 0) glued_before = glued_round(v);
      if (++glued > glued_before) return false;
    }
    return true;
  }

  int glued_round(int v) const {
    int count = 0;
    for (int t : tets_.star[v]) {
      std::optional<bool>& glued = glued_[t];
      if (!glued) glued = is_glued(model_, tets_.corners(t));
      count += *glued;
    }
    return count;
  }

  void apply(int v, int w) {
    for (int t : tets_.tets_round(v, w)) {
      for (int u : tets_.tets[t]) {
        auto& star = tets_.star[u];
        star.erase(std::find(star.begin(), star.end(), t));
      }
      tets_.tets[t] = {-1, -1, -1, -1};
      --tets_.tet_count;
    }
    auto& star = tets_.star[w];
    for (int t : tets_.star[v]) {
      std::replace(tets_.tets[t].begin(), tets_.tets[t].end(), v, w);
      glued_[t].reset();
      star.insert(std::lower_bound(star.begin(), star.end(), t), t);
    }
    tets_.star[v].clear();
  }

  const CageModel& model_;
  TetLimits limits_;
  EditTets tets_;
  std::vector<bool> on_boundary_;
  mutable std::vector<std::optional<bool>> glued_;  // of each tet, once it was asked
};

}  // namespace

void coarsen(const CageModel& model, const TetLimits& limits, int tets, TetMesh& mesh) {
  Coarsener coarsener(model, limits, mesh);
  coarsener.run(tets);
  mesh = coarsener.mesh();
}

}  // namespace limber::meshing::detail
