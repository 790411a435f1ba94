#include "ffd/binding.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "core/error.h"
#include "core/json.h"
#include "core/npz.h"
#include "core/random.h"
#include "ffd/binding_file.h"
#include "tests/core/temporary_folder.h"

namespace limber::ffd {
namespace {

// A box of n cubes, six tets each, with every inner node moved by up to `jitter` of a cube's edge.
TetMesh box_cage(const Box& box, const Eigen::Vector3i& n, double jitter, std::uint64_t seed) {
  TetMesh mesh;
  const auto node = [&](int x, int y, int z) { return x + (n[0] + 1) * (y + (n[1] + 1) * z); };
  mesh.positions.resize(node(n[0], n[1], n[2]) + 1, 3);
  Rng rng(seed, 0);
  const Vec3 cube = box.size().cwiseQuotient(n.cast<double>());
  for (int z = 0; z <= n[2]; ++z)
    for (int y = 0; y <= n[1]; ++y)
      for (int x = 0; x <= n[0]; ++x) {
        Vec3 p = box.lower + cube.cwiseProduct(Vec3(x, y, z));
        if (x % n[0] && y % n[1] && z % n[2]) p += jitter * cube.cwiseProduct(rng.direction());
        mesh.positions.row(node(x, y, z)) = p;
      }
  // Kuhn: a tet for each order in which the axes are walked from corner to corner.
  const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  mesh.tets.resize(6 * n.prod(), 4);
  int t = 0;
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x)
        for (int o = 0; o < 6; ++o, ++t) {
          Eigen::Vector3i corner(x, y, z);
          for (int k = 0; k < 4; ++k) {
            mesh.tets(t, k) = node(corner[0], corner[1], corner[2]);
            if (k < 3) ++corner[orders[o][k]];
          }
          if (o >= 3) std::swap(mesh.tets(t, 0), mesh.tets(t, 1));
        }
  return mesh;
}

// A torus round the z axis.
SurfaceMesh torus(const Vec3& center, double radius, double tube, int around, int across) {
  SurfaceMesh mesh;
  mesh.positions.resize(around * across, 3);
  mesh.triangles.resize(2 * around * across, 3);
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double a = 2 * M_PI * i / around, b = 2 * M_PI * j / across, r = radius + tube * std::cos(b);
      mesh.positions.row(i * across + j) =
          center + Vec3(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
      const auto at = [&](int u, int v) { return (u % around) * across + v % across; };
      mesh.triangles.row(2 * (i * across + j)) = Eigen::Vector3i(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.row(2 * (i * across + j) + 1) =
          Eigen::Vector3i(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return mesh;
}

SurfaceMesh joined(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh m{Points(a.positions.rows() + b.positions.rows(), 3),
                Triangles(a.triangles.rows() + b.triangles.rows(), 3)};
  m.positions << a.positions, b.positions;
  m.triangles << a.triangles, (b.triangles.array() + int(a.positions.rows())).matrix();
  return m;
}

TetMesh joined(const TetMesh& a, const TetMesh& b) {
  TetMesh m{Points(a.positions.rows() + b.positions.rows(), 3), Tets(a.tets.rows() + b.tets.rows(), 4)};
  m.positions << a.positions, b.positions;
  m.tets << a.tets, (b.tets.array() + int(a.positions.rows())).matrix();
  return m;
}

struct Pair {
  const char* name;
  SurfaceMesh surface;
  TetMesh cage;
};

std::vector<Pair> bound_meshes() {
  const Box box{Vec3(-1.5, -1.5, -0.5), Vec3(1.5, 1.5, 0.5)};
  SurfaceMesh with_stranger = torus(Vec3(0, 0, 0), 1, 0.3, 30, 20);
  with_stranger.positions.conservativeResize(with_stranger.positions.rows() + 1, 3);  // in no triangle
  with_stranger.positions.bottomRows(1) << 0.1, 0.2, 0.3;
  return {
      {"torus in a coarse box", torus(Vec3(0, 0, 0), 1, 0.3, 60, 40), box_cage(box, {2, 2, 1}, 0, 1)},
      {"torus in a jittered box", torus(Vec3(0, 0, 0), 1, 0.3, 60, 40), box_cage(box, {6, 6, 3}, 0.25, 2)},
      {"nodes on faces", torus(Vec3(0, 0, 0), 1, 0.5, 24, 24), box_cage(box, {3, 3, 2}, 0, 3)},
      {"a stray vertex", with_stranger, box_cage(box, {4, 4, 2}, 0.2, 4)},
      {"two pieces, one leaves the box",
       joined(torus(Vec3(0, 0, 0), 1, 0.3, 30, 20), torus(Vec3(1, 0.3, 0.2), 0.5, 0.2, 30, 20)),
       box_cage(box, {5, 5, 2}, 0.2, 5)}};
}

struct Affine {
  Eigen::Matrix3d linear;
  Vec3 shift;
  Points operator*(const Points& p) const { return (p * linear.transpose()).rowwise() + shift.transpose(); }
};

Affine random_affine(std::uint64_t seed) {
  Rng rng(seed, 1);
  Affine map;
  for (int i = 0; i < 3; ++i) map.linear.col(i) = rng.direction() * rng.uniform(0.5, 2);
  if (map.linear.determinant() < 0) map.linear.col(0) *= -1;
  map.shift = rng.direction();
  return map;
}

double max_difference(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

TEST(Binding, WeightsSumToOneAndAreNotNegativeInside) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Binding b = bind(surface, cage);
    EXPECT_LT((b.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-15 * 4);
    const auto negative = (b.weights.rowwise().minCoeff().array() < -1e-9).count();
    EXPECT_EQ(negative, b.outside);
    EXPECT_EQ(b.outside > 0, std::string(name).find("leaves") != std::string::npos);
  }
}

TEST(Binding, AtRestEveryVertexIsInItsPlace) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    Points back;
    deform(bind(surface, cage), cage.tets, cage.positions, back);
    EXPECT_LT(max_difference(back, surface.positions), 1e-14);
  }
}

TEST(Binding, ReproducesAffineMaps) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Binding binding = bind(surface, cage);
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Affine map = random_affine(seed);
      Points moved;
      deform(binding, cage.tets, map * cage.positions, moved);
      EXPECT_LT(max_difference(moved, map * surface.positions), 1e-12);
    }
  }
}

