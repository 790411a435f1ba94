// The surface as a solid: found by grid, inside told by rays.
#pragma once

#include "tools/check_cage/exact.h"
#include "tools/check_cage/grid.h"

namespace check {

class Solid {
 public:
  explicit Solid(Surface surface);

  const Surface& surface() const { return surface_; }
  const Grid& grid() const { return grid_; }  // of the triangles
  Corners corners(std::size_t triangle) const;
  bool closed() const { return closed_; }  // each edge is used as often in one direction as in the other
  double area() const;
  double volume() const;  // signed; of the closed surface

  // By rays. Where the surface is closed and of one turn: the winding number (the middle one of three) is not
  // 0; so a model that is inside out counts as well. Else: most of nine rays cross the surface an odd number
  // of times.
  bool inside(const Point&) const;
  double distance(const Point&) const;  // to the closest point of the surface

 private:
  struct Crossings {
    int all = 0, outwards_less_inwards = 0;
  };
  Crossings crossings(const Point& from, const Point& direction) const;

  Surface surface_;
  Grid grid_;
  bool closed_;
};

// Vectors.
Point operator-(const Point&, const Point&);
Point operator+(const Point&, const Point&);
Point operator*(double, const Point&);
Point cross(const Point&, const Point&);
double dot(const Point&, const Point&);
double length(const Point&);

}  // namespace check
