#include "app/layout.h"

#include <algorithm>

#include "core/progress.h"
#include "fem/world.h"

namespace limber::app {

namespace {

constexpr int most_rounds = 200;
// Overlaps shallower than this share of a cage's size are none; parting goes a little beyond.
constexpr double slack = 1e-4;

struct Layout {
  std::vector<LaidCage> cages;
  std::vector<Vec3> way_m;
  double slack_m = 0;

  explicit Layout(std::vector<LaidCage> laid) : cages(std::move(laid)), way_m(cages.size(), Vec3::Zero()) {
    Box all;
    for (const LaidCage& c : cages) all.include(bounding_box(c.cage.positions));
    slack_m = slack * all.diagonal();
  }
  void move(std::size_t i, const Vec3& by) {
    cages[i].cage.positions.rowwise() += by.transpose();
    way_m[i] += by;
  }
  // Of two that may part.
  fem::CageOverlap overlap(std::size_t i, std::size_t j) const {
    if (cages[i].held && cages[j].held) return {};
    return fem::cage_overlap(cages[i].cage, cages[j].cage);
  }
  bool is_free(std::size_t i) const {
    for (std::size_t j = 0; j < cages.size(); ++j)
      if (j != i && overlap(i, j).depth_m > 0) return false;
    return true;
  }
  double farthest() const {
    double way = 0;
    for (const Vec3& w : way_m) way = std::max(way, w.norm());
    return way;
  }

  // Whether there was nothing to part.
  bool part_all() {
    bool apart = true;
    for (std::size_t i = 0; i < cages.size(); ++i)
      for (std::size_t j = i + 1; j < cages.size(); ++j) {
        const fem::CageOverlap found = overlap(i, j);
        if (found.depth_m == 0) continue;
        apart = false;
        const Vec3 way = (1 + slack_m / found.depth_m) * found.way_m;
        const double share = cages[i].held ? 0 : cages[j].held ? 1 : 0.5;
        move(i, share * way), move(j, -(1 - share) * way);
      }
    return apart;
  }

  // Whether one went back by more than a little.
  bool go_back() {
    bool gone = false;
    for (std::size_t i = 0; i < cages.size(); ++i)
      for (double share = 1; way_m[i].norm() * share > 10 * slack_m; share /= 2) {
        const Vec3 back = -share * way_m[i];
        move(i, back);
        if (is_free(i)) {
          gone = true;
          break;
        }
        move(i, -back);
      }
    return gone;
  }
};

}  // namespace

std::optional<std::vector<Vec3>> ways_apart(std::vector<LaidCage> cages, double reach_m) {
  Layout layout(std::move(cages));
  int round = 0;
  for (; !layout.part_all(); ++round) {
    throw_if_stopped();
    if (round == most_rounds || layout.farthest() > 2 * reach_m) return std::nullopt;
  }
  while (round > 0 && layout.go_back()) throw_if_stopped();
  if (layout.farthest() > reach_m) return std::nullopt;
  return layout.way_m;
}

}  // namespace limber::app