// A flat tet magnifies rounding; the binding must not.
TEST(Binding, AFlatTetLosesNoDigits) {
  TetMesh cage{Points(4, 3), Tets(1, 4)};
  cage.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 1e-7;
  cage.tets << 0, 1, 2, 3;
  SurfaceMesh surface{Points(3, 3), Triangles(1, 3)};
  surface.positions << 0.2, 0.2, 1e-8, 0.25, 0.3, 1e-8, 0.3, 0.25, 5e-8;
  surface.triangles << 0, 1, 2;
  const Affine turn{Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
                    Vec3(0.1, 0.2, 0.3)};
  cage.positions = turn * cage.positions;
  surface.positions = turn * surface.positions;
  const Binding b = bind(surface, cage);
  EXPECT_EQ(b.outside, 0);
  Points back;
  deform(b, cage.tets, cage.positions, back);
  EXPECT_LT(max_difference(back, surface.positions), 1e-14);
}

// The tet that holds a vertex is the one that a search through all tets finds.
TEST(Binding, TetsAreThoseOfASearchThroughAll) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Binding b = bind(surface, cage);
    std::int64_t outside = 0;
    for (Eigen::Index v = 0; v < surface.positions.rows(); ++v) {
      double deepest = -1e9, own = 0;
      for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
        Eigen::Matrix4d corners;
        for (int k = 0; k < 4; ++k) corners.col(k) << cage.positions.row(cage.tets(t, k)).transpose(), 1;
        const Eigen::Vector4d p(surface.positions(v, 0), surface.positions(v, 1), surface.positions(v, 2), 1);
        const double depth = corners.partialPivLu().solve(p).minCoeff();
        deepest = std::max(deepest, depth);
        if (t == b.tet_from_vertex[v]) own = depth;
      }
      outside += deepest < -1e-9;
      EXPECT_TRUE(deepest <= 1e-9 || std::abs(own - deepest) < 1e-9) << "vertex " << v;
    }
    EXPECT_EQ(b.outside, outside);
  }
}

