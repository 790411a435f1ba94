// The extreme vertices of a surface along evenly many directions, each vertex once: at most 200 of them,
// however fine the surface is. No direction is farther than 11 degrees from one of the 200, so of a ball of
// radius r what is missed stands out by at most r (1 − cos 11°), 2 % of r.
#include "limber/detail/film/outermost.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::detail {

namespace {

// The vertices beyond which none lies in one of many directions, evenly over the sphere: a spiral whose turns
// are a golden angle apart.
std::vector<Eigen::Index> outermost_of(const Points& positions) {
  constexpr int directions = 200;
  std::vector<Eigen::Index> outermost;
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - 2 * (i + 0.5) / directions, r = std::sqrt(1 - z * z),
                 turn = i * std::numbers::pi * (3 - std::sqrt(5));
    Eigen::Index farthest = 0;
    (positions * Vec3(r * std::cos(turn), r * std::sin(turn), z)).maxCoeff(&farthest);
    outermost.push_back(farthest);
  }
  std::sort(outermost.begin(), outermost.end());
  outermost.erase(std::unique(outermost.begin(), outermost.end()), outermost.end());
  return outermost;
}

}  // namespace

ffd::Binding outermost_part(const PreparedBody& body) {
  const std::vector<Eigen::Index> outermost = outermost_of(body.surface.positions);
  return {body.binding.tet_from_vertex(outermost), body.binding.weights(outermost, Eigen::all)};
}

}  // namespace limber::detail
