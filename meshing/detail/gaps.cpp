#include "meshing/detail/gaps.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

#include "core/threads.h"
#include "core/union_find.h"
#include "meshing/detail/edit_tets.h"
#include "meshing/detail/manifold.h"
#include "meshing/detail/tet_faces.h"

namespace limber::meshing::detail {
namespace {

using EdgeEnds = std::array<int, 2>;  // vertices, ascending

struct Gap {
  Vec3 middle;
  Vec3 across;  // from one side to the other
};

// The gap that the way from p to q crosses, if it crosses one: there the closest point of the surface leaps
// from one side of the gap to the other. Of several, the one nearest to the middle of the way.
std::optional<Gap> gap_on(const CageModel& model, double widest, const Vec3& p, const Vec3& q) {
  constexpr int steps = 12;
  constexpr double leap = 1.2;  // in steps; 1 … 2 do alike
  const Vec3 way = q - p;
  std::optional<Gap> gap;
  double off_center = 1;  // of the gap's middle, as a share of the way
  Vec3 x_before, nearest_before;
  for (int i = 0; i <= steps; ++i) {
    const Vec3 x = p + double(i) / steps * way, nearest = model.tree.closest_point(x);
    if (i > 0) {
      const Vec3 m = 0.5 * (nearest + nearest_before), to_side = 0.49 * (nearest - nearest_before);
      const double width = (nearest - nearest_before).norm();
      const double off = std::abs((m - p).dot(way) / way.squaredNorm() - 0.5);
      const bool leaps =
          width > leap * way.norm() / steps || (nearest - x).dot(nearest_before - x_before) < 0;
      if (leaps && width < widest && off < off_center && !model.winding.inside(m) &&
          model.tree.free_share(m, m + to_side) == 1 && model.tree.free_share(m, m - to_side) == 1)
        off_center = off, gap = {m, nearest - nearest_before};
    }
    x_before = x, nearest_before = nearest;
  }
  return gap;
}

class Splitter {
 public:
  Splitter(const CageModel& model, const GapLimits& limits, const TetMesh& mesh)
      : model_(model),
        limits_(limits),
        tets_(mesh),
        on_boundary_(tets_.positions.size(), false),
        in_gap_(tets_.positions.size(), false) {
    for (int v : vertices_of(boundary_triangles(mesh.tets))) on_boundary_[v] = true;
  }

  TetMesh mesh() const { return tets_.mesh(); }

  void split_edges_of(const std::vector<char>& glued) {
    constexpr double shortest = 0.4;  // edge that is split, in cells
    constexpr double near_end = 0.4;  // as a share of the edge
    std::set<EdgeEnds> edges;
    for (std::size_t t = 0; t < glued.size(); ++t)
      for (int i = 0; glued[t] && i < 4; ++i)
        for (int j = 0; j < i; ++j) {
          const int v = tets_.tets[t][i], w = tets_.tets[t][j];
          edges.insert({std::min(v, w), std::max(v, w)});
        }
    // Gaps are looked for at once; where an end has been moved since, again.
    struct Way {
      int p, q;
      Vec3 a, b;
      std::optional<Gap> gap;
    };
    std::vector<Way> ways;
    for (const auto& [p, q] : edges) ways.push_back({p, q, tets_.positions[p], tets_.positions[q], {}});
    const auto look = [&](Way& way) {
      way.gap.reset();
      if ((way.a - way.b).norm() >= shortest * limits_.spacing_m)
        way.gap = gap_on(model_, limits_.spacing_m, way.a, way.b);
    };
    parallel_for(int(ways.size()), [&](int i) { look(ways[std::size_t(i)]); });
    for (Way& way : ways) {
      const auto& [p, q, a, b, gap] = way;
      if (tets_.tet_count >= limits_.max_tets) return;
      if (a != tets_.positions[p] || b != tets_.positions[q]) {
        way.a = tets_.positions[p], way.b = tets_.positions[q];
        look(way);
      }
      if (!gap) continue;
      // An end that is near enough becomes the vertex in the gap, as in isosurface stuffing.
      const double share = (gap->middle - a).dot(b - a) / (b - a).squaredNorm();
      if (share < near_end && (in_gap_[p] || snap(p, *gap))) continue;
      if (share > 1 - near_end && (in_gap_[q] || snap(q, *gap))) continue;
      split(p, q, gap->middle);
    }
  }

  // Inner vertices go to the middle of their neighbours if that makes their worst tet better; those in a gap
  // only through the air.
  void relax() {
    for (int v = 0; v < int(tets_.positions.size()); ++v) {
      if (on_boundary_[v]) continue;
      Vec3 sum = Vec3::Zero();
      for (int t : tets_.star[v])
        for (int w : tets_.tets[t])
          if (w != v) sum += tets_.positions[w];
      const Vec3 before = tets_.positions[v], middle = sum / (3 * double(tets_.star[v].size()));
      if (in_gap_[v] && (model_.winding.inside(middle) || model_.tree.free_share(before, middle) < 1))
        continue;
      if (worst_angle(v, middle) > worst_angle(v, before)) tets_.positions[v] = middle;
    }
  }

