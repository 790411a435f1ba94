#include "meshing/contact_shape.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/mass_properties.h"
#include "core/progress.h"
#include "core/threads.h"
#include "meshing/detail/box_tree.h"
#include "meshing/detail/fill_field.h"
#include "meshing/detail/nearest_on_triangle.h"
#include "meshing/detail/sample_surface.h"
#include "meshing/detail/seen_surface.h"

namespace limber::meshing {

namespace {

using Weights4 = Eigen::RowVector4d;

constexpr double min_cells_thick = 2;
constexpr double well_resolved_cells = 3;  // a thickness that is not worth more cells than settings.max_cells
constexpr int max_cells_for_thin_walls = 1000;
constexpr double double_share_worth_a_word = 0.05;  // of a volume
constexpr double open_share_worth_a_word = 0.1, open_share_too_large = 0.5;

// Barycentric coordinates in each tet of a mesh.
class TetCoordinates {
 public:
  explicit TetCoordinates(const TetMesh& mesh) : mesh_(mesh), gradients_(std::size_t(mesh.tets.rows())) {
    for (int t = 0; t < mesh.tets.rows(); ++t) {
      Eigen::Matrix3d edges;
      for (int k = 0; k < 3; ++k) edges.col(k) = corner(t, k) - corner(t, 3);
      gradients_[std::size_t(t)].topRows<3>() = edges.inverse();
      gradients_[std::size_t(t)].row(3) = -gradients_[std::size_t(t)].topRows<3>().colwise().sum();
    }
  }
  Vec3 corner(int tet, int k) const { return mesh_.positions.row(mesh_.tets(tet, k)); }
  const Eigen::Matrix<double, 4, 3>& gradients(int tet) const { return gradients_[std::size_t(tet)]; }
  // One step of iterative refinement removes the error of the inverse, which matters in flat tets.
  Weights4 at(int tet, const Vec3& p) const {
    const auto to_weights = gradients(tet).topRows<3>();
    const Vec3 from = p - corner(tet, 3), rough = to_weights * from;
    Vec3 missed = from;
    for (int k = 0; k < 3; ++k) missed -= rough[k] * (corner(tet, k) - corner(tet, 3));
    const Vec3 w = rough + to_weights * missed;
    return {w[0], w[1], w[2], 1 - w.sum()};
  }

 private:
  const TetMesh& mesh_;
  std::vector<Eigen::Matrix<double, 4, 3>> gradients_;
};

Box box_of(const TetCoordinates& coordinates, int tet) {
  Box box;
  for (int k = 0; k < 4; ++k) box.include(coordinates.corner(tet, k));
  return box;
}

// Finds the tet that a point is bound to.
class TetFinder {
 public:
  TetFinder(const TetMesh& cage, const TetCoordinates& coordinates)
      : coordinates_(coordinates), tree_(boxes(cage, coordinates)) {}

  std::pair<int, Weights4> find(const Vec3& p) const {
    constexpr double tolerance = 1e-9, min_weight = -1;
    int tet = -1;
    tree_.any(
        [&](const Box& box) {
          return (p.array() < box.lower.array() || p.array() > box.upper.array()).any();
        },
        [&](int t) {
          if ((tet < 0 || t < tet) && coordinates_.at(t, p).minCoeff() >= -tolerance) tet = t;
          return false;
        });
    if (tet >= 0) return {tet, coordinates_.at(tet, p)};
    double least = 1e300;
    tree_.nearest(p, least, [&](int t) {
      const double d = squared_distance(t, p);
      if (d < least || (d == least && t < tet)) least = d, tet = t;
      return least;
    });
    const Weights4 there = coordinates_.at(tet, p);
    if (there.minCoeff() >= min_weight) return {tet, there};
    // From the middle of the tet outwards, as far as the clamp allows.
    const Weights4 middle = Weights4::Constant(0.25), way = there - middle;
    return {tet, middle + (0.25 - min_weight) / (0.25 - there.minCoeff()) * way};
  }

 private:
  static std::vector<Box> boxes(const TetMesh& cage, const TetCoordinates& coordinates) {
    std::vector<Box> all;
    for (int t = 0; t < cage.tets.rows(); ++t) all.push_back(box_of(coordinates, t));
    return all;
  }
  // Of a point outside.
  double squared_distance(int tet, const Vec3& p) const {
    double least = 1e300;
    for (int k = 0; k < 4; ++k) {
      const auto corner = [&](int c) { return coordinates_.corner(tet, (k + c) % 4); };
      least = std::min(least,
                       (detail::nearest_on_triangle(corner(1), corner(2), corner(3), p) - p).squaredNorm());
    }
    return least;
  }