// Two boxes touch in a face whose nodes they do not share; a surface piece in each reaches that face.
TEST(Binding, AVertexOnACommonFaceStaysWithItsOwnPiece) {
  const TetMesh left = box_cage({Vec3(-1, 0, 0), Vec3(0, 1, 1)}, {2, 2, 2}, 0.1, 6);
  const TetMesh right = box_cage({Vec3(0, 0, 0), Vec3(1, 1, 1)}, {2, 2, 2}, 0.1, 7);
  const TetMesh cage = joined(left, right);
  // Tori whose outermost ring of vertices lies exactly on x = 0.
  SurfaceMesh in_right = torus(Vec3(0.5, 0.5, 0.5), 0.3, 0.2, 16, 8), in_left = in_right;
  // The first vertex is one of them, so that a piece which simply began there could begin on the wrong side.
  for (Eigen::Index v = 0; v < in_right.positions.rows(); ++v)
    in_right.positions(v, 0) = std::max(0.0, 0.95 - in_right.positions(v, 0));
  in_left.positions.col(0) = -in_right.positions.col(0);
  for (const bool left_first : {true, false}) {
    const SurfaceMesh surface = left_first ? joined(in_left, in_right) : joined(in_right, in_left);
    const Binding b = bind(surface, cage);
    EXPECT_EQ(b.outside, 0);
    int on_face = 0;
    for (Eigen::Index v = 0; v < surface.positions.rows(); ++v) {
      const bool bound_left = b.tet_from_vertex[v] < left.tets.rows();
      EXPECT_EQ(bound_left, left_first == (v < in_left.positions.rows())) << v;
      on_face += surface.positions(v, 0) == 0;
    }
    EXPECT_GE(on_face, 6);
  }
}

TEST(Binding, StrangersAreCountedWithTheirDistance) {
  const TetMesh cage = box_cage({Vec3(0, 0, 0), Vec3(1, 1, 1)}, {2, 2, 2}, 0.1, 8);
  SurfaceMesh surface{Points(6, 3), Triangles(2, 3)};
  surface.positions << 0.2, 0.3, 0.4, 0.5, 0.5, 1.1, 0.7, 0.2, 0.1, -3, -4, 0.5, 1.25, 0.5, 0.5, 0.1, 0.1,
      0.1;
  surface.triangles << 0, 1, 2, 3, 4, 5;
  const Binding b = bind(surface, cage);
  EXPECT_EQ(b.outside, 3);
  EXPECT_EQ(b.farthest_outside_vertex, 3);
  EXPECT_NEAR(b.max_outside_distance_m, 5, 1e-12);
  Points back;
  deform(b, cage.tets, cage.positions, back);
  EXPECT_LT((back.row(1) - surface.positions.row(1)).norm(), 1e-12)
      << "near enough to be extrapolated in full";
  EXPECT_LT((back.row(4) - surface.positions.row(4)).norm(), 1e-12);
  EXPECT_NEAR(b.weights.row(3).minCoeff(), -1, 1e-12) << "clamped";
  EXPECT_NEAR(b.weights.row(3).sum(), 1, 1e-12);
  EXPECT_GT((back.row(3) - surface.positions.row(3)).norm(), 1);
}

// The cage fills a box, and the distance to a box has a closed form.
TEST(Binding, DistancesOfStrangersAreThoseToTheCage) {
  const Box box{Vec3(0, 0, 0), Vec3(2, 1, 1)};
  const TetMesh cage = box_cage(box, {4, 2, 2}, 0.2, 11);
  Rng rng(12, 0);
  for (int k = 0; k < 300; ++k) {
    const Vec3 p = box.center() + rng.uniform(0.5, 3) * rng.direction();
    SurfaceMesh surface{Points(3, 3), Triangles(1, 3)};
    surface.positions << 0.4, 0.5, 0.6, 0.7, 0.2, 0.3, p.transpose();
    surface.triangles << 0, 1, 2;
    const double distance = (p - p.cwiseMax(box.lower).cwiseMin(box.upper)).norm();
    const Binding b = bind(surface, cage);
    EXPECT_EQ(b.outside, distance > 0);
    EXPECT_NEAR(b.max_outside_distance_m, distance, 1e-12);
  }
}

