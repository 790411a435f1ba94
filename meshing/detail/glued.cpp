#include "meshing/detail/glued.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <utility>

#include "core/threads.h"
#include "core/union_find.h"

namespace limber::meshing::detail {
namespace {

using TetCorners = std::array<Vec3, 4>;

struct FacePlane {
  Vec3 normal;  // inwards
  double offset;
};

std::array<FacePlane, 4> planes_of(const TetCorners& p) {
  static constexpr int face[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::array<FacePlane, 4> planes;
  for (int i = 0; i < 4; ++i) {
    const Vec3& a = p[face[i][0]];
    const Vec3 n = -(p[face[i][1]] - a).cross(p[face[i][2]] - a);
    planes[i] = {n, n.dot(a)};
  }
  return planes;
}

// The part of a segment within the tet; its two ends, or nothing.
bool clip(const std::array<FacePlane, 4>& planes, Vec3& a, Vec3& b) {
  for (const FacePlane& plane : planes) {
    const double da = plane.normal.dot(a) - plane.offset, db = plane.normal.dot(b) - plane.offset;
    if (da < 0 && db < 0) return false;
    if (da < 0)
      a += (b - a) * (da / (da - db));
    else if (db < 0)
      b = a + (b - a) * (da / (da - db));
  }
  return true;
}

// A polygon within the tet by clipping a triangle (Sutherland and Hodgman 1974).
std::vector<Vec3> clip(const std::array<FacePlane, 4>& planes, std::vector<Vec3> polygon) {
  for (const FacePlane& plane : planes) {
    std::vector<Vec3> next;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double dp = plane.normal.dot(p) - plane.offset, dq = plane.normal.dot(q) - plane.offset;
      if (dp >= 0) next.push_back(p);
      if ((dp < 0) != (dq < 0)) next.push_back(p + (q - p) * (dp / (dp - dq)));
    }
    polygon = std::move(next);
  }
  return polygon;
}

// Where a triangle stands in a list of some; −1: not in it.
class PlaceIn {
 public:
  PlaceIn(const std::vector<int>& triangles, Eigen::Index of_all) : triangles_(triangles) {
    if (std::ssize(places_) < of_all) places_.resize(std::size_t(of_all), -1);
    for (int i = 0; i < int(triangles.size()); ++i) places_[std::size_t(triangles[i])] = i;
  }
  ~PlaceIn() {
    for (const int t : triangles_) places_[std::size_t(t)] = -1;
  }
  int operator()(int triangle) const { return places_[std::size_t(triangle)]; }

 private:
  static inline thread_local std::vector<int> places_;  // −1 wherever no list is
  const std::vector<int>& triangles_;
};

// `triangles`: those that meet the tet, ascending.
bool holds_strangers(const CageModel& model, const TetCorners& corners, const std::vector<int>& triangles) {
  const std::array<FacePlane, 4> planes = planes_of(corners);
  const SurfaceMesh& surface = model.surface;
  const auto at = [&](int v) { return Vec3(surface.positions.row(v)); };

  const PlaceIn place(triangles, surface.triangles.rows());
  UnionFind pieces(int(triangles.size()));
  for (int i = 0; i < int(triangles.size()); ++i)
    for (int k = 0; k < 3; ++k) {
      int side = model.side_before[std::size_t(3 * triangles[i] + k)];
      while (side >= 0 && place(side / 3) < 0) side = model.side_before[std::size_t(side)];
      if (side < 0) continue;
      Vec3 a = at(surface.triangles(triangles[i], k)), b = at(surface.triangles(triangles[i], (k + 1) % 3));
      if (clip(planes, a, b)) pieces.join(place(side / 3), i);
    }
  std::vector<std::pair<int, int>> triangle_of_piece;
  for (int i = 0; i < int(triangles.size()); ++i) triangle_of_piece.push_back({pieces.root(i), i});
  std::sort(triangle_of_piece.begin(), triangle_of_piece.end());
  if (triangle_of_piece.front().first == triangle_of_piece.back().first) return false;
  // Where a model is all threads: the first few tell, and each pair costs a winding number.
  constexpr std::size_t max_pieces = 12;
  std::map<int, std::vector<Vec3>> points;  // of each piece, within the tet
  for (const auto& [piece, i] : triangle_of_piece) {
    if (points.size() == max_pieces && piece != points.rbegin()->first) break;
    const auto row = surface.triangles.row(triangles[i]);
    for (const Vec3& p : clip(planes, {at(row[0]), at(row[1]), at(row[2])})) points[piece].push_back(p);
  }
  if (points.size() < 2) return false;

  UnionFind bodies(int(triangles.size()));
  constexpr std::size_t samples = 80;  // of a piece
  for (auto a = points.begin(); a != points.end(); ++a)
    for (auto b = std::next(a); b != points.end(); ++b) {
      if (bodies.root(a->first) == bodies.root(b->first)) continue;
      double nearest = 1e300;
      Vec3 middle;
      for (std::size_t i = 0; i < a->second.size(); i += 1 + a->second.size() / samples)
        for (std::size_t j = 0; j < b->second.size(); j += 1 + b->second.size() / samples)
          if (const double d = (a->second[i] - b->second[j]).squaredNorm(); d < nearest)
            nearest = d, middle = 0.5 * (a->second[i] + b->second[j]);
      if (nearest == 0 || model.winding.inside(middle)) bodies.join(a->first, b->first);
    }
  const int first = bodies.root(points.begin()->first);
  return std::any_of(points.begin(), points.end(),
                     [&](const auto& piece) { return bodies.root(piece.first) != first; });
}

}  // namespace

bool is_glued(const CageModel& model, const std::array<Vec3, 4>& tet) {
  const std::vector<int> triangles = model.tree.triangles_meeting_tet(tet[0], tet[1], tet[2], tet[3]);
  return !triangles.empty() && holds_strangers(model, tet, triangles);
}

GluedTets glued_tets(const CageModel& model, const TetMesh& mesh) {
  GluedTets all{std::vector<char>(std::size_t(mesh.tets.rows())), 0};
  std::atomic<int> meeting{0};
  parallel_for(int(mesh.tets.rows()), [&](int t) {
    TetCorners p;
    for (int k = 0; k < 4; ++k) p[k] = mesh.positions.row(mesh.tets(t, k));
    const std::vector<int> triangles = model.tree.triangles_meeting_tet(p[0], p[1], p[2], p[3]);
    if (triangles.empty()) return;
    ++meeting;
    all.glued[std::size_t(t)] = holds_strangers(model, p, triangles);
  });
  all.meeting = meeting;
  return all;
}

double GluedTets::share() const {
  return meeting > 0 ? double(std::count(glued.begin(), glued.end(), 1)) / meeting : 0;
}

}  // namespace limber::meshing::detail
