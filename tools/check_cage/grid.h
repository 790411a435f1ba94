// A uniform grid over boxes: which of them may meet a box.
#pragma once

#include <cstdint>
#include <functional>

#include "tools/check_cage/files.h"

namespace check {

struct Box {
  Point lower{1e300, 1e300, 1e300}, upper{-1e300, -1e300, -1e300};
  void add(const Point& p);
  double diagonal() const;
};
Box box_of(const std::vector<Point>&);

class Grid {
 public:
  explicit Grid(std::vector<Box> boxes);
  // Calls visit(i), once each, for every box that meets `box` (closed), in no particular order.
  void for_each_meeting(const Box& box, const std::function<void(int)>& visit) const;
  // Calls visit(i), at least once each, for every box that the ray may meet.
  void for_each_along(const Point& from, const Point& direction, const std::function<void(int)>& visit) const;
  const Box& box() const { return all_; }
  double cell() const { return cell_; }

 private:
  std::array<int, 3> cell_of(const Point&) const;  // clamped into the grid
  std::size_t row(const std::array<int, 3>& c) const {
    return (std::size_t(c[2]) * std::size_t(cells_[1]) + std::size_t(c[1])) * std::size_t(cells_[0]) +
           std::size_t(c[0]);
  }
  void for_each_cell(const Box&, const auto& visit) const;

  std::vector<Box> boxes_;
  Box all_;
  double cell_ = 1;
  std::array<int, 3> cells_{1, 1, 1};
  std::vector<std::size_t> begin_;  // of each cell, in items_
  std::vector<int> items_;
  mutable std::vector<std::uint32_t> seen_;  // by which query
  mutable std::uint32_t query_ = 0;
};

}  // namespace check
