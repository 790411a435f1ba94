// The face that a plane leaves of a solid, against closed forms.
#include "render/cut.h"

#include <gtest/gtest.h>

#include <array>
#include <map>

#include "core/random.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

SurfaceMesh both(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh all{Points(a.positions.rows() + b.positions.rows(), 3),
                  Triangles(a.triangles.rows() + b.triangles.rows(), 3)};
  all.positions << a.positions, b.positions;
  all.triangles << a.triangles, (b.triangles.array() + int(a.positions.rows())).matrix();
  return all;
}

SurfaceMesh inside_out(SurfaceMesh mesh) {
  mesh.triangles.col(1).swap(mesh.triangles.col(2));
  return mesh;
}

// A ring round the z axis, of radius 1, that is 0.5 thick.
SurfaceMesh torus(int around, int across) {
  SurfaceMesh mesh{Points(around * across, 3), Triangles(2 * around * across, 3)};
  for (int i = 0; i < around; ++i)
    for (int k = 0; k < across; ++k) {
      const double a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * k / across,
                   r = 1 + 0.25 * std::cos(b);
      mesh.positions.row(i * across + k) << r * std::cos(a), r * std::sin(a), 0.25 * std::sin(b);
      const auto at = [&](int di, int dk) { return (i + di) % around * across + (k + dk) % across; };
      mesh.triangles.row(2 * (i * across + k)) << at(0, 0), at(1, 0), at(1, 1);
      mesh.triangles.row(2 * (i * across + k) + 1) << at(0, 0), at(1, 1), at(0, 1);
    }
  return mesh;
}

double cap_area(const SurfaceMesh& mesh, const Eigen::Vector4d& plane) {
  return area(cap_of(mesh.positions, mesh.triangles, plane));
}

Eigen::Vector4d plane_at(const Vec3& normal, const Vec3& point) {
  Eigen::Vector4d plane;
  plane << normal, -normal.dot(point);
  return plane;
}

TEST(Cut, OnlyAClosedSurfaceHasAnInside) {
  SurfaceMesh ball = sphere_mesh({0, 0, 0}, 1, 10);
  EXPECT_TRUE(has_inside(ball.triangles));
  EXPECT_TRUE(has_inside(both(ball, inside_out(sphere_mesh({0, 0, 0}, 0.5, 8))).triangles));
  std::swap(ball.triangles(7, 0), ball.triangles(7, 1));
  EXPECT_FALSE(has_inside(ball.triangles));
  ball.triangles.conservativeResize(ball.triangles.rows() - 1, 3);
  EXPECT_FALSE(has_inside(ball.triangles));
}

TEST(Cut, ABallLeavesADisk) {
  const SurfaceMesh ball = sphere_mesh({0.1, 0.2, 0.3}, 1, 100);
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0.3, -2, 0.9)})
    for (const double height : {-0.9, 0.0, 0.4}) {
      const Vec3 point = Vec3(0.1, 0.2, 0.3) + height * normal.normalized();
      EXPECT_NEAR(cap_area(ball, plane_at(normal, point)) / (std::numbers::pi * (1 - height * height)), 1,
                  0.01);
    }
  EXPECT_EQ(cap_area(ball, plane_at({0, 0, 1}, {0, 0, 1.4})), 0);
  EXPECT_EQ(cap_area(ball, plane_at({0, 0, 1}, {0, 0, -5})), 0);
}

TEST(Cut, ATorusLeavesTwoDisksOrARing) {
  const SurfaceMesh ring = torus(200, 60);
  const double disk = std::numbers::pi * 0.25 * 0.25;
  EXPECT_NEAR(cap_area(ring, plane_at({0, 1, 0}, {0, 0, 0})) / (2 * disk), 1, 0.01);
  EXPECT_NEAR(
      cap_area(ring, plane_at({0, 0, -3}, {0, 0, 0})) / (std::numbers::pi * (1.25 * 1.25 - 0.75 * 0.75)), 1,
      0.01);
}

TEST(Cut, PiecesThatOverlapAreOneAndHollowsStayHollow) {
  const SurfaceMesh cube = box_mesh({0, 0, 0}, {1, 1, 1}), other = box_mesh({0.5, 0, 0}, {2, 1, 1}),
                    within = box_mesh({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75});
  const Eigen::Vector4d middle = plane_at({0, 0, 1}, {0, 0, 0.5});
  EXPECT_NEAR(cap_area(cube, middle), 1, 1e-12);
  EXPECT_NEAR(cap_area(both(cube, other), middle), 2, 1e-12);
  EXPECT_NEAR(cap_area(both(cube, within), middle), 1, 1e-12);
  EXPECT_NEAR(cap_area(both(cube, inside_out(within)), middle), 0.75, 1e-12);
  EXPECT_NEAR(cap_area(inside_out(cube), middle), 1, 1e-12);
}