 private:
  // Of the tets round v at a place: their smallest dihedral, or what the largest lacks to 180 degrees; 0 when
  // one does not keep the limits.
  double worst_angle(int v, const Vec3& place) const {
    double angle = 180;
    for (int t : tets_.star[v]) {
      const auto [a, b, c, d] = tets_.corners_with(t, v, place);
      if (!keeps_limits(limits_.tets, a, b, c, d)) return 0;
      const DihedralRange range = dihedral_range(a, b, c, d);
      angle = std::min({angle, range.min_deg, 180 - range.max_deg});
    }
    return angle;
  }

  // Moves an inner vertex across into the middle of a gap.
  bool snap(int v, const Gap& gap) {
    const Vec3 n = gap.across.normalized(), before = tets_.positions[v];
    const Vec3 place = before + n.dot(gap.middle - before) * n;
    if (on_boundary_[v] || !(worst_angle(v, place) > 0) || model_.winding.inside(place) ||
        model_.tree.free_share(gap.middle, place) < 1)
      return false;
    tets_.positions[v] = place;
    in_gap_[v] = true;
    return true;
  }

  // The third vertices of the boundary triangles at an edge: those that only one tet of the ring has.
  std::vector<int> boundary_beside(int p, int q, const std::vector<int>& ring) const {
    std::map<int, int> uses;
    for (int t : ring)
      for (int v : tets_.tets[t])
        if (v != p && v != q) ++uses[v];
    std::vector<int> beside;
    for (const auto& [v, count] : uses)
      if (count == 1) beside.push_back(v);
    return beside;
  }

  // Puts a vertex at the middle of the gap or, if the tets would come out badly, elsewhere in the gap: on the
  // edge, or nearer to its middle. On the boundary only the edge itself will do.
  void split(int p, int q, const Vec3& middle_of_gap) {
    const std::vector<int> ring = tets_.tets_round(p, q);
    const std::vector<int> beside = boundary_beside(p, q, ring);
    const Vec3 a = tets_.positions[p], b = tets_.positions[q];
    const double share = (middle_of_gap - a).dot(b - a) / (b - a).squaredNorm();
    if (share < 0.1 || share > 0.9) return;
    const Vec3 on_edge = a + share * (b - a), middle = 0.5 * (a + b);
    std::vector<Vec3> places;
    if (beside.empty()) places = {middle_of_gap, 0.5 * (middle_of_gap + on_edge)};
    if (model_.tree.free_share(middle_of_gap, on_edge) == 1)
      for (double to_middle : {0.0, 1.0, 0.5, 0.25})
        places.push_back((1 - to_middle) * on_edge + to_middle * middle);
    for (const Vec3& x : places) {
      if (model_.winding.inside(x) || model_.tree.free_share(middle_of_gap, x) < 1) continue;
      if (!halves_keep_limits(p, q, x, ring)) continue;
      // Where rounding moves the boundary, it must not pass the surface.
      if (std::any_of(beside.begin(), beside.end(),
                      [&](int c) { return model_.tree.meets_tet(a, b, tets_.positions[c], x); }))
        continue;
      replace(p, q, x, ring, !beside.empty());
      return;
    }
  }
  bool halves_keep_limits(int p, int q, const Vec3& x, const std::vector<int>& ring) const {
    for (int t : ring)
      for (int end : {p, q}) {
        const auto [a, b, c, d] = tets_.corners_with(t, end, x);
        if (!keeps_limits(limits_.tets, a, b, c, d)) return false;
      }
    return true;
  }
  // Each tet of the ring keeps its half at p; the half at q is a new one.
  void replace(int p, int q, const Vec3& x, const std::vector<int>& ring, bool on_boundary) {
    const int v = int(tets_.positions.size());
    tets_.positions.push_back(x);
    on_boundary_.push_back(on_boundary);
    in_gap_.push_back(true);
    tets_.star.push_back(ring);
    for (int old : ring) {
      const int added = int(tets_.tets.size());
      tets_.tets.push_back(tets_.tets[old]);
      std::replace(tets_.tets[added].begin(), tets_.tets[added].end(), p, v);
      std::replace(tets_.tets[old].begin(), tets_.tets[old].end(), q, v);
      auto& star = tets_.star[q];
      star.erase(std::find(star.begin(), star.end(), old));
      for (int w : tets_.tets[added]) tets_.star[w].push_back(added);
    }
    tets_.tet_count += int(ring.size());
  }

