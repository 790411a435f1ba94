#include "meshing/detail/seen_surface.h"

#include <array>
#include <cmath>

#include "core/threads.h"

namespace limber::meshing::detail {

namespace {

constexpr std::size_t most_extra_pieces = 400'000;
constexpr double unclear = 0.2;  // a winding number so far from any whole number

struct Piece {
  std::array<Vec3, 3> corners;
  int triangle;
  bool seen = false, open = false;
  Vec3 area_vector() const { return 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]); }
};

// Halves the longest edge until none is longer than `length`. Stops at `most`.
bool cut(const SurfaceMesh& surface, double length, std::size_t most, std::vector<Piece>& pieces) {
  pieces.clear();
  std::vector<std::array<Vec3, 3>> open;
  for (Eigen::Index f = 0; f < surface.triangles.rows(); ++f) {
    const auto t = surface.triangles.row(f);
    open.push_back({surface.positions.row(t[0]), surface.positions.row(t[1]), surface.positions.row(t[2])});
    while (!open.empty()) {
      const auto [a, b, c] = open.back();
      open.pop_back();
      const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
      if (std::max({ab, bc, ca}) <= length * length) {
        if (pieces.size() == most) return false;
        pieces.push_back({{a, b, c}, int(f)});
      } else if (ab >= bc && ab >= ca) {
        const Vec3 middle = 0.5 * (a + b);
        open.push_back({middle, b, c}), open.push_back({a, middle, c});
      } else if (bc >= ca) {
        const Vec3 middle = 0.5 * (b + c);
        open.push_back({a, middle, c}), open.push_back({a, b, middle});
      } else {
        const Vec3 middle = 0.5 * (c + a);
        open.push_back({a, b, middle}), open.push_back({middle, b, c});
      }
    }
  }
  return true;
}

bool is_unclear(double winding) { return std::abs(winding - std::round(winding)) > unclear; }

}  // namespace

bool parts_inside_from_outside(const WindingNumber& winding, const Vec3& point, const Vec3& normal,
                               double offset) {
  return !winding.inside(point + offset * normal) && winding.inside(point - offset * normal);
}

SeenSurface seen_surface(const SurfaceMesh& surface, const WindingNumber& winding, double piece,
                         double offset) {
  const std::size_t triangles = std::size_t(surface.triangles.rows());
  std::vector<Piece> pieces;
  while (!cut(surface, piece, triangles + most_extra_pieces, pieces)) piece *= 2;

  constexpr int chunk = 256;
  const int count = int(pieces.size());
  parallel_for((count + chunk - 1) / chunk, [&](int c) {
    for (int i = c * chunk; i < std::min(count, (c + 1) * chunk); ++i) {
      Piece& p = pieces[std::size_t(i)];
      const Vec3 normal = p.area_vector().normalized();
      if (!(normal.squaredNorm() > 0.5)) continue;
      const Vec3 middle = (p.corners[0] + p.corners[1] + p.corners[2]) / 3.0;
      const double out = winding.at(middle + offset * normal), in = winding.at(middle - offset * normal);
      p.seen = out <= 0.5 && in > 0.5;
      p.open = is_unclear(out) || is_unclear(in);
    }
  });

  SeenSurface result;
  result.seen.assign(triangles, 0);
  std::vector<char> whole(triangles, 1);
  double all_area = 0, open_area = 0;
  for (const Piece& p : pieces) {
    const double area = p.area_vector().norm();
    all_area += area;
    if (p.open) open_area += area;
    if (p.seen)
      result.seen[std::size_t(p.triangle)] = 1, result.area_m2 += area;
    else
      whole[std::size_t(p.triangle)] = 0;
  }
  result.open_share = all_area > 0 ? open_area / all_area : 0;

  std::vector<std::array<Vec3, 3>> kept;
  int last = -1;
  for (const Piece& p : pieces) {
    if (!p.seen) continue;
    if (!whole[std::size_t(p.triangle)]) {
      kept.push_back(p.corners);
    } else if (p.triangle != last) {
      const auto t = surface.triangles.row(p.triangle);
      kept.push_back({surface.positions.row(t[0]), surface.positions.row(t[1]), surface.positions.row(t[2])});
      last = p.triangle;
    }
  }
  result.mesh = {Points(3 * Eigen::Index(kept.size()), 3), Triangles(Eigen::Index(kept.size()), 3)};
  for (int f = 0; f < int(kept.size()); ++f)
    for (int k = 0; k < 3; ++k) {
      result.mesh.positions.row(3 * f + k) = kept[std::size_t(f)][std::size_t(k)];
      result.mesh.triangles(f, k) = 3 * f + k;
    }
  return result;
}

}  // namespace limber::meshing::detail
