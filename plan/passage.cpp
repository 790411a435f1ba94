#include "plan/passage.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "core/error.h"
#include "plan/guidance.h"

namespace limber::plan {

namespace {

Eigen::Vector3i cell_of(const Workspace& space, const Vec3& p) {
  Eigen::Vector3i cell;
  for (int i = 0; i < 3; ++i)
    cell[i] = int(std::clamp((p[i] - space.box.lower[i]) / space.cell_m, 0.0, double(space.cells[i]) - 0.5));
  return cell;
}

int index_of(const Workspace& space, const Eigen::Vector3i& c) {
  return (c.z() * space.cells.y() + c.y()) * space.cells.x() + c.x();
}

Eigen::Vector3i cell_of(const Workspace& space, int index) {
  const int nx = space.cells.x(), ny = space.cells.y();
  return {index % nx, index / nx % ny, index / (nx * ny)};
}

Vec3 middle_of(const Workspace& space, const Eigen::Vector3i& c) {
  return space.box.lower + space.cell_m * (c.cast<double>() + Vec3::Constant(0.5));
}

// [cell] the largest ball round its middle; negative in what is rigid.
std::vector<double> clearances(const Workspace& space) {
  std::vector<bool> rigid(space.what.size());
  for (std::size_t c = 0; c < rigid.size(); ++c) rigid[c] = space.what[c] == Workspace::rigid;
  const std::vector<float> cells = distance_in_cells(space.cells, rigid);
  std::vector<double> clearance(rigid.size());
  for (std::size_t c = 0; c < rigid.size(); ++c) {
    // A surface lies half a cell before the middle of the first cell behind it.
    clearance[c] = space.cell_m * (double(cells[c]) - 0.5);
    const Vec3 place = middle_of(space, cell_of(space, int(c)));
    if (space.walls)
      clearance[c] = std::min(
          {clearance[c], (place - space.box.lower).minCoeff(), (space.box.upper - place).minCoeff()});
  }
  return clearance;
}

}  // namespace

double widest_passage_m(const Workspace& space, const Vec3& from, const Goal& goal) {
  LIMBER_CHECK(space.what.size() == std::size_t(space.cells.prod()), space.what.size());
  const std::vector<double> clearance = clearances(space);
  std::vector<bool> reached(clearance.size(), false);
  std::priority_queue<std::pair<double, int>> open;  // by the narrowest place on the way there
  const int start = index_of(space, cell_of(space, from));
  const int at_goal = index_of(space, cell_of(space, goal.center_of_mass_m));
  open.emplace(clearance[std::size_t(start)], start);
  while (!open.empty()) {
    const auto [narrowest, index] = open.top();
    open.pop();
    if (reached[std::size_t(index)]) continue;
    reached[std::size_t(index)] = true;
    const Eigen::Vector3i cell = cell_of(space, index);
    if (index == at_goal || (middle_of(space, cell) - goal.center_of_mass_m).norm() <= goal.radius_m)
      return narrowest;
    for (int n = 0; n < 27; ++n) {
      const Eigen::Vector3i next = cell + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if ((next.array() < 0).any() || (next.array() >= space.cells.array()).any()) continue;
      const int i = index_of(space, next);
      if (!reached[std::size_t(i)]) open.emplace(std::min(narrowest, clearance[std::size_t(i)]), i);
    }
  }
  LIMBER_CHECK(false, start, at_goal);  // all cells are reached from any
  return 0;
}

}  // namespace limber::plan
