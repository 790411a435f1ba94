// Points in the cells of a regular grid, to find those near a place.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

class PointGrid {
 public:
  // For points of the box; a cell is `cell` wide or wider, so that there are at most 96 on an axis.
  PointGrid(const Box& box, double cell)
      : lower_(box.lower), cell_(std::max(cell, box.size().maxCoeff() / 96)) {
    for (int axis = 0; axis < 3; ++axis) cells_[axis] = int(box.size()[axis] / cell_) + 1;
    first_.assign(std::size_t(cells_[0]) * cells_[1] * cells_[2], -1);
  }

  void add(const Vec3& p) {
    int& first = first_[std::size_t(cell_of(p))];
    next_.push_back(first);
    first = int(points_.size());
    points_.push_back(p);
  }

  int cell_of(const Vec3& p) const {
    return (place(p, 2) * cells_[1] + place(p, 1)) * cells_[0] + place(p, 0);
  }

  // Calls visit(number, squared distance) for the points within the radius, numbered as they were added,
  // until it returns true; returns whether it did.
  template <class Visit>
  bool any_within(const Vec3& p, double radius, Visit visit) const {
    return any_cell(p, radius, [&](int cell) {
      for (int n = first_[std::size_t(cell)]; n >= 0; n = next_[std::size_t(n)]) {
        const double d = (points_[std::size_t(n)] - p).squaredNorm();
        if (d <= radius * radius && visit(n, d)) return true;
      }
      return false;
    });
  }

  // The same of cells that may hold such points, numbered as cell_of does.
  template <class Visit>
  bool any_cell(const Vec3& p, double radius, Visit visit) const {
    const Vec3 r = Vec3::Constant(radius), from = p - r, to = p + r;
    for (int k = place(from, 2); k <= place(to, 2); ++k)
      for (int j = place(from, 1); j <= place(to, 1); ++j)
        for (int i = place(from, 0); i <= place(to, 0); ++i)
          if (visit((k * cells_[1] + j) * cells_[0] + i)) return true;
    return false;
  }
  int cells() const { return int(first_.size()); }

 private:
  int place(const Vec3& p, int axis) const {
    return int(std::clamp((p[axis] - lower_[axis]) / cell_, 0.0, double(cells_[std::size_t(axis)] - 1)));
  }

  Vec3 lower_;
  double cell_;
  std::array<int, 3> cells_;
  std::vector<int> first_,
      next_;  // of each cell the last point added; of each point the one before; −1: none
  std::vector<Vec3> points_;
};

}  // namespace limber::meshing::detail