TEST(Binding, TurnedInputIsBoundAlike) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Affine map{Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix() * 2.5,
                     Vec3(10, -3, 1)};
    const Binding a = bind(surface, cage);
    const Binding b = bind({map * surface.positions, surface.triangles}, {map * cage.positions, cage.tets});
    EXPECT_EQ(b.outside, a.outside);
    EXPECT_NEAR(b.max_outside_distance_m, 2.5 * a.max_outside_distance_m, 1e-12);
    for (Eigen::Index v = 0; v < surface.positions.rows(); ++v) {
      if (a.weights.row(v).minCoeff() < 1e-9) continue;  // on a face the tet is a matter of rounding
      EXPECT_EQ(a.tet_from_vertex[v], b.tet_from_vertex[v]);
      EXPECT_LT((a.weights.row(v) - b.weights.row(v)).norm(), 1e-11);
    }
  }
}

TEST(Binding, BadMeshesAreInputErrors) {
  auto [name, surface, cage] = bound_meshes().front();
  SurfaceMesh bad_surface = surface;
  bad_surface.positions(3, 1) = std::nan("");
  EXPECT_THROW(bind(bad_surface, cage), InputError);
  TetMesh bad_cage = cage;
  std::swap(bad_cage.tets(2, 0), bad_cage.tets(2, 1));
  EXPECT_THROW(bind(surface, bad_cage), InputError);
}

// Moved node by node, each its own way.
Points shaken(const Points& positions, double by, std::uint64_t seed) {
  Points moved = positions;
  Rng rng(seed, 2);
  for (Eigen::Index i = 0; i < moved.rows(); ++i) moved.row(i) += by * rng.direction();
  return moved;
}

TEST(Phong, ReproducesAffineMaps) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Binding binding = bind(surface, cage);
    const NodeGradients gradients = node_gradients(cage);
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Affine map = random_affine(seed);
      Points moved;
      deform_phong(binding, cage, gradients, map * cage.positions, moved);
      EXPECT_LT(max_difference(moved, map * surface.positions), 1e-12);
    }
  }
}

// F of a tet by its edges' matrices, and the mean by volumes in so many words.
std::vector<Eigen::Matrix3d> gradients_tet_by_tet(const TetMesh& rest, const Points& moved) {
  const auto edges = [](const Points& p, const auto& tet) {
    Eigen::Matrix3d e;
    for (int k = 0; k < 3; ++k) e.col(k) = p.row(tet[k + 1]) - p.row(tet[0]);
    return e;
  };
  std::vector<Eigen::Matrix3d> sums(std::size_t(rest.positions.rows()), Eigen::Matrix3d::Zero());
  std::vector<double> volumes(sums.size(), 0);
  for (Eigen::Index t = 0; t < rest.tets.rows(); ++t) {
    const Eigen::Matrix3d at_rest = edges(rest.positions, rest.tets.row(t));
    const Eigen::Matrix3d f = edges(moved, rest.tets.row(t)) * at_rest.inverse();
    for (int k = 0; k < 4; ++k) {
      sums[std::size_t(rest.tets(t, k))] += at_rest.determinant() * f;
      volumes[std::size_t(rest.tets(t, k))] += at_rest.determinant();
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= volumes[i];
  return sums;
}

TEST(Phong, IsItsFormulaWithGradientsTetByTet) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Points moved = shaken(cage.positions, 0.2, 21);
    const std::vector<Eigen::Matrix3d> expected = gradients_tet_by_tet(cage, moved);
    const NodeGradients gradients = node_gradients(cage);
    const Gradients f = node_deformation_gradients(gradients, moved);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const Eigen::Matrix3d by_rows =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&f(Eigen::Index(i), 0));
      EXPECT_LT((by_rows - expected[i]).norm(), 1e-12 * (1 + expected[i].norm())) << "node " << i;
    }
    const Binding binding = bind(surface, cage);
    Points shown;
    deform_phong(binding, cage, gradients, moved, shown);
    for (Eigen::Index v = 0; v < shown.rows(); ++v) {
      Vec3 sum = Vec3::Zero();
      for (int k = 0; k < 4; ++k) {
        const int node = cage.tets(binding.tet_from_vertex[v], k);
        const Vec3 from_node = surface.positions.row(v) - cage.positions.row(node);
        sum += binding.weights(v, k) *
               (moved.row(node).transpose() + 0.5 * expected[std::size_t(node)] * from_node);
      }
      EXPECT_LT((shown.row(v).transpose() - sum).norm(), 1e-12);
    }
  }
}

