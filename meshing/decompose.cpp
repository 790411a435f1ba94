#include "meshing/decompose.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/error.h"
#include "meshing/convex_hull.h"
#include "meshing/detail/cut_search.h"
#include "meshing/detail/edges.h"
#include "meshing/detail/enclosing_shell.h"
#include "meshing/detail/overshoot.h"
#include "meshing/detail/part.h"
#include "meshing/detail/proxy.h"

namespace limber::meshing {

namespace {

using namespace detail;

// More parts are cut than asked for, and the cheapest neighbours united again.
constexpr double overcut = 1.2;
// A cut that gains less than this, over the cube of the diagonal, is none: a hull's volume is not known
// better.
constexpr double least_gain = 2e-7;
// Looking two cuts ahead is dear, so only parts of this share of the whole hull's volume may.
constexpr double worth_looking_ahead = 0.02;
// The search measures coarsely, so it aims below the bound.
constexpr double bound_share = 0.8;
constexpr double flat_half_thickness = 1e-4;  // of a flat shell, over the diagonal
constexpr double boundary_sample_count = 20000;

void check(const SurfaceMesh& mesh, const DecomposeOptions& options) {
  validate(mesh, "the model to decompose");
  if (options.max_shells < 1)
    throw InputError(fmt::format("at least 1 shell is needed, not {}", options.max_shells));
  if (options.max_vertices < 8)
    throw InputError(fmt::format("a shell needs at least 8 vertices, not {}", options.max_vertices));
  if (!(options.max_concavity >= 0) || options.max_concavity > 1)
    throw InputError(fmt::format("the concavity bound is a share of the diagonal from 0 to 1, not {}",
                                 options.max_concavity));
}

// Between the user's coordinates and ones about 0 with a diagonal between 1/2 and 1. The scale is a power of
// two, so that it costs no bits.
struct Frame {
  Vec3 center;
  double scale;
  Vec3 work_from_user(const Vec3& p) const { return (p - center) * scale; }
  Vec3 user_from_work(const Vec3& p) const { return p / scale + center; }
};

Frame frame_of(const SurfaceMesh& mesh) {
  Box box;
  for (int v : vertices_of(mesh.triangles)) box.include(Vec3(mesh.positions.row(v)));
  if (!(box.diagonal() > 0) || !std::isfinite(box.diagonal()))
    throw InputError(fmt::format("the model to decompose has no extent: all its vertices are at ({} {} {})",
                                 box.lower.x(), box.lower.y(), box.lower.z()));
  int exponent = 0;
  std::frexp(box.diagonal(), &exponent);
  return {box.center(), std::ldexp(1.0, -exponent)};
}

// In work coordinates: equal positions are one vertex; triangle t stays triangle t.
struct Welded {
  SurfaceMesh mesh;
  std::vector<int> user_vertex;  // welded vertex → a vertex of the user's
};

Welded weld(const SurfaceMesh& mesh, const Frame& frame) {
  std::vector<int> used = vertices_of(mesh.triangles);
  const auto before = [&](int a, int b) {
    for (int k = 0; k < 3; ++k)
      if (mesh.positions(a, k) != mesh.positions(b, k)) return mesh.positions(a, k) < mesh.positions(b, k);
    return false;
  };
  std::stable_sort(used.begin(), used.end(), before);
  std::vector<int> first(std::size_t(mesh.positions.rows()), -1), row = first;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const bool same = i > 0 && !before(used[i - 1], used[i]);
    first[std::size_t(used[i])] = same ? first[std::size_t(used[i - 1])] : used[i];
  }
  Welded welded;
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    if (first[std::size_t(v)] == int(v)) {
      row[std::size_t(v)] = int(welded.user_vertex.size());
      welded.user_vertex.push_back(int(v));
    }
  welded.mesh.positions.resize(Eigen::Index(welded.user_vertex.size()), 3);
  for (std::size_t v = 0; v < welded.user_vertex.size(); ++v)
    welded.mesh.positions.row(Eigen::Index(v)) =
        frame.work_from_user(mesh.positions.row(welded.user_vertex[v])).transpose();
  welded.mesh.triangles = mesh.triangles;
  for (int* v = welded.mesh.triangles.data(); v != welded.mesh.triangles.data() + mesh.triangles.size(); ++v)
    *v = row[std::size_t(first[std::size_t(*v)])];
  return welded;
}

// Every simple loop of boundary edges gets a fan about its middle. Only the inside test and the volume see
// it.
SurfaceMesh with_holes_filled(const SurfaceMesh& mesh) {
  std::map<int, std::vector<int>>
      next;  // boundary vertex → where its boundary sides go, turned to face the hole
  for_each_edge(edge_uses(mesh.triangles), [&](std::span<const EdgeUse> uses) {
    if (uses.size() != 1) return;
    if (uses[0].forward)
      next[uses[0].upper].push_back(uses[0].lower);
    else
      next[uses[0].lower].push_back(uses[0].upper);
  });
  std::vector<std::array<int, 3>> fans;
  std::vector<Vec3> middles;
  std::map<int, char> done;
  for (const auto& [start, ends] : next) {
    std::vector<int> loop;
    int v = start;
    while (!done[v]) {
      const auto it = next.find(v);
      if (it == next.end() || it->second.size() != 1) break;
      done[v] = 1;
      loop.push_back(v);
      v = it->second[0];
    }
    if (loop.size() < 3 || v != start) continue;
    Vec3 middle = Vec3::Zero();
    for (int i : loop) middle += Vec3(mesh.positions.row(i)) / double(loop.size());
    const int apex = int(mesh.positions.rows()) + int(middles.size());
    middles.push_back(middle);
    for (std::size_t i = 0; i < loop.size(); ++i)
      fans.push_back({loop[i], loop[(i + 1) % loop.size()], apex});
  }
  SurfaceMesh filled = mesh;
  filled.positions.conservativeResize(mesh.positions.rows() + Eigen::Index(middles.size()), 3);
  for (std::size_t i = 0; i < middles.size(); ++i)
    filled.positions.row(mesh.positions.rows() + Eigen::Index(i)) = middles[i].transpose();
  filled.triangles.conservativeResize(mesh.triangles.rows() + Eigen::Index(fans.size()), 3);
  for (std::size_t i = 0; i < fans.size(); ++i)
    filled.triangles.row(mesh.triangles.rows() + Eigen::Index(i)) << fans[i][0], fans[i][1], fans[i][2];
  return filled;
}

// A model in one plane encloses no volume to gain: a copy on each side of it, and walls along its boundary,
// make a thin slab. Triangle t has copies t + F and t + 2F; the walls come last.
SurfaceMesh with_sides(const SurfaceMesh& flat, double half_thickness) {
  std::vector<Vec3> points;
  for (Eigen::Index v = 0; v < flat.positions.rows(); ++v) points.push_back(flat.positions.row(v));
  const std::vector<Vec3> thick = thickened(points, half_thickness);
  if (thick.size() != 2 * points.size()) return flat;  // a line
  const int V = int(flat.positions.rows());
  SurfaceMesh mesh;
  mesh.positions.resize(3 * V, 3);
  mesh.positions.topRows(V) = flat.positions;
  for (int v = 0; v < V; ++v) {
    mesh.positions.row(V + v) = thick[std::size_t(2 * v)].transpose();
    mesh.positions.row(2 * V + v) = thick[std::size_t(2 * v + 1)].transpose();
  }
  std::vector<std::array<int, 3>> walls;
  for_each_edge(edge_uses(flat.triangles), [&](std::span<const EdgeUse> uses) {
    if (uses.size() != 1) return;
    const int from = uses[0].forward ? uses[0].lower : uses[0].upper;
    const int to = uses[0].forward ? uses[0].upper : uses[0].lower;
    walls.push_back({V + to, V + from, 2 * V + from});
    walls.push_back({V + to, 2 * V + from, 2 * V + to});
  });
  const Eigen::Index F = flat.triangles.rows();
  mesh.triangles.resize(3 * F + Eigen::Index(walls.size()), 3);
  mesh.triangles.topRows(3 * F) << flat.triangles, (flat.triangles.array() + V).matrix(),
      (flat.triangles.array() + 2 * V).matrix();
  mesh.triangles.col(1).segment(2 * F, F).swap(mesh.triangles.col(2).segment(2 * F, F));  // faces away
  for (std::size_t w = 0; w < walls.size(); ++w)
    mesh.triangles.row(3 * F + Eigen::Index(w)) << walls[w][0], walls[w][1], walls[w][2];
  return mesh;
}

// What the search knows of the model besides its parts.
struct Solid {
  InsideTest inside;
  SurfaceDistance distance;

