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

  // Signed crossings of rays: the winding number where the surface is closed (the middle one of three rays),
  // else the mean over nine directions, which estimates the share of the view that the surface fills. Over a
  // half.
  bool inside(const Point&) const;
  double distance(const Point&) const;  // to the closest point of the surface

 private:
  int crossings(const Point& from, const Point& direction) const;

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
