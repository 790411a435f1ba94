#include "tools/check_cage/grid.h"

#include <algorithm>
#include <cmath>

namespace check {
namespace {

bool meet(const Box& a, const Box& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.lower[k] > b.upper[k] || b.lower[k] > a.upper[k]) return false;
  return true;
}

}  // namespace

void Box::add(const Point& p) {
  for (std::size_t k = 0; k < 3; ++k)
    lower[k] = std::min(lower[k], p[k]), upper[k] = std::max(upper[k], p[k]);
}

double Box::diagonal() const {
  return std::hypot(upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]);
}

Box box_of(const std::vector<Point>& points) {
  Box box;
  for (const Point& p : points) box.add(p);
  return box;
}

Grid::Grid(std::vector<Box> boxes) : boxes_(std::move(boxes)), seen_(boxes_.size(), 0) {
  for (const Box& b : boxes_) all_.add(b.lower), all_.add(b.upper);
  // Cells about as many as boxes; twice as large as long as a box lies in more than eight cells on average.
  const std::size_t most = 8 * boxes_.size() + 1000;
  for (cell_ = std::max(all_.diagonal() / std::cbrt(double(boxes_.size()) + 1), 1e-300);; cell_ *= 2) {
    for (std::size_t k = 0; k < 3; ++k) cells_[k] = 1 + int((all_.upper[k] - all_.lower[k]) / cell_);
    std::size_t entries = 0;
    for (const Box& b : boxes_) {
      const std::array<int, 3> low = cell_of(b.lower), high = cell_of(b.upper);
      std::size_t cells = 1;
      for (std::size_t k = 0; k < 3; ++k) cells *= std::size_t(high[k] - low[k] + 1);
      entries += cells;
    }
    items_.resize(entries);
    if (entries <= most) break;
  }
  begin_.assign(std::size_t(cells_[0]) * std::size_t(cells_[1]) * std::size_t(cells_[2]) + 1, 0);
  for (const Box& b : boxes_) for_each_cell(b, [&](std::size_t c) { ++begin_[c + 1]; });
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < boxes_.size(); ++i)
    for_each_cell(boxes_[i], [&](std::size_t c) { items_[next[c]++] = int(i); });
}

std::array<int, 3> Grid::cell_of(const Point& p) const {
  std::array<int, 3> c;
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = int(std::clamp((p[k] - all_.lower[k]) / cell_, 0.0, double(cells_[k] - 1)));
  return c;
}

void Grid::for_each_cell(const Box& box, const auto& visit) const {
  const std::array<int, 3> low = cell_of(box.lower), high = cell_of(box.upper);
  for (int z = low[2]; z <= high[2]; ++z)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) visit(row({x, y, z}));
}

void Grid::for_each_meeting(const Box& box, const std::function<void(int)>& visit) const {
  ++query_;
  const std::uint32_t query = query_;
  for_each_cell(box, [&](std::size_t c) {
    for (std::size_t i = begin_[c]; i < begin_[c + 1]; ++i) {
      const std::size_t item = std::size_t(items_[i]);
      if (seen_[item] == query || !meet(boxes_[item], box)) continue;
      seen_[item] = query;
      visit(int(item));
    }
  });
}

void Grid::for_each_along(const Point& from, const Point& direction,
                          const std::function<void(int)>& visit) const {
  ++query_;
  const std::uint32_t query = query_;
  // From the point, if it lies within, else from where the ray comes in; then from cell to cell.
  double enter = 0, leave = 1e300;
  for (std::size_t k = 0; k < 3; ++k) {
    const double a = (all_.lower[k] - from[k]) / direction[k], b = (all_.upper[k] - from[k]) / direction[k];
    enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
  }
  if (!(enter <= leave)) return;
  Point at;
  for (std::size_t k = 0; k < 3; ++k) at[k] = from[k] + enter * direction[k];
  std::array<int, 3> c = cell_of(at);
  for (;;) {
    const std::size_t cell = row(c);
    for (std::size_t i = begin_[cell]; i < begin_[cell + 1]; ++i) {
      const std::size_t item = std::size_t(items_[i]);
      if (seen_[item] == query) continue;
      seen_[item] = query;
      visit(int(item));
    }
    std::size_t axis = 0;
    double nearest = 1e300;
    for (std::size_t k = 0; k < 3; ++k) {
      const double wall = all_.lower[k] + cell_ * (c[k] + (direction[k] > 0 ? 1 : 0));
      if (const double t = (wall - from[k]) / direction[k]; t < nearest) nearest = t, axis = k;
    }
    c[axis] += direction[axis] > 0 ? 1 : -1;
    if (c[axis] < 0 || c[axis] >= cells_[axis]) return;
  }
}

}  // namespace check