TEST(Phong, IsLinearInTheNodes) {
  const auto [name, surface, cage] = bound_meshes()[1];
  const Binding binding = bind(surface, cage);
  const NodeGradients gradients = node_gradients(cage);
  const Points a = shaken(cage.positions, 0.3, 22), b = shaken(cage.positions, 0.3, 23);
  Points of_a, of_b, of_both;
  deform_phong(binding, cage, gradients, a, of_a);
  deform_phong(binding, cage, gradients, b, of_b);
  deform_phong(binding, cage, gradients, 2 * a - 3 * b, of_both);
  EXPECT_LT(max_difference(of_both, 2 * of_a - 3 * of_b), 1e-13);
}

// One point on a face, bound to the tets on either side of it: the same position.
TEST(Phong, DoesNotTearAtTetBorders) {
  const TetMesh cage = box_cage({Vec3(0, 0, 0), Vec3(1, 1, 1)}, {2, 2, 2}, 0.2, 9);
  const Points moved = shaken(cage.positions, 0.15, 24);
  const NodeGradients gradients = node_gradients(cage);
  int faces = 0;
  for (int s = 0; s < cage.tets.rows(); ++s)
    for (int t = 0; t < s; ++t) {
      Binding one{Eigen::VectorXi::Constant(1, s), Weights::Zero(1, 4)};
      Binding other{Eigen::VectorXi::Constant(1, t), Weights::Zero(1, 4)};
      const double shares[3] = {0.2, 0.3, 0.5};
      int common = 0;
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k)
          if (cage.tets(s, i) == cage.tets(t, k) && common < 3)
            one.weights(0, i) = other.weights(0, k) = shares[common++];
      if (common < 3) continue;
      ++faces;
      Points on_one, on_other;
      deform_phong(one, cage, gradients, moved, on_one);
      deform_phong(other, cage, gradients, moved, on_other);
      EXPECT_LT(max_difference(on_one, on_other), 1e-14);
    }
  EXPECT_GT(faces, 60);
}

// Of a quadratic map f, f(X) = Σ w_i (f(X_i) + ½ ∇f(X_i) (X − X_i)); and where the tets round a node are each
// other's mirror images, their mean gradient is ∇f(X_i). So it is exact away from the boundary, and near it
// better than linear.
TEST(Phong, BendsABarAsAQuadraticMapDoes) {
  const TetMesh cage = box_cage({Vec3(-2, -0.5, -0.5), Vec3(2, 0.5, 0.5)}, {12, 4, 4}, 0, 1);
  const auto bend = [](const Points& p) {
    Points q = p;
    q.col(2).array() += 0.2 * p.col(0).array().square() - 0.1 * p.col(0).array() * p.col(1).array();
    q.col(0).array() -= 0.3 * p.col(0).array() * p.col(2).array();
    return q;
  };
  std::vector<bool> inner(std::size_t(cage.positions.rows()), true);
  for (const int node : vertices_of(boundary_triangles(cage.tets))) inner[std::size_t(node)] = false;
  const SurfaceMesh surface = torus(Vec3(0, 0, 0), 0.35, 0.14, 40, 30);
  SurfaceMesh stretched = surface;
  stretched.positions.col(0) *= 4;
  const Binding binding = bind(stretched, cage);
  EXPECT_EQ(binding.outside, 0);
  Points linear, phong;
  deform(binding, cage.tets, bend(cage.positions), linear);
  deform_phong(binding, cage, node_gradients(cage), bend(cage.positions), phong);
  const Points truth = bend(stretched.positions);
  double inner_linear = 0, inner_phong = 0;
  int count = 0;
  for (Eigen::Index v = 0; v < truth.rows(); ++v) {
    bool all_inner = true;
    for (int k = 0; k < 4; ++k) all_inner &= inner[std::size_t(cage.tets(binding.tet_from_vertex[v], k))];
    if (!all_inner) continue;
    ++count;
    inner_linear = std::max(inner_linear, (linear.row(v) - truth.row(v)).norm());
    inner_phong = std::max(inner_phong, (phong.row(v) - truth.row(v)).norm());
  }
  EXPECT_GT(count, 100);
  EXPECT_GT(inner_linear, 1e-3);
  EXPECT_LT(inner_phong, 1e-13);
  const auto mean_error = [&](const Points& p) { return (p - truth).rowwise().norm().mean(); };
  EXPECT_LT(mean_error(phong), 0.5 * mean_error(linear));
}

