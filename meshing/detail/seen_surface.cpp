#include "meshing/detail/seen_surface.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/threads.h"

namespace limber::meshing::detail {

namespace {

constexpr std::size_t max_extra_pieces = 400'000;
constexpr double unclear = 0.2;  // a winding number so far from any whole number

// Halves the longest edge until none is longer than `length`. Stops at `most`.
bool cut(const SurfaceMesh& surface, double length, std::size_t most, std::vector<SurfacePiece>& pieces) {
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
        pieces.push_back({{a, b, c}, int(f), false});
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

SeenSurface seen_surface(const SurfaceMesh& surface, const WindingNumber& winding, bool closed,
                         double longest, double offset) {
  SeenSurface result;
  result.seen.assign(std::size_t(surface.triangles.rows()), 0);
  std::vector<SurfacePiece>& pieces = result.pieces;
  while (!cut(surface, longest, result.seen.size() + max_extra_pieces, pieces)) longest *= 2;

  // Those that face the same way in the same cell, one group after the other.
  struct Place {
    std::array<int, 4> group;  // cell, way
    int piece;
    bool operator<(const Place& other) const {
      return std::tie(group, piece) < std::tie(other.group, other.piece);
    }
  };
  const Vec3 lower = bounding_box(surface.positions).lower;
  std::vector<Place> places;
  for (int i = 0; i < int(pieces.size()); ++i) {
    const auto& [a, b, c] = pieces[std::size_t(i)].corners;
    const Vec3 cell = ((a + b + c) / 3.0 - lower) / (0.5 * longest),
               normal = pieces[std::size_t(i)].area_vector();
    if (!(normal.squaredNorm() > 0)) continue;  // has no sides
    int axis;
    normal.cwiseAbs().maxCoeff(&axis);
    places.push_back({{int(cell.x()), int(cell.y()), int(cell.z()), 2 * axis + (normal[axis] < 0)}, i});
  }
  std::sort(places.begin(), places.end());
  std::vector<std::size_t> groups{0};  // where each begins
  for (std::size_t i = 1; i <= places.size(); ++i)
    if (i == places.size() || places[i].group != places[i - 1].group) groups.push_back(i);

  struct Judgement {
    bool seen, open;
    bool operator==(const Judgement&) const = default;
  };
  std::vector<Judgement> judgements(pieces.size(), {false, false});
  parallel_for(int(groups.size()) - 1, [&](int g) {
    const auto judge = [&](std::size_t place) -> Judgement& {
      const int piece = places[place].piece;
      const auto& [a, b, c] = pieces[std::size_t(piece)].corners;
      const Vec3 normal = pieces[std::size_t(piece)].area_vector().normalized(), middle = (a + b + c) / 3.0;
      const double out = winding.at(middle + offset * normal),
                   in = closed ? out + 1 : winding.at(middle - offset * normal);
      return judgements[std::size_t(piece)] = {out <= 0.5 && in > 0.5, is_unclear(out) || is_unclear(in)};
    };
    const std::size_t first = groups[std::size_t(g)], last = groups[std::size_t(g) + 1] - 1;
    const Judgement found = judge(first);
    const bool agreed = last == first || judge(last) == found;
    for (std::size_t i = first + 1; i < last; ++i)
      agreed ? judgements[std::size_t(places[i].piece)] = found : judge(i);
  });

  double all_area = 0, open_area = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double area = pieces[i].area_vector().norm();
    all_area += area;
    if (judgements[i].open) open_area += area;
    if (!judgements[i].seen) continue;
    pieces[i].seen = true;
    result.seen[std::size_t(pieces[i].triangle)] = 1;
    result.area_m2 += area;
  }
  result.open_share = all_area > 0 ? open_area / all_area : 0;
  return result;
}

}  // namespace limber::meshing::detail