  const CageModel& model_;
  GapLimits limits_;
  EditTets tets_;
  std::vector<bool> on_boundary_, in_gap_;
};

// Two tets that share a face.
struct Joint {
  std::array<int, 3> vertices;
  int tet, other;
  bool open = false;
};

std::vector<Joint> joints_of(const Tets& tets) {
  const std::vector<TetFace> faces = tet_faces(tets);
  std::vector<Joint> joints;
  for (std::size_t i = 1; i < faces.size(); ++i)
    if (faces[i].vertices == faces[i - 1].vertices)
      joints.push_back({faces[i].vertices, faces[i - 1].tet, faces[i].tet});
  return joints;
}

// The kept tets, joined where they share a vertex of a closed joint: a vertex becomes as many as there are
// groups of tets at it.
struct Opened {
  TetMesh mesh;
  std::vector<int> vertex_before;  // of each vertex
};

Opened rebuild(const TetMesh& mesh, const std::vector<char>& left_out, const std::vector<Joint>& joints) {
  const auto corner_of = [&](int tet, int vertex) {
    int k = 0;
    while (mesh.tets(tet, k) != vertex) ++k;
    return 4 * tet + k;
  };
  UnionFind corners(int(mesh.tets.size()));
  for (const Joint& joint : joints)
    if (!joint.open && !left_out[joint.tet] && !left_out[joint.other])
      for (int v : joint.vertices) corners.join(corner_of(joint.tet, v), corner_of(joint.other, v));
  Opened opened;
  std::vector<int> vertex_from_root(std::size_t(mesh.tets.size()), -1);
  opened.mesh.tets.resize(std::count(left_out.begin(), left_out.end(), 0), 4);
  Eigen::Index row = 0;
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    if (left_out[t]) continue;
    for (int k = 0; k < 4; ++k) {
      int& vertex = vertex_from_root[corners.root(4 * t + k)];
      if (vertex < 0) {
        vertex = int(opened.vertex_before.size());
        opened.vertex_before.push_back(mesh.tets(t, k));
      }
      opened.mesh.tets(row, k) = vertex;
    }
    ++row;
  }
  opened.mesh.positions.resize(Eigen::Index(opened.vertex_before.size()), 3);
  for (std::size_t v = 0; v < opened.vertex_before.size(); ++v)
    opened.mesh.positions.row(Eigen::Index(v)) = mesh.positions.row(opened.vertex_before[v]);
  return opened;
}

}  // namespace

void split_at_gaps(const CageModel& model, const GapLimits& limits, TetMesh& mesh) {
  constexpr int rounds = 2;  // a tet may span two gaps, and a cut may leave pieces to be cut again
  Splitter splitter(model, limits, mesh);
  for (int round = 0; round < rounds; ++round) {
    splitter.split_edges_of(glued_tets(model, mesh).glued);
    splitter.relax();
    mesh = splitter.mesh();
  }
}

TetMesh open_gaps(const CageModel& model, const TetMesh& mesh) {
  const auto at = [&](int v) { return Vec3(mesh.positions.row(v)); };
  std::vector<char> left_out(std::size_t(mesh.tets.rows()));
  parallel_for(int(mesh.tets.rows()), [&](int t) {
    const Vec3 a = at(mesh.tets(t, 0)), b = at(mesh.tets(t, 1)), c = at(mesh.tets(t, 2)),
               d = at(mesh.tets(t, 3));
    left_out[t] = !model.tree.meets_tet(a, b, c, d) && !model.winding.inside(0.25 * (a + b + c + d));
  });
  std::vector<Joint> joints = joints_of(mesh.tets);
  parallel_for(int(joints.size()), [&](int i) {
    Joint& joint = joints[std::size_t(i)];
    const Vec3 a = at(joint.vertices[0]), b = at(joint.vertices[1]), c = at(joint.vertices[2]);
    joint.open = !model.winding.inside((a + b + c) / 3) && !model.tree.meets_triangle(a, b, c);
  });
  for (;;) {
    const Opened opened = rebuild(mesh, left_out, joints);
    const ManifoldFaults faults =
        manifold_faults(boundary_triangles(opened.mesh.tets), int(opened.mesh.positions.rows()));
    if (faults.edges.empty() && faults.vertices.empty()) return opened.mesh;
    std::vector<bool> faulty(std::size_t(mesh.positions.rows()));
    for (const EdgeEnds& edge : faults.edges)
      for (int v : edge) faulty[opened.vertex_before[v]] = true;
    for (int v : faults.vertices) faulty[opened.vertex_before[v]] = true;
    for (Joint& joint : joints)
      for (int v : joint.vertices) joint.open = joint.open && !faulty[v];
    for (int t = 0; t < mesh.tets.rows(); ++t)
      for (int k = 0; k < 4; ++k) left_out[t] = left_out[t] && !faulty[mesh.tets(t, k)];
  }
}

}  // namespace limber::meshing::detail