TEST(Phong, CollapsedInvertedAndFlatCagesGiveNumbers) {
  auto [name, surface, cage] = bound_meshes().front();
  const Binding binding = bind(surface, cage);
  const NodeGradients gradients = node_gradients(cage);
  Points moved;
  deform_phong(binding, cage, gradients, Points::Zero(cage.positions.rows(), 3), moved);
  EXPECT_EQ(moved, Points::Zero(moved.rows(), 3).eval());
  deform_phong(binding, cage, gradients, shaken(cage.positions, 5, 25), moved);
  EXPECT_TRUE(moved.allFinite());
  // A flat tet, and a node of no tet.
  TetMesh flat{Points(5, 3), Tets(1, 4)};
  flat.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 1e-12, 7, 7, 7;
  flat.tets << 0, 1, 2, 3;
  const Gradients f = node_deformation_gradients(node_gradients(flat), shaken(flat.positions, 1, 26));
  EXPECT_TRUE(f.allFinite());
  EXPECT_TRUE(f.row(4).isZero(0));
}

TEST(Phong, KeepsThePlaceOfItsResult) {
  const auto [name, surface, cage] = bound_meshes().front();
  const Binding binding = bind(surface, cage);
  Points moved(surface.positions.rows(), 3);
  const double* const place = moved.data();
  deform_phong(binding, cage, node_gradients(cage), cage.positions, moved);
  EXPECT_EQ(moved.data(), place);
}

TEST(Normals, UnderAffineMapsAreTheInverseTranspose) {
  for (const auto& [name, surface, cage] : bound_meshes()) {
    SCOPED_TRACE(name);
    const Binding binding = bind(surface, cage);
    const Points rest = vertex_normals(surface.positions, surface.triangles);
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Affine map = random_affine(seed);
      Points normals;
      deform_normals(binding, cage, map * cage.positions, rest, normals);
      const Points expected = (rest * map.linear.inverse()).rowwise().normalized();
      EXPECT_LT(max_difference(normals, expected), 1e-12);
    }
  }
}

Vec3 bent(const Vec3& p) {
  return {p.x() + 0.2 * std::sin(2 * p.y()), p.y() + 0.15 * std::sin(2 * p.z()),
          p.z() + 0.2 * std::cos(2 * p.x())};
}
Eigen::Matrix3d bent_gradient(const Vec3& p) {
  Eigen::Matrix3d g = Eigen::Matrix3d::Identity();
  g(0, 1) = 0.4 * std::cos(2 * p.y()), g(1, 2) = 0.3 * std::cos(2 * p.z()),
       g(2, 0) = -0.4 * std::sin(2 * p.x());
  return g;
}

// Under a smooth map they go to the true normals as the cage is refined.
TEST(Normals, ConvergeUnderASmoothMap) {
  const Box box{Vec3(-1.5, -1.5, -0.5), Vec3(1.5, 1.5, 0.5)};
  const SurfaceMesh surface = torus(Vec3(0, 0, 0), 1, 0.3, 60, 40);
  const Points rest = vertex_normals(surface.positions, surface.triangles);
  double error[3];
  for (int level = 0; level < 3; ++level) {
    const int n = 4 << level;
    const TetMesh cage = box_cage(box, {3 * n, 3 * n, n}, 0, 1);
    Points moved = cage.positions, normals;
    for (Eigen::Index i = 0; i < moved.rows(); ++i) moved.row(i) = bent(cage.positions.row(i));
    deform_normals(bind(surface, cage), cage, moved, rest, normals);
    double sum = 0;
    for (Eigen::Index v = 0; v < normals.rows(); ++v) {
      const Vec3 n_rest = rest.row(v), p = surface.positions.row(v);
      sum += (normals.row(v).transpose() - (bent_gradient(p).inverse().transpose() * n_rest).normalized())
                 .norm();
    }
    error[level] = sum / double(normals.rows());
  }
  EXPECT_LT(error[0], 0.02);
  EXPECT_LT(error[1], 0.6 * error[0]);
  EXPECT_LT(error[2], 0.6 * error[1]);
}