  // How far the hull of these points stands off the model, at a few hundred places outside the solid.
  double overshoot(const std::vector<Vec3>& corners) {
    constexpr double samples = 300;
    if (corners.size() < 4) return 0;
    Points rows(Eigen::Index(corners.size()), 3);
    for (std::size_t i = 0; i < corners.size(); ++i) rows.row(Eigen::Index(i)) = corners[i].transpose();
    const ConvexShell shell = convex_hull(rows);
    const double area_of_shell = area(SurfaceMesh{shell.vertices, shell.triangles});
    double farthest = 0;
    for (const BoundarySample& sample : boundary_samples({shell}, samples / area_of_shell))
      if (!inside(sample.point)) farthest = std::max(farthest, distance.at(sample.point));
    return farthest;
  }
};

// The cuts as a tree; a leaf is a part.
struct Node {
  Part part;
  Cut cut;
  double overshoot = 0;
  int below = -1, above = -1;
  bool leaf() const { return below < 0; }
};

std::vector<Node> cut_tree(Model& model, Part root, Solid& solid, const DecomposeOptions& options,
                           double bound) {
  std::vector<Node> nodes;
  const double worth = worth_looking_ahead * root.hull_volume;
  const int wanted = options.max_shells == 1 ? 1 : int(std::ceil(overcut * options.max_shells));
  const auto add = [&](Part part) {
    Node node;
    if (wanted > 1)
      node.cut = (part.hull_volume > worth ? best_cut_ahead : best_cut)(model, part, solid.inside, {});
    if (bound > 0) node.overshoot = solid.overshoot(part.hull);
    node.part = std::move(part);
    nodes.push_back(std::move(node));
    return int(nodes.size()) - 1;
  };
  add(std::move(root));
  for (int leaves = 1; leaves < wanted; ++leaves) {
    int best = -1;
    for (int n = 0; n < int(nodes.size()); ++n) {
      const Node& node = nodes[std::size_t(n)];
      if (!node.leaf() || node.cut.gain <= least_gain || (bound > 0 && node.overshoot <= bound)) continue;
      if (best < 0 || node.cut.gain > nodes[std::size_t(best)].cut.gain) best = n;
    }
    if (best < 0) break;
    auto [below, above] =
        cut(model, nodes[std::size_t(best)].part, nodes[std::size_t(best)].cut.plane, solid.inside);
    const int b = add(std::move(below)), a = add(std::move(above));
    nodes[std::size_t(best)].below = b;
    nodes[std::size_t(best)].above = a;
  }
  return nodes;
}

// Unites the leaves, cheapest first, until they are few enough; and on while it costs nothing, or, with a
// bound, while the bound holds. Returns the nodes of each group.
std::vector<std::vector<int>> group_leaves(const std::vector<Node>& nodes, Solid& solid, int max_shells,
                                           double bound) {
  struct Group {
    std::vector<int> leaves;
    Part part;  // hull only
    Box box;
  };
  std::vector<Group> groups;
  for (int n = 0; n < int(nodes.size()); ++n) {
    const Part& part = nodes[std::size_t(n)].part;
    if (!nodes[std::size_t(n)].leaf() || part.hull.empty()) continue;
    Group group{{n}, {}, {}};
    group.part.hull = part.hull;
    group.part.hull_volume = part.hull_volume;
    for (const Vec3& p : part.hull) group.box.include(p);
    groups.push_back(std::move(group));
  }
  std::map<std::pair<int, int>, double> cost;
  const auto find_costs = [&](int i, bool only_near) {
    for (int j = 0; j < int(groups.size()); ++j) {
      const Group &a = groups[std::size_t(i)], &b = groups[std::size_t(j)];
      constexpr double touching = 0.01;
      if (j == i || a.leaves.empty() || b.leaves.empty()) continue;
      if (only_near && ((a.box.lower.array() > b.box.upper.array() + touching).any() ||
                        (b.box.lower.array() > a.box.upper.array() + touching).any()))
        continue;
      cost[{std::min(i, j), std::max(i, j)}] =
          unite({&a.part, &b.part}).hull_volume - a.part.hull_volume - b.part.hull_volume;
    }
  };
  for (int i = 0; i < int(groups.size()); ++i) find_costs(i, true);
  for (int alive = int(groups.size()); alive > 1;) {
    std::vector<std::pair<double, std::pair<int, int>>> by_cost;
    for (const auto& [pair, value] : cost) by_cost.push_back({value, pair});
    std::sort(by_cost.begin(), by_cost.end());
    if (by_cost.empty() && alive > max_shells) {
      for (int i = 0; i < int(groups.size()); ++i) find_costs(i, false);
      continue;
    }
    const auto chosen = std::find_if(by_cost.begin(), by_cost.end(), [&](const auto& entry) {
      if (alive > max_shells || entry.first <= least_gain) return true;
      if (bound <= 0) return false;
      return solid.overshoot(unite({&groups[std::size_t(entry.second.first)].part,
                                    &groups[std::size_t(entry.second.second)].part})
                                 .hull) <= bound;
    });
    if (chosen == by_cost.end()) break;
    const auto [i, j] = chosen->second;
    Group &into = groups[std::size_t(i)], &from = groups[std::size_t(j)];
    into.part = unite({&into.part, &from.part});
    into.leaves.insert(into.leaves.end(), from.leaves.begin(), from.leaves.end());
    into.box.include(from.box);
    from.leaves.clear();
    std::erase_if(cost, [i = i, j = j](const auto& entry) {
      const auto& [a, b] = entry.first;
      return a == i || b == i || a == j || b == j;
    });
    find_costs(i, true);
    --alive;
  }
  std::vector<std::vector<int>> leaves;
  for (Group& group : groups)
    if (!group.leaves.empty()) leaves.push_back(std::move(group.leaves));
  return leaves;
}

// The cuts of the proxy, made on the model itself: each node's part.
void replay(Model& model, const std::vector<Node>& nodes, int n, Part part, double range, InsideTest& inside,
            std::vector<Part>& part_of_node) {
  const Node& node = nodes[std::size_t(n)];
  if (node.leaf()) {
    part_of_node[std::size_t(n)] = std::move(part);
    return;
  }
  const Plane plane = best_offset(model, part, inside, node.cut.plane, range).plane;
  auto [below, above] = cut(model, part, plane, inside);
  part = {};
  replay(model, nodes, node.below, std::move(below), range, inside, part_of_node);
  replay(model, nodes, node.above, std::move(above), range, inside, part_of_node);
}

}  // namespace