// With what is on the other side it is the whole surface; its rim is that of the cap; and it still is one
// surface: its pieces share their vertices.
TEST(Cut, WhatIsClippedIsOnThisSideOfAllPlanes) {
  const SurfaceMesh ring = torus(50, 20);
  const auto length_of = [](const Points& ends) {
    double length = 0;
    for (Eigen::Index i = 0; i < ends.rows(); i += 2) length += (ends.row(i + 1) - ends.row(i)).norm();
    return length;
  };
  for (std::uint64_t round = 0; round < 30; ++round) {
    Rng random(12, round);
    const Eigen::Vector4d one = plane_at(random.direction(), 0.5 * random.direction()),
                          other = plane_at(random.direction(), 0.5 * random.direction());
    const SurfaceMesh this_side = clipped(ring, std::array{one}),
                      that_side = clipped(ring, std::array<Eigen::Vector4d, 1>{-one});
    EXPECT_NEAR(area(this_side) + area(that_side), area(ring), 1e-9);
    EXPECT_GE(((this_side.positions * one.head<3>()).array() + one[3]).minCoeff(), -1e-12);
    EXPECT_NEAR(length_of(rim_of(this_side)), length_of(rim_of(cap_of(ring.positions, ring.triangles, one))),
                1e-9);
    double quarters = 0;
    for (const double a : {1, -1})
      for (const double b : {1, -1}) {
        const SurfaceMesh quarter = clipped(ring, std::array<Eigen::Vector4d, 2>{a * one, b * other});
        quarters += area(quarter);
        EXPECT_NEAR(area(quarter), area(clipped(ring, std::array<Eigen::Vector4d, 2>{b * other, a * one})),
                    1e-9);
      }
    EXPECT_NEAR(quarters, area(ring), 1e-9);
  }
  EXPECT_EQ(clipped(ring, std::array{plane_at({0, 0, 1}, {0, 0, 5})}).triangles.rows(), 0);
  EXPECT_EQ(clipped(ring, std::array{plane_at({0, 0, 1}, {0, 0, -5})}).positions, ring.positions);
}

// Through vertices, along edges and in faces: of each side together the plane's share of the box is filled at
// most once.
TEST(Cut, VerticesOnThePlaneAreOnOneSide) {
  const SurfaceMesh cube = box_mesh({0, 0, 0}, {1, 1, 1});
  EXPECT_NEAR(cap_area(cube, plane_at({1, -1, 0}, {0, 0, 0})), std::sqrt(2), 1e-12);
  const double low = cap_area(cube, plane_at({0, 0, 1}, {0, 0, 0})),
               high = cap_area(cube, plane_at({0, 0, 1}, {0, 0, 1}));
  EXPECT_EQ(low, 0);
  EXPECT_NEAR(high, 1, 1e-12);
}

// Triangles face the side taken away, inner edges have two of them, and what has one is the loop in which the
// plane meets the surface, as long as that and round the same area: the cap has no gap.
TEST(Cut, TheCapClosesWhatIsLeft) {
  const SurfaceMesh ring = torus(50, 20);
  int caps = 0;
  for (std::uint64_t round = 0; round < 30; ++round) {
    Rng random(11, round);
    const Vec3 normal = random.direction();
    const Eigen::Vector4d plane = plane_at(normal, 0.9 * random.direction());
    const SurfaceMesh cap = cap_of(ring.positions, ring.triangles, plane);
    caps += int(cap.triangles.rows() > 0);
    const auto corner = [](const SurfaceMesh& mesh, Eigen::Index t, int i) -> Vec3 {
      return mesh.positions.row(mesh.triangles(t, i));
    };
    std::map<std::pair<int, int>, int> edges;
    for (Eigen::Index t = 0; t < cap.triangles.rows(); ++t) {
      for (int i = 0; i < 3; ++i) {
        const int a = cap.triangles(t, i), b = cap.triangles(t, (i + 1) % 3);
        edges[std::minmax(a, b)] += a < b ? 1 : -1;
        EXPECT_NEAR(plane.dot(corner(cap, t, i).homogeneous()), 0, 1e-12);
      }
      EXPECT_LE(
          (corner(cap, t, 1) - corner(cap, t, 0)).cross(corner(cap, t, 2) - corner(cap, t, 0)).dot(normal),
          1e-15);
    }
    double rim_m = 0;
    Vec3 enclosed = Vec3::Zero();
    for (const auto& [edge, times] : edges) {
      const Vec3 from = cap.positions.row(edge.first), to = cap.positions.row(edge.second);
      rim_m += std::abs(times) * (to - from).norm();
      enclosed += 0.5 * times * from.cross(to);
    }
    double loop_m = 0;
    for (Eigen::Index t = 0; t < ring.triangles.rows(); ++t) {
      std::vector<Vec3> ends;
      for (int i = 0; i < 3; ++i) {
        const Vec3 a = corner(ring, t, i), b = corner(ring, t, (i + 1) % 3);
        const double ha = plane.dot(a.homogeneous()), hb = plane.dot(b.homogeneous());
        if ((ha < 0) != (hb < 0)) ends.push_back(a + ha / (ha - hb) * (b - a));
      }
      if (ends.size() == 2) loop_m += (ends[1] - ends[0]).norm();
    }
    EXPECT_NEAR(rim_m, loop_m, 1e-9);
    EXPECT_NEAR(enclosed.dot(-normal), area(cap), 1e-9);
  }
  EXPECT_GT(caps, 20);
}

}  // namespace
}  // namespace limber::render
