#include "meshing/detail/enclosing_shell.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>

#include "core/error.h"
#include "meshing/convex_hull.h"
#include "meshing/detail/growing_hull.h"
#include "meshing/detail/orientation.h"
#include "meshing/detail/overshoot.h"

namespace limber::meshing::detail {

namespace {

constexpr double min_growth = 2e-6;
constexpr double float32_share = 1e-3;  // by which a shell may grow for the sake of float32

Points rows_of(std::span<const Vec3> points) {
  Points rows(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) rows.row(Eigen::Index(i)) = points[i].transpose();
  return rows;
}

Vec3 mean_of(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / double(points.size());
}

// How much a hull must grow about `center` to reach a point.
class Gauges {
 public:
  Gauges(const GrowingHull& hull, const Vec3& center) : center_(center) {
    const auto planes = hull.planes();
    const Eigen::ArrayXd depths = -(planes.leftCols<3>() * center + planes.col(3)).array();
    x_ = planes.col(0).array() / depths, y_ = planes.col(1).array() / depths;
    z_ = planes.col(2).array() / depths;
  }
  double at(const Vec3& p) const {
    const Vec3 d = p - center_;
    return (d.x() * x_ + d.y() * y_ + d.z() * z_).maxCoeff();
  }
  // The row of hull.planes() that the point is the farthest beyond.
  Eigen::Index plane_at(const Vec3& p) const {
    const Vec3 d = p - center_;
    Eigen::Index plane = 0;
    (d.x() * x_ + d.y() * y_ + d.z() * z_).maxCoeff(&plane);
    return plane;
  }

 private:
  Vec3 center_;
  Eigen::ArrayXd x_, y_, z_;  // normals over the center's depth
};

// The point found outside moves to the front: it is the likeliest next time.
bool holds_all(std::span<const Vec3> corners, const Vec3& center, std::vector<Vec3>& points) {
  GrowingHull hull;
  hull.add(corners);
  if (hull.flat() || !hull.holds(center)) return false;
  const Gauges gauges(hull, center);
  const auto outside =
      std::find_if(points.begin(), points.end(), [&](const Vec3& p) { return gauges.at(p) >= 1 + 1e-7; });
  if (outside == points.end()) return true;
  std::iter_swap(points.begin(), outside);
  return false;
}

// Up to six of the corners that span a volume as the whole does.
std::vector<Vec3> first_corners(const std::vector<Vec3>& corners) {
  const auto farthest = [&](auto&& measure) {
    return *std::max_element(corners.begin(), corners.end(),
                             [&](const Vec3& a, const Vec3& b) { return measure(a) < measure(b); });
  };
  const Vec3 a = farthest([&](const Vec3& p) { return (p - corners[0]).norm(); });
  const Vec3 b = farthest([&](const Vec3& p) { return (p - a).norm(); });
  const Vec3 c = farthest([&](const Vec3& p) { return (p - a).cross(b - a).norm(); });
  const Vec3 normal = (b - a).cross(c - a), across = normal.cross(b - a);
  return {a,
          b,
          farthest([&](const Vec3& p) { return normal.dot(p); }),
          farthest([&](const Vec3& p) { return -normal.dot(p); }),
          farthest([&](const Vec3& p) { return across.dot(p); }),
          farthest([&](const Vec3& p) { return -across.dot(p); })};
}

}  // namespace

std::vector<Vec3> fewer_corners(const std::vector<Vec3>& corners, int most) {
  if (int(corners.size()) <= most) return corners;

  // The corners that stand out most.
  GrowingHull hull;
  hull.add(first_corners(corners));
  std::vector<Vec3> chosen = hull.vertices();
  const Vec3 center = mean_of(chosen);
  std::priority_queue<std::pair<double, std::size_t>> by_growth;  // as it was when last asked: it only falls
  for (std::size_t i = 0; i < corners.size(); ++i) by_growth.push({1e300, i});
  while (int(chosen.size()) < most) {
    const Gauges gauges(hull, center);
    std::size_t next = corners.size();
    while (next == corners.size()) {
      const auto [old_growth, i] = by_growth.top();
      by_growth.pop();
      const double growth = gauges.at(corners[i]);
      if (growth >= by_growth.top().first) next = i;
      by_growth.push({growth, i});
    }
    if (by_growth.top().first <= 1 + 1e-6) break;
    chosen.push_back(corners[next]);
    hull.add(corners[next]);
  }
  chosen = hull.vertices();

  // Raise the corners round each point that is still outside, then lower each as far as nothing comes out.
  std::vector<Vec3> to_hold = corners;
  std::vector<double> raised(chosen.size(), 1.0);
  const auto placed = [&] {
    std::vector<Vec3> result;
    for (std::size_t i = 0; i < chosen.size(); ++i)
      result.push_back(center + raised[i] * (chosen[i] - center));
    return result;
  };
  const Gauges gauges(hull, center);
  const auto planes = hull.planes();
  for (const Vec3& p : corners) {
    const double growth = gauges.at(p);
    if (growth <= 1) continue;
    const Eigen::Index plane = gauges.plane_at(p);
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (std::abs(planes.row(plane).leftCols<3>().dot(chosen[i]) + planes(plane, 3)) < 1e-9)
        raised[i] = std::max(raised[i], growth);
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const double high = raised[i];
    if (high == 1.0) continue;
    double low = 1.0, good = high;
    for (int step = 0; step < 5; ++step) {
      raised[i] = step == 0 ? low : 0.5 * (low + good);
      (holds_all(placed(), center, to_hold) ? good : low) = raised[i];
      if (good == 1.0) break;
    }
    raised[i] = good;
  }
  std::vector<Vec3> result = placed();
  hull.clear();
  hull.add(result);
  const Gauges last(hull, center);
  double growth = 1;
  for (const Vec3& p : corners) growth = std::max(growth, last.at(p));
  for (Vec3& p : result) p = center + growth * (p - center);
  return result;
}

std::vector<Vec3> bevelled(const std::vector<Vec3>& corners, double distance) {
  // The 48 corners of the polytope: where x = 1, x + y = √2 and x + y + z = √3, in every order and with every
  // sign.
  std::array<double, 3> corner = {1.0, std::sqrt(2.0) - 1.0, std::sqrt(3.0) - std::sqrt(2.0)};
  std::sort(corner.begin(), corner.end());
  std::vector<Vec3> points;
  do {
    for (int signs = 0; signs < 8; ++signs) {
      const Vec3 d(signs & 1 ? corner[0] : -corner[0], signs & 2 ? corner[1] : -corner[1],
                   signs & 4 ? corner[2] : -corner[2]);
      for (const Vec3& p : corners) points.push_back(p + distance * d);
    }
  } while (std::next_permutation(corner.begin(), corner.end()));
  return points;
}

std::vector<Vec3> thickened(const std::vector<Vec3>& points, double distance) {
  const Vec3 middle = mean_of(points);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) spread += (p - middle) * (p - middle).transpose();
  const Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
  std::vector<Vec3> thick = points;
  for (int k = 0; k < 3; ++k) {
    double reach = 0;
    for (const Vec3& p : points) reach = std::max(reach, std::abs(axes.col(k).dot(p - middle)));
    if (reach >= distance) continue;
    const std::vector<Vec3> thin = thick;
    thick.clear();
    for (const Vec3& p : thin)
      thick.push_back(p + distance * axes.col(k)), thick.push_back(p - distance * axes.col(k));
  }
  return thick;
}