  const TetCoordinates& coordinates_;
  detail::BoxTree tree_;
};

SurfaceSamples bound(const std::vector<detail::SurfaceSample>& samples, const TetMesh& cage,
                     const TetCoordinates& coordinates) {
  const TetFinder finder(cage, coordinates);
  std::vector<std::pair<int, Weights4>> places(samples.size());
  parallel_for(int(samples.size()),
               [&](int s) { places[std::size_t(s)] = finder.find(samples[std::size_t(s)].position); });
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return places[a].first < places[b].first; });
  const Eigen::Index count = Eigen::Index(samples.size());
  SurfaceSamples result{Points(count, 3), Eigen::VectorXi(count), Weights(count, 4), Eigen::VectorXd(count)};
  for (Eigen::Index s = 0; s < count; ++s) {
    const std::size_t from = order[std::size_t(s)];
    result.positions_m.row(s) = samples[from].position;
    result.tet_from_sample[s] = places[from].first;
    result.weights.row(s) = places[from].second;
    result.area_m2[s] = samples[from].area_m2;
  }
  return result;
}

// Where the field should be 0, how far it is from that, and the area that this stands for.
FieldErrors errors_of(std::vector<std::pair<double, double>> error_and_area) {
  double area = 0, up_to = 0;
  std::sort(error_and_area.begin(), error_and_area.end());
  for (const auto& [error, share] : error_and_area) area += share;
  for (const auto& [error, share] : error_and_area)
    if ((up_to += share) >= 0.99 * area) return {error, error_and_area.back().first};
  return {};
}

FieldErrors errors(const DistanceField& field, const std::vector<detail::SurfaceSample>& samples) {
  std::vector<std::pair<double, double>> all;
  for (const auto& s : samples) all.emplace_back(std::abs(field.at(s.position)), s.area_m2);
  return errors_of(std::move(all));
}

// Lower bounds of the coordinates of a tet's points at which the field is not above zero, from the cells of
// the grid; cells at the surface are taken in eighths, and again those. Within a box, no trilinear function
// is below its least corner.
class LeastWeights {
 public:
  LeastWeights(const DistanceField& field, const TetCoordinates& coordinates, int tet)
      : field_(field), coordinates_(coordinates), tet_(tet), first_(coordinates.corner(tet, 3)) {
    const Box box = box_of(coordinates, tet);
    Eigen::Vector3i from, to;
    for (int axis = 0; axis < 3; ++axis) {
      const int last = field.nodes[std::size_t(axis)] - 2;
      const auto cell = [&](double x) {
        return int(std::clamp(std::floor((x - field.lower_m[axis]) / field.cell_m), 0.0, double(last)));
      };
      from[axis] = cell(box.lower[axis]), to[axis] = cell(box.upper[axis]);
    }
    for (int k = from[2]; k <= to[2]; ++k) {
      throw_if_stopped();
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i) {
          const std::size_t row = std::size_t(field.nodes[0]), slice = row * std::size_t(field.nodes[1]);
          const std::int16_t* at = field.values.data() + std::size_t(k) * slice + std::size_t(j) * row + i;
          visit(field.lower_m + field.cell_m * Vec3(i + 0.5, j + 0.5, k + 0.5), 0.5 * field.cell_m,
                {double(at[0]), double(at[1]), double(at[row]), double(at[row + 1]), double(at[slice]),
                 double(at[slice + 1]), double(at[slice + row]), double(at[slice + row + 1])},
                2);
        }
    }
  }
  Weights4 bound() const { return least_; }

 private:
  // A box by its middle and half its width, and the field at its corners, x fastest.
  void visit(const Vec3& middle, double half, const std::array<double, 8>& values, int cuts) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    if (*least > 0) return;
    const auto& gradients = coordinates_.gradients(tet_);
    Weights4 lower = (gradients * (middle - first_)).transpose();
    lower[3] += 1;
    const Weights4 reach = half * gradients.cwiseAbs().rowwise().sum().transpose();
    if ((lower + reach).minCoeff() < -1e-9) return;  // the box is beyond a face
    lower = (lower - reach).array() - 1e-9;
    if ((lower.array() >= least_.array()).all()) return;
    if (cuts == 0 || *most <= 0) {
      least_ = least_.cwiseMin(lower.cwiseMax(0.0));
      return;
    }
    // The field at the 27 points of the eighths.
    std::array<double, 27> fine;
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
          double sum = 0;
          for (int c = 0; c < 8; ++c)
            sum += values[std::size_t(c)] * ((c & 1) ? i : 2 - i) * ((c & 2) ? j : 2 - j) *
                   ((c & 4) ? k : 2 - k);
          fine[std::size_t(9 * k + 3 * j + i)] = sum / 8;
        }
    for (int part = 0; part < 8; ++part) {
      const int i = part & 1, j = part >> 1 & 1, k = part >> 2;
      std::array<double, 8> of_part;
      for (int c = 0; c < 8; ++c)
        of_part[std::size_t(c)] =
            fine[std::size_t(9 * (k + (c >> 2)) + 3 * (j + (c >> 1 & 1)) + i + (c & 1))];
      visit(middle + half * Vec3(i - 0.5, j - 0.5, k - 0.5), 0.5 * half, of_part, cuts - 1);
    }
  }

  const DistanceField& field_;
  const TetCoordinates& coordinates_;
  int tet_;
  Vec3 first_;
  Weights4 least_ = Weights4::Constant(2);
};

