// Fine surfaces given by a distance function, for tests of contact between them.
#pragma once

#include <functional>
#include <memory>

#include "core/contact_shape.h"
#include "core/mesh.h"

namespace limber::fem::testing {

using Distance = std::function<double(const Vec3&)>;  // signed, negative inside

inline Distance ball_surface(const Vec3& center, double radius) {
  return [=](const Vec3& p) { return (p - center).norm() - radius; };
}
// A box whose edges and corners are rounded.
inline Distance rounded_box_surface(const Box& box, double radius) {
  return [=](const Vec3& p) {
    const Vec3 out = (p - box.center()).cwiseAbs() - box.size() / 2 + Vec3::Constant(radius);
    return out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0) - radius;
  };
}

// Samples are where the edges of a grid of that spacing cross the surface.
inline std::shared_ptr<const ContactShape> shape_of(const TetMesh& cage, const Distance& distance,
                                                    double cell_m, double spacing_m) {
  ContactShape shape;
  const Box box = bounding_box(cage.positions);
  DistanceField& field = shape.field;
  field.cell_m = cell_m, field.unit_m = 1e-4 * box.diagonal();
  field.lower_m = box.lower - Vec3::Constant(1.37 * cell_m);
  for (int c = 0; c < 3; ++c) field.nodes[std::size_t(c)] = int(box.size()[c] / cell_m) + 4;
  for (int k = 0; k < field.nodes[2]; ++k)
    for (int j = 0; j < field.nodes[1]; ++j)
      for (int i = 0; i < field.nodes[0]; ++i)
        field.values.push_back(
            std::int16_t(std::lround(distance(field.lower_m + cell_m * Vec3(i, j, k)) / field.unit_m)));

  std::vector<Vec3> points;
  const Vec3 lower = box.lower - Vec3::Constant(0.41 * spacing_m);
  const Eigen::Vector3i count = ((box.size() / spacing_m).array() + 2).cast<int>();
  for (int k = 0; k <= count[2]; ++k)
    for (int j = 0; j <= count[1]; ++j)
      for (int i = 0; i <= count[0]; ++i)
        for (int c = 0; c < 3; ++c) {
          const Vec3 p = lower + spacing_m * Vec3(i, j, k), q = p + spacing_m * Vec3::Unit(c);
          double at_p = distance(p), low = 0, high = 1;
          if ((at_p < 0) == (distance(q) < 0)) continue;
          for (int halving = 0; halving < 40; ++halving) {
            const double middle = (low + high) / 2;
            ((distance(p + middle * (q - p)) < 0) == (at_p < 0) ? low : high) = middle;
          }
          points.push_back(p + low * (q - p));
        }
  std::vector<std::vector<int>> points_of_tet(std::size_t(cage.tets.rows()));
  const auto weights_in = [&](int t, const Vec3& p) {
    const auto corner = [&](int i) -> Vec3 { return cage.positions.row(cage.tets(t, i)); };
    const Vec3 a = corner(0), b = corner(1), c = corner(2), d = corner(3);
    return Eigen::RowVector4d(Eigen::RowVector4d(signed_volume(p, b, c, d), signed_volume(a, p, c, d),
                                                 signed_volume(a, b, p, d), signed_volume(a, b, c, p)) /
                              signed_volume(a, b, c, d));
  };
  for (int i = 0; i < int(points.size()); ++i)
    for (int t = 0; t < cage.tets.rows(); ++t)
      if (weights_in(t, points[std::size_t(i)]).minCoeff() >= -1e-9) {
        points_of_tet[std::size_t(t)].push_back(i);
        break;
      }
  SurfaceSamples& samples = shape.samples;
  const Eigen::Index all = Eigen::Index(points.size());
  samples.positions_m.resize(all, 3), samples.weights.resize(all, 4), samples.tet_from_sample.resize(all);
  samples.area_m2 = Eigen::VectorXd::Constant(all, spacing_m * spacing_m / 1.5);
  Eigen::Index s = 0;
  for (int t = 0; t < cage.tets.rows(); ++t)
    for (const int i : points_of_tet[std::size_t(t)]) {
      samples.positions_m.row(s) = points[std::size_t(i)].transpose();
      samples.weights.row(s) = weights_in(t, points[std::size_t(i)]);
      samples.tet_from_sample[s++] = t;
    }
  samples.positions_m.conservativeResize(s, 3), samples.weights.conservativeResize(s, 4);
  samples.tet_from_sample.conservativeResize(s), samples.area_m2.conservativeResize(s);
  shape.min_weight = Weights::Zero(cage.tets.rows(), 4);
  return std::make_shared<ContactShape>(std::move(shape));
}

}  // namespace limber::fem::testing
