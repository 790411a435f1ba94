#include "meshing/contact_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/mass_properties.h"
#include "core/random.h"
#include "meshing/contact_shape.h"
#include "meshing/detail/overshoot.h"
#include "meshing/detail/seen_surface.h"
#include "meshing/detail/surface_spots.h"
#include "meshing/surface_tree.h"

namespace limber::meshing {

namespace {

constexpr std::uint64_t seed = 1;
constexpr int nodes_anywhere = 2000, nodes_at_samples = 4000, spots = 2000;
// What was found of good shapes is at most a half of these.
constexpr double max_field_cells = 1.5, max_steepness = 2.5, max_gap = 4;
constexpr double rounding = 1e-9;           // of the size
constexpr double rounding_of_sums = 1e-15;  // of the coordinates of places that are added up

std::size_t index_of(const DistanceField& field, const std::array<int, 3>& at) {
  return (std::size_t(at[2]) * std::size_t(field.nodes[1]) + std::size_t(at[1])) *
             std::size_t(field.nodes[0]) +
         std::size_t(at[0]);
}

double steepest_of(const DistanceField& field) {
  int most = 0;
  const std::size_t step[3] = {1, std::size_t(field.nodes[0]),
                               std::size_t(field.nodes[0]) * std::size_t(field.nodes[1])};
  std::size_t node = 0;
  for (int k = 0; k < field.nodes[2]; ++k)
    for (int j = 0; j < field.nodes[1]; ++j)
      for (int i = 0; i < field.nodes[0]; ++i, ++node) {
        const int here = field.values[node];
        if (i > 0) most = std::max(most, std::abs(here - field.values[node - step[0]]));
        if (j > 0) most = std::max(most, std::abs(here - field.values[node - step[1]]));
        if (k > 0) most = std::max(most, std::abs(here - field.values[node - step[2]]));
      }
  return most * field.unit_m / field.cell_m;
}

class Checker {
 public:
  Checker(const ContactShape& shape, const SurfaceMesh& surface, const TetMesh& cage)
      : shape_(shape),
        surface_(surface),
        cage_(cage),
        size_(bounding_box(surface.positions).size().maxCoeff()),
        slack_m_(rounding * size_ + rounding_of_sums * surface.positions.cwiseAbs().maxCoeff()),
        winding_(surface.positions, surface.triangles),
        closed_(is_closed(surface.triangles)),
        seen_(detail::seen_surface(surface, winding_, closed_, size_ / 32, detail::offset_share * size_)),
        distance_(soup_points(), soup_triangles()) {}

  ContactCheck check() {
    check_field();
    check_samples();
    c_.wrong_least_weights = 0;
    const Weights least = min_weights(shape_.field, cage_);
    for (Eigen::Index t = 0; t < least.rows(); ++t)
      c_.wrong_least_weights += !((least.row(t) - shape_.min_weight.row(t)).cwiseAbs().maxCoeff() <= 1e-9);
    say();
    return c_;
  }

 private:
  Points soup_points() const {
    Points points(3 * Eigen::Index(seen_.pieces.size()), 3);
    Eigen::Index row = 0;
    for (const detail::SurfacePiece& piece : seen_.pieces)
      if (piece.seen)
        for (const Vec3& corner : piece.corners) points.row(row++) = corner;
    points.conservativeResize(row, 3);
    return points;
  }
  Triangles soup_triangles() const {
    const auto count = std::count_if(seen_.pieces.begin(), seen_.pieces.end(),
                                     [](const detail::SurfacePiece& piece) { return piece.seen; });
    Triangles triangles(count, 3);
    for (Eigen::Index i = 0; i < triangles.size(); ++i) triangles.data()[i] = int(i);
    return triangles;
  }

  void check_node(const std::array<int, 3>& at) {
    const DistanceField& field = shape_.field;
    const double value = field.unit_m * field.values[index_of(field, at)];
    const Vec3 place = field.lower_m + field.cell_m * Vec3(at[0], at[1], at[2]);
    const double distance = distance_.at(place), off = std::abs(value) - distance;
    ++c_.nodes;
    // Where holes are closed, the field knows a surface that is not there.
    c_.field_cells = std::max(c_.field_cells, (closed_ ? std::abs(off) : off) / field.cell_m);
    if (distance > field.cell_m && clearly_not(value < 0, place) &&
        (closed_ || all_round_is_not(value < 0, place)))
      ++c_.wrong_sides;
  }

  bool clearly_not(bool inside, const Vec3& place) const {
    const double winding = winding_.at(place) - 0.5;
    return std::abs(winding) > 0.25 && (winding > 0) != inside;
  }

  // Through holes the field takes a side two cells far.
  bool all_round_is_not(bool inside, const Vec3& place) const {
    for (int axis = 0; axis < 3; ++axis)
      for (const double cells : {-2., -1., 1., 2.}) {
        const Vec3 there = place + cells * shape_.field.cell_m * Vec3::Unit(axis);
        if ((winding_.at(there) > 0.5) == inside) return false;
      }
    return true;
  }