// A field that is nowhere inside, and nothing else.
ContactShape nothing(const Box& box, Eigen::Index tets) {
  ContactShape shape;
  shape.usable = false;
  shape.field = detail::grid_over(box, 2 * box.size().maxCoeff(), 1000);
  shape.field.unit_m = shape.field.cell_m / 32'000;
  shape.field.values.assign(std::size_t(shape.field.nodes[0]) * shape.field.nodes[1] * shape.field.nodes[2],
                            32'000);
  shape.samples = {Points(0, 3), Eigen::VectorXi(0), Weights(0, 4), Eigen::VectorXd(0)};
  shape.min_weight = Weights::Constant(tets, 4, 2);
  return shape;
}

}  // namespace

Weights min_weights(const DistanceField& field, const TetMesh& cage) {
  const TetCoordinates coordinates(cage);
  Weights least(cage.tets.rows(), 4);
  parallel_for(int(cage.tets.rows()),
               [&](int t) { least.row(t) = LeastWeights(field, coordinates, t).bound(); });
  return least;
}

FieldErrors field_errors(const ContactShape& shape) {
  std::vector<std::pair<double, double>> all;
  for (Eigen::Index s = 0; s < shape.samples.area_m2.size(); ++s)
    all.emplace_back(std::abs(shape.field.at(shape.samples.positions_m.row(s))), shape.samples.area_m2[s]);
  return errors_of(std::move(all));
}