bool encloses(const ConvexShell& shell, const Vec3& point) {
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f)
    if (orientation(shell.vertices.row(shell.triangles(f, 0)), shell.vertices.row(shell.triangles(f, 1)),
                    shell.vertices.row(shell.triangles(f, 2)), point) > 0)
      return false;
  return true;
}

namespace {

// The next number that a float32 holds, away from the middle.
double outwards_in_float32(double value, double middle) {
  const auto nearest = float(value);
  const bool inwards = value > middle ? double(nearest) < value : double(nearest) > value;
  return inwards ? std::nextafter(nearest, value > middle ? INFINITY : -INFINITY) : nearest;
}

// Nothing where steps between float32 numbers are too wide for a shell of that size.
std::vector<Vec3> outwards_in_float32(const std::vector<Vec3>& corners, const Vec3& center) {
  double largest = 0, reach = 0;
  for (const Vec3& p : corners) {
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
    reach = std::max(reach, (p - center).norm());
  }
  if (!(largest * std::numeric_limits<float>::epsilon() < float32_share * reach) || largest > 1e30) return {};
  std::vector<Vec3> rounded = corners;
  for (Vec3& p : rounded)
    for (int k = 0; k < 3; ++k) p[k] = outwards_in_float32(p[k], center[k]);
  return rounded;
}

std::optional<ConvexShell> shell_round(const std::vector<Vec3>& corners, std::span<const Vec3> points,
                                       double margin) {
  ConvexShell shell = convex_hull(rows_of(corners));
  const auto planes = planes_of(shell);
  for (const Vec3& p : points)
    if ((planes.leftCols<3>() * p + planes.col(3)).maxCoeff() > -margin || !encloses(shell, p))
      return std::nullopt;
  return shell;
}

}  // namespace

ConvexShell enclosing_shell(std::span<const Vec3> corners, std::span<const Vec3> points, double margin) {
  const Vec3 center = mean_of(corners);
  const auto grown = [&](double growth) {
    std::vector<Vec3> result;
    for (const Vec3& p : corners) result.push_back(center + (1 + growth) * (p - center));
    return result;
  };
  for (double growth = min_growth; growth < float32_share; growth *= 2)
    if (const std::vector<Vec3> rounded = outwards_in_float32(grown(growth), center); !rounded.empty())
      if (std::optional<ConvexShell> shell = shell_round(rounded, points, margin)) return *std::move(shell);
  for (double growth = min_growth; growth < 1; growth *= 2)
    if (std::optional<ConvexShell> shell = shell_round(grown(growth), points, margin))
      return *std::move(shell);
  throw InternalError("a shell does not hold its points even at twice its size");
}

}  // namespace limber::meshing::detail