Decomposition decompose(const SurfaceMesh& mesh, const DecomposeOptions& options) {
  check(mesh, options);
  const Frame frame = frame_of(mesh);
  const Welded welded = weld(mesh, frame);
  const double diagonal = bounding_box(welded.mesh.positions).diagonal();
  const double half_thickness = flat_half_thickness * diagonal;
  std::vector<Vec3> vertices;
  for (Eigen::Index v = 0; v < welded.mesh.positions.rows(); ++v)
    vertices.push_back(welded.mesh.positions.row(v));
  GrowingHull hull_of_all;
  hull_of_all.add(vertices);
  const SurfaceMesh filled = with_holes_filled(welded.mesh);
  const SurfaceMesh work = hull_of_all.flat() ? with_sides(welded.mesh, half_thickness) : filled;
  // Of a slab the middle sheet does not bound the solid.
  const Eigen::Index middle = hull_of_all.flat() ? mesh.triangles.rows() : 0;
  Solid solid{InsideTest(work.positions, work.triangles.bottomRows(work.triangles.rows() - middle)),
              SurfaceDistance(filled.positions, filled.triangles)};
  const double bound = bound_share * options.max_concavity * diagonal;

  // Search on a proxy, then make the same cuts on the model.
  const Proxy proxy = make_proxy(work);
  Model model = make_model(proxy.mesh.positions, proxy.mesh.triangles);
  std::vector<Node> nodes = cut_tree(model, whole(model, proxy.mesh.triangles), solid, options, bound);
  const std::vector<std::vector<int>> leaves_of_group = group_leaves(nodes, solid, options.max_shells, bound);
  std::vector<Part> part_of_node(nodes.size());
  if (proxy.cell > 0) {
    model = make_model(work.positions, work.triangles);
    replay(model, nodes, 0, whole(model, work.triangles), proxy.cell, solid.inside, part_of_node);
  } else {
    for (std::size_t n = 0; n < nodes.size(); ++n) part_of_node[n] = std::move(nodes[n].part);
  }
  std::vector<Part> parts;
  for (const std::vector<int>& leaves : leaves_of_group) {
    std::vector<const Part*> pieces;
    for (int n : leaves) pieces.push_back(&part_of_node[std::size_t(n)]);
    Part part = unite(pieces);
    if (!part.hull.empty()) parts.push_back(std::move(part));
  }

  // The exact shells, in the user's coordinates.
  const double user_diagonal = diagonal / frame.scale;
  const double rounding = 16 * 2.3e-16 * mesh.positions.cwiseAbs().maxCoeff();
  const double margin = std::max(1e-12 * user_diagonal, rounding);
  const auto user_point = [&](int p) {
    return std::size_t(p) < welded.user_vertex.size()
               ? Vec3(mesh.positions.row(welded.user_vertex[std::size_t(p)]))
               : frame.user_from_work(model.points[std::size_t(p)]);
  };
  const auto shell_of = [&](const Part& part) {
    std::vector<Vec3> corners = part.hull, points;
    GrowingHull hull;
    hull.add(corners);
    if (hull.flat()) {
      hull.clear();
      hull.add(thickened(corners, half_thickness));
      corners = hull.vertices();
    }
    corners = fewer_corners(corners, options.max_vertices);
    for (Vec3& p : corners) p = frame.user_from_work(p);
    for (int p : points_of(part)) points.push_back(user_point(p));
    return enclosing_shell(corners, points, margin);
  };
  Decomposition result;
  for (const Part& part : parts) result.shells.push_back(shell_of(part));

  const auto measure = [&] {
    const SurfaceDistance& distance = solid.distance;
    std::vector<ConvexShell> shells = result.shells;
    double total_area = 0;
    for (ConvexShell& shell : shells) {
      for (Eigen::Index v = 0; v < shell.vertices.rows(); ++v)
        shell.vertices.row(v) = frame.work_from_user(shell.vertices.row(v)).transpose();
      total_area += area(SurfaceMesh{shell.vertices, shell.triangles});
    }
    std::vector<double> distances;
    result.overshoot_of_shell.assign(shells.size(), 0.0);
    for (const BoundarySample& sample : boundary_samples(shells, boundary_sample_count / total_area)) {
      distances.push_back(distance.at(sample.point) / diagonal);
      double& largest = result.overshoot_of_shell[std::size_t(sample.shell)];
      largest = std::max(largest, distances.back());
    }
    std::sort(distances.begin(), distances.end());
    result.mean_overshoot =
        std::accumulate(distances.begin(), distances.end(), 0.0) / double(distances.size());
    result.percentile_99_overshoot = distances[(distances.size() - 1) * 99 / 100];
    result.max_overshoot = distances.back();
  };
  measure();

  // A bound that the coarse search missed: cut the worst shell again, on the model itself.
  while (options.max_concavity > 0 && result.max_overshoot > options.max_concavity &&
         int(parts.size()) < options.max_shells) {
    std::vector<int> worst_first(parts.size());
    std::iota(worst_first.begin(), worst_first.end(), 0);
    std::stable_sort(worst_first.begin(), worst_first.end(), [&](int a, int b) {
      return result.overshoot_of_shell[std::size_t(a)] > result.overshoot_of_shell[std::size_t(b)];
    });
    const std::size_t worst = std::size_t(worst_first[0]);
    const Cut again = best_cut_ahead(model, parts[worst], solid.inside, {});
    if (again.gain <= 0) break;
    auto [below, above] = cut(model, parts[worst], again.plane, solid.inside);
    parts[worst] = std::move(below);
    parts.push_back(std::move(above));
    result.shells[worst] = shell_of(parts[worst]);
    result.shells.push_back(shell_of(parts.back()));
    measure();
  }
  const bool bound_met = options.max_concavity > 0 && result.max_overshoot <= options.max_concavity;
  const bool nothing_to_gain = int(leaves_of_group.size()) < options.max_shells;
  result.stopped_by = bound_met || nothing_to_gain ? "concavity" : "count";

  // Shells that share a point of a cut are neighbours.
  std::vector<std::pair<int, int>> shell_of_point;
  for (std::size_t s = 0; s < parts.size(); ++s)
    for (int p : points_of(parts[s])) shell_of_point.push_back({p, int(s)});
  std::sort(shell_of_point.begin(), shell_of_point.end());
  for (std::size_t i = 0; i < shell_of_point.size(); ++i)
    for (std::size_t j = i; j-- > 0 && shell_of_point[j].first == shell_of_point[i].first;)
      result.neighbours.push_back({shell_of_point[j].second, shell_of_point[i].second});
  std::sort(result.neighbours.begin(), result.neighbours.end());
  result.neighbours.erase(std::unique(result.neighbours.begin(), result.neighbours.end()),
                          result.neighbours.end());

  for (const ConvexShell& shell : result.shells)
    result.sum_of_hull_volumes += volume(SurfaceMesh{shell.vertices, shell.triangles});
  result.model_volume = std::abs(volume(filled)) / std::pow(frame.scale, 3);

  // The cover, from the result alone.
  std::vector<Box> boxes;
  for (const ConvexShell& shell : result.shells) boxes.push_back(bounding_box(shell.vertices));
  for (int v : vertices_of(mesh.triangles)) {
    const Vec3 p = mesh.positions.row(v);
    bool covered = false;
    for (std::size_t s = 0; s < result.shells.size() && !covered; ++s)
      covered = (p.array() >= boxes[s].lower.array()).all() && (p.array() <= boxes[s].upper.array()).all() &&
                encloses(result.shells[s], p);
    result.vertices_uncovered += !covered;
  }
  const int triangles = int(mesh.triangles.rows());
  const auto of_user = [&](int t) { return t < (hull_of_all.flat() ? 3 : 1) * triangles; };
  std::vector<char> uncovered(std::size_t(triangles), 0), seen(std::size_t(triangles), 0);
  for (std::size_t s = 0; s < parts.size(); ++s)
    for (int i = 0; i < parts[s].surface.count(); ++i) {
      if (!of_user(parts[s].surface.triangle[std::size_t(i)])) continue;
      const std::size_t t = std::size_t(parts[s].surface.triangle[std::size_t(i)] % triangles);
      seen[t] = 1;
      for (int k = parts[s].surface.first[std::size_t(i)]; k < parts[s].surface.first[std::size_t(i) + 1];
           ++k)
        if (!encloses(result.shells[s], user_point(parts[s].surface.corners[std::size_t(k)])))
          uncovered[t] = 1;
    }
  for (std::size_t t = 0; t < uncovered.size(); ++t) result.triangles_uncovered += uncovered[t] || !seen[t];
  return result;
}

}  // namespace limber::meshing
