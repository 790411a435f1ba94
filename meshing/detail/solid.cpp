#include "meshing/detail/solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.h"
#include "meshing/detail/edges.h"
#include "meshing/detail/enclosing_shell.h"
#include "meshing/detail/growing_hull.h"

namespace limber::meshing::detail {

namespace {

constexpr double flat_half_thickness_share = 1e-4;  // of the diagonal

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

bool is_flat(const Points& positions) {
  GrowingHull hull;
  std::vector<Vec3> points;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) points.push_back(positions.row(v));
  hull.add(points);
  return hull.flat();
}

}  // namespace

Solid make_solid(const SurfaceMesh& mesh) {
  Solid solid;
  solid.frame = frame_of(mesh);
  Welded welded = weld(mesh, solid.frame);
  solid.user_vertex = std::move(welded.user_vertex);
  solid.diagonal = bounding_box(welded.mesh.positions).diagonal();
  solid.flat_half_thickness = flat_half_thickness_share * solid.diagonal;
  solid.filled = with_holes_filled(welded.mesh);
  if (is_flat(welded.mesh.positions)) {
    solid.mesh = with_sides(welded.mesh, solid.flat_half_thickness);
    solid.boundary = solid.mesh.triangles.bottomRows(solid.mesh.triangles.rows() - mesh.triangles.rows());
    solid.sheets = 3;
  } else {
    solid.mesh = solid.filled;
    solid.boundary = solid.mesh.triangles;
  }
  return solid;
}

}  // namespace limber::meshing::detail