  void check_field() {
    const DistanceField& field = shape_.field;
    Rng rng(seed, 0);
    for (int n = 0; n < nodes_anywhere; ++n)
      check_node({rng.below(field.nodes[0]), rng.below(field.nodes[1]), rng.below(field.nodes[2])});
    for (int n = 0; n < nodes_at_samples; ++n) {
      const Vec3 p = shape_.samples.positions_m.row(rng.below(int(shape_.samples.area_m2.size())));
      std::array<int, 3> at;
      for (int axis = 0; axis < 3; ++axis)
        at[std::size_t(axis)] = std::clamp(int((p[axis] - field.lower_m[axis]) / field.cell_m) + rng.below(2),
                                           0, field.nodes[std::size_t(axis)] - 1);
      check_node(at);
    }
    // Where it is a guess what is inside, the field may change its sign without coming near to 0.
    if (closed_) c_.steepest = steepest_of(field);
  }

  bool in_a_tet(const Vec3& p) const {
    for (Eigen::Index t = 0; t < cage_.tets.rows(); ++t) {
      const auto corner = [&](int k) { return Vec3(cage_.positions.row(cage_.tets(t, k))); };
      if (tet_holds(corner(0), corner(1), corner(2), corner(3), p)) return true;
    }
    return false;
  }

  void check_samples() {
    const SurfaceSamples& samples = shape_.samples;
    std::optional<detail::SurfaceDistance> whole_surface;
    // Pieces of an open surface are judged by their neighbours, and samples of corners by themselves: some
    // lie on a piece that is not seen.
    const auto off_surface = [&](const Vec3& p) {
      const double off = distance_.at(p);
      if (off <= slack_m_) return off;
      if (!whole_surface) whole_surface.emplace(surface_.positions, surface_.triangles);
      return whole_surface->at(p);
    };
    for (Eigen::Index s = 0; s < samples.area_m2.size(); ++s) {
      const Vec3 p = samples.positions_m.row(s);
      c_.off_surface_m = std::max(c_.off_surface_m, off_surface(p));
      Vec3 there = Vec3::Zero();
      for (int k = 0; k < 4; ++k)
        there += samples.weights(s, k) * Vec3(cage_.positions.row(cage_.tets(samples.tet_from_sample[s], k)));
      // What is in no tet hangs on the nearest, as far as a weight of −1 allows.
      const double least = samples.weights.row(s).minCoeff();
      if (least < -1e-6 && in_a_tet(p)) c_.misplaced_m = size_;
      if (least > -0.999) c_.misplaced_m = std::max(c_.misplaced_m, (there - p).norm());
    }
    c_.area_share = samples.area_m2.sum() / seen_.area_m2;
    // The nearest may be one of a crease, where they are close, beside a face, where they are not: one of a
    // few near ones stands for the place.
    const detail::SurfaceSpots sequence(seen_);
    std::vector<std::pair<double, Eigen::Index>> near(std::size_t(samples.area_m2.size()));
    const std::size_t few = std::min<std::size_t>(near.size(), 6);
    for (int i = 0; i < spots; ++i) {
      const Vec3 p = sequence.at(std::uint32_t(i)).position;
      for (std::size_t s = 0; s < near.size(); ++s)
        near[s] = {(samples.positions_m.row(Eigen::Index(s)).transpose() - p).squaredNorm(), Eigen::Index(s)};
      std::partial_sort(near.begin(), near.begin() + std::ptrdiff_t(few), near.end());
      double gap2 = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < few; ++k)
        gap2 = std::min(gap2, near[k].first / samples.area_m2[near[k].second]);
      c_.widest_gap = std::max(c_.widest_gap, std::sqrt(gap2));
    }
  }

  void say() {
    if (c_.field_cells > max_field_cells)
      c_.field_fault = fmt::format("a distance is off by {:.2f} cells", c_.field_cells);
    else if (c_.wrong_sides > 0)
      c_.field_fault = fmt::format("{} of {} nodes are on the wrong side", c_.wrong_sides, c_.nodes);
    else if (c_.steepest > max_steepness)
      c_.field_fault = fmt::format("it changes by {:.2f} m a metre", c_.steepest);
    else if (c_.wrong_least_weights > 0)
      c_.field_fault = fmt::format("least_weight of {} tets is another's", c_.wrong_least_weights);
    if (c_.off_surface_m > slack_m_)
      c_.sample_fault = fmt::format("one is {:.2g} m off the surface", c_.off_surface_m);
    else if (c_.misplaced_m > slack_m_)
      c_.sample_fault = fmt::format("one is bound {:.2g} m beside itself", c_.misplaced_m);
    else if (std::abs(c_.area_share - 1) > 1e-6)
      c_.sample_fault = fmt::format("they stand for {:.6f} of the surface", c_.area_share);
    else if (c_.widest_gap > max_gap)
      c_.sample_fault = fmt::format("a place is {:.1f} spacings away from them", c_.widest_gap);
  }

  const ContactShape& shape_;
  const SurfaceMesh& surface_;
  const TetMesh& cage_;
  const double size_, slack_m_;  // m; the other is what rounding may be off by
  const WindingNumber winding_;
  const bool closed_;
  const detail::SeenSurface seen_;
  const detail::SurfaceDistance distance_;
  ContactCheck c_;
};

}  // namespace

ContactCheck check_contact_shape(const ContactShape& shape, const SurfaceMesh& surface, const TetMesh& cage) {
  return Checker(shape, surface, cage).check();
}

}  // namespace limber::meshing