// One point on a face, bound to the tets on either side of it: the same normal.
TEST(Normals, DoNotJumpAtTetBorders) {
  const TetMesh cage = box_cage({Vec3(0, 0, 0), Vec3(1, 1, 1)}, {2, 2, 2}, 0.2, 9);
  Points moved = cage.positions;
  Rng rng(10, 0);
  for (Eigen::Index i = 0; i < moved.rows(); ++i) moved.row(i) += 0.15 * rng.direction();
  Points rest(1, 3), on_one, on_other;
  rest << 0.6, 0, 0.8;
  int faces = 0;
  for (int s = 0; s < cage.tets.rows(); ++s)
    for (int t = 0; t < s; ++t) {
      Binding one{Eigen::VectorXi::Constant(1, s), Weights::Zero(1, 4)};
      Binding other{Eigen::VectorXi::Constant(1, t), Weights::Zero(1, 4)};
      const double shares[3] = {0.2, 0.3, 0.5};
      int common = 0;
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k)
          if (cage.tets(s, i) == cage.tets(t, k) && common < 3)
            one.weights(0, i) = other.weights(0, k) = shares[common++];
      if (common < 3) continue;
      ++faces;
      deform_normals(one, cage, moved, rest, on_one);
      deform_normals(other, cage, moved, rest, on_other);
      EXPECT_LT(max_difference(on_one, on_other), 1e-14);
    }
  EXPECT_GT(faces, 60);
}

TEST(Normals, AFlattenedCageKeepsTheRestDirection) {
  const auto [name, surface, cage] = bound_meshes().front();
  const Points rest = vertex_normals(surface.positions, surface.triangles);
  Points normals;
  deform_normals(bind(surface, cage), cage, Points::Zero(cage.positions.rows(), 3), rest, normals);
  EXPECT_EQ(normals, rest);
}

struct BindingFile : ::testing::Test {
  TemporaryFolder folder;
  SurfaceMesh surface = torus(Vec3(0, 0, 0), 1, 0.3, 6, 5);
  TetMesh cage = box_cage({Vec3(-1.5, -1.5, -0.5), Vec3(1.5, 1.5, 0.5)}, {2, 2, 1}, 0, 1);
  fs::path path = folder / "binding.npz";

  BindingFile() {
    surface.positions(0, 2) = 1;  // outside
    write_binding(path, bind(surface, cage), surface, cage);
  }
};

TEST_F(BindingFile, RoundTrip) {
  const Binding binding = bind(surface, cage), back = read_binding(path, surface, cage);
  EXPECT_EQ(back.tet_from_vertex, binding.tet_from_vertex);
  EXPECT_EQ(back.weights, binding.weights);
  EXPECT_EQ(back.outside, 1);
  EXPECT_EQ(back.farthest_outside_vertex, 0);
  EXPECT_EQ(back.max_outside_distance_m, binding.max_outside_distance_m);
}

TEST_F(BindingFile, FiguresThatNoBindingHasAreRefused) {
  const Npz good = read_npz(path);
  const auto with = [&](const char* key, const Json& value) {
    Npz file = good;
    Json meta = Json::parse(file.text("meta.json"));
    meta[key] = value;
    file.texts["meta.json"] = meta.dump();
    write_npz(path, file);
  };
  for (const char* key : {"outside", "farthest_outside_vertex", "max_outside_distance_m"}) {
    for (const Json& odd : {Json(-2), Json(0x1p33), Json(1e300), Json("1"), Json()}) {
      if (odd.is_number() && odd > 0 && std::string(key) == "max_outside_distance_m") continue;
      with(key, odd);
      EXPECT_THROW(read_binding(path, surface, cage), InputError) << key << " " << odd;
    }
    with(key, 0);
    EXPECT_NO_THROW(read_binding(path, surface, cage)) << key;
  }
}