ContactShape make_contact_shape(const SurfaceMesh& surface, const TetMesh& cage,
                                const ContactShapeSettings& settings, ContactShapeReport* report) {
  LIMBER_CHECK(settings.cells >= 8 && settings.cells <= settings.max_cells && settings.max_cells <= 1000,
               settings.cells, settings.max_cells);
  LIMBER_CHECK(settings.max_nodes >= 1000 && settings.max_samples >= settings.fewest_most_samples,
               settings.max_nodes, settings.max_samples);
  ContactShapeReport unread;
  ContactShapeReport& r = report ? *report : unread;
  r = {};
  const double start = cpu_seconds();
  const double size = bounding_box(surface.positions).size().maxCoeff();
  Box box = bounding_box(surface.positions);
  box.include(bounding_box(cage.positions));

  const auto give_up = [&](const std::string& why) {
    r.warnings.push_back(why);
    const ContactShape shape = nothing(box, cage.tets.rows());
    r.cpu_s = cpu_seconds() - start;
    return shape;
  };
  Progress progress("contact", 4);
  progress.update(0, "what is seen");
  const WindingNumber winding(surface.positions, surface.triangles);
  const double offset = detail::offset_share * size;
  const bool closed = is_closed(surface.triangles);
  const detail::SeenSurface seen = detail::seen_surface(surface, winding, closed, size / 32, offset);
  r.open_share = seen.open_share;
  const std::string no_inside =
      "the surface encloses nothing: contact goes by the cage, which is fatter; give the model a thickness, "
      "or close it";
  if (!(seen.area_m2 > 0)) return give_up(no_inside);

  ContactShape shape;
  std::vector<detail::SurfaceSample> samples;
  int cells = settings.cells;
  double filled = 0, thickness = 0;  // volume; of a plate of this volume and area
  while (true) {
    progress.update(samples.empty() ? 1 : 3, fmt::format("distances, {} cells", cells));
    shape.field = detail::grid_over(box, size / cells, settings.max_nodes);
    filled = detail::fill(seen, winding, closed, shape.field);
    thickness = 2 * filled / seen.area_m2;
    if (samples.empty()) {
      r.characteristic_m = std::min(size, 3 * thickness);
      if (!(filled > 0)) return give_up(no_inside);
      const double squares = seen.area_m2 / (r.characteristic_m * r.characteristic_m);
      const int most = int(std::clamp(settings.samples_a_square * squares,
                                      double(settings.fewest_most_samples), double(settings.max_samples)));
      progress.update(2, "samples");
      samples =
          detail::sample_surface(surface, seen, winding,
                                 {.missed_m = settings.missed_depth * r.characteristic_m,
                                  .min_m = settings.min_spacing * std::max(r.characteristic_m, size / 3),
                                  .max_m = settings.max_spacing * size,
                                  .max_flat_m = settings.max_flat_spacing * size,
                                  .offset_m = offset},
                                 most, int(settings.max_tips * most));
      if (samples.empty()) return give_up(no_inside);
    }
    const FieldErrors at_samples = errors(shape.field, samples);
    r.error_p99_m = at_samples.p99_m, r.error_max_m = at_samples.max_m;
    const double wanted = settings.field_error * r.characteristic_m;
    const bool thin = thickness < well_resolved_cells * shape.field.cell_m;
    const int most = thin ? max_cells_for_thin_walls : settings.max_cells;
    const bool wider_than_asked = shape.field.cell_m > 1.001 * size / cells;
    if ((r.error_p99_m <= wanted && !thin) || wider_than_asked || cells >= most) break;
    // The error goes with about the 1.4th power of the cell.
    const double by_error = cells * std::clamp(std::pow(r.error_p99_m / wanted, 0.7), 1.5, 3.0);
    const double by_thickness = 1.02 * well_resolved_cells * size / thickness;
    cells = std::min(
        most,
        int(std::max({1.1 * cells, thin ? by_thickness : 0, std::min(by_error, 1.0 * settings.max_cells)})));
  }
  if (const double own = volume(surface);
      closed &&
      own - filled > std::max(double_share_worth_a_word * own, 0.25 * seen.area_m2 * shape.field.cell_m))
    r.warnings.push_back(fmt::format(
        "solids of it overlap or lie in one another: its volume, {:.3g} m³, has {:.0f} % twice, "
        "and so has its mass; what it fills is {:.3g} m³; unite them, or leave out what lies within",
        own, 100 * (own - filled) / own, filled));
  r.cells = int(std::lround(size / shape.field.cell_m));
  r.nodes = std::int64_t(shape.field.values.size());
  r.memory_mb = double(shape.field.values.size() * sizeof(std::int16_t)) / 1e6;
  if (thickness < min_cells_thick * shape.field.cell_m)
    return give_up(fmt::format(
        "walls are {:.2g} m thick in the mean, less than {} cells of the finest field, which are {:.2g} m: "
        "contact goes by the cage, which is fatter; thicken the model",
        thickness, min_cells_thick, shape.field.cell_m));
  if (seen.open_share > open_share_too_large)
    return give_up(fmt::format(
        "for {:.0f} % of the surface it is a guess what is inside: contact goes by the cage, which "
        "is fatter; close the holes",
        100 * seen.open_share));
  if (seen.open_share > open_share_worth_a_word)
    r.warnings.push_back(fmt::format(
        "{:.0f} % of the surface is near holes, where it is a guess what is inside, and so is contact; "
        "close the holes",
        100 * seen.open_share));

  const TetCoordinates coordinates(cage);
  shape.samples = bound(samples, cage, coordinates);
  shape.min_weight = min_weights(shape.field, cage);
  const FieldErrors at_samples = field_errors(shape);
  r.error_p99_m = at_samples.p99_m, r.error_max_m = at_samples.max_m;
  r.cpu_s = cpu_seconds() - start;
  return shape;
}

}  // namespace limber::meshing