// Vega's form: the vertex, then four times a node of the cage and its weight.
TEST_F(BindingFile, InterpRebuildsTheSurface) {
  write_interp(folder / "a.interp", bind(surface, cage), cage.tets);
  std::ifstream in(folder / "a.interp");
  for (Eigen::Index v = 0; v < surface.positions.rows(); ++v) {
    std::string line;
    std::getline(in, line);
    std::istringstream numbers(line);
    Eigen::Index vertex = -1;
    numbers >> vertex;
    EXPECT_EQ(vertex, v);
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 4; ++k) {
      int node = -1;
      double weight = 0;
      numbers >> node >> weight;
      ASSERT_TRUE(numbers && node >= 0 && node < cage.positions.rows()) << line;
      sum += weight * cage.positions.row(node).transpose();
    }
    EXPECT_LT((sum - surface.positions.row(v).transpose()).norm(), 1e-14);
    EXPECT_TRUE((numbers >> std::ws).eof()) << line;
  }
  EXPECT_EQ(in.get(), std::ifstream::traits_type::eof());
}

TEST_F(BindingFile, OtherMeshesAreRefusedWithTheCommandThatRenewsIt) {
  const auto expect_refused = [&](const SurfaceMesh& s, const TetMesh& c, const std::string& what) {
    try {
      read_binding(path, s, c);
      ADD_FAILURE() << "another " << what << " passed";
    } catch (const InputError& trouble) {
      const std::string text = trouble.what();
      EXPECT_NE(text.find("another " + what), std::string::npos) << text;
      EXPECT_NE(text.find("`limber prepare`"), std::string::npos) << text;
    }
  };
  SurfaceMesh other_surface = surface;
  other_surface.positions(4, 0) += 1e-15;
  expect_refused(other_surface, cage, "surface");
  TetMesh other_cage = cage;
  other_cage.tets.row(0).swap(other_cage.tets.row(1));
  expect_refused(surface, other_cage, "cage");
}

TEST_F(BindingFile, EveryTruncatedPrefixIsAnInputError) {
  const std::string whole = read_file(path);
  const fs::path cut = folder / "cut.npz";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    fs::remove(cut);  // to overwrite it in place makes the file system wait for the disk
    std::ofstream(cut, std::ios::binary) << whole.substr(0, size);
    ASSERT_THROW(read_binding(cut, surface, cage), InputError) << size << " of " << whole.size() << " bytes";
  }
}

TEST_F(BindingFile, ContradictionsAreInputErrors) {
  const Npz good = read_npz(path);
  const auto expect_refused = [&](const std::string& what, const std::function<void(Npz&)>& change) {
    Npz bad = good;
    change(bad);
    write_npz(path, bad);
    EXPECT_THROW(read_binding(path, surface, cage), InputError) << what;
  };
  expect_refused("no weights", [](Npz& f) { f.arrays.erase("weights"); });
  expect_refused("no meta", [](Npz& f) { f.texts.erase("meta.json"); });
  expect_refused("empty meta", [](Npz& f) { f.texts["meta.json"] = "{}"; });
  expect_refused("no tet of this number", [](Npz& f) {
    const std::vector<std::int32_t> tets(30, 24);
    f.arrays["tet_from_vertex"] = NpyArray::of<std::int32_t>(tets, {30});
  });
  expect_refused("weights of zero", [](Npz& f) {
    const std::vector<double> zero(120, 0.0);
    f.arrays["weights"] = NpyArray::of<double>(zero, {30, 4});
  });
  expect_refused("not a number", [](Npz& f) {
    const std::vector<double> nan(120, std::nan(""));
    f.arrays["weights"] = NpyArray::of<double>(nan, {30, 4});
  });
  expect_refused("too few rows", [](Npz& f) {
    const std::vector<double> few(116, 0.25);
    f.arrays["weights"] = NpyArray::of<double>(few, {29, 4});
  });
}

}  // namespace
}  // namespace limber::ffd
