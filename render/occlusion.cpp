#include "render/occlusion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"

namespace limber::render {

namespace {

constexpr int axis_count = 32;       // each is looked along both ways
constexpr double off_surface = 1.5;  // cells; √2 is just enough for a plane never to hide its own points

// Evenly over the half sphere: a spiral whose turns are a golden angle apart.
Vec3 axis(int i) {
  const double z = (i + 0.5) / axis_count, r = std::sqrt(1 - z * z);
  const double turn = i * std::numbers::pi * (3 - std::sqrt(5));
  return {r * std::cos(turn), r * std::sin(turn), z};
}

// How far along an axis the first and the last surface lie, cell by cell.
class DepthMap {
 public:
  // cells: along the longer side.
  DepthMap(const Vec3& along, const Box& box, int cells) {
    const Vec3 x = along.unitOrthogonal(), y = along.cross(x);
    // The half sizes of the box as the axis sees it.
    const Vec3 half = 0.5 * box.size();
    const double width = x.cwiseAbs().dot(half), height = y.cwiseAbs().dot(half);
    cell_m_ = std::max(2 * std::max(width, height) / (cells - 4), 1e-12);
    place_ << x.transpose() / cell_m_, y.transpose() / cell_m_, along.transpose();
    columns_ = int(2 * width / cell_m_) + 5, rows_ = int(2 * height / cell_m_) + 5;
    origin_ = Vec3(-0.5 * columns_, -0.5 * rows_, 0) + place_ * box.center();
    origin_.z() = 0;
    first_.assign(std::size_t(columns_) * rows_, std::numeric_limits<float>::max());
    last_.assign(first_.size(), std::numeric_limits<float>::lowest());
  }

  double cell_m() const { return cell_m_; }
  Vec3f place(const Vec3& p) const { return (place_ * p - origin_).cast<float>(); }

  void mark(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const int left = int(std::ceil(std::min({a.x(), b.x(), c.x()}) - 0.5f)),
              right = int(std::floor(std::max({a.x(), b.x(), c.x()}) - 0.5f));
    const int low = int(std::ceil(std::min({a.y(), b.y(), c.y()}) - 0.5f)),
              high = int(std::floor(std::max({a.y(), b.y(), c.y()}) - 0.5f));
    if (left > right || low > high) return;
    const Vec3f ab = b - a, ac = c - a;
    const float area = ab.x() * ac.y() - ab.y() * ac.x();
    if (area == 0) return;
    const float scale = 1 / area, slack = -1e-5f;
    for (int row = low; row <= high; ++row)
      for (int column = left; column <= right; ++column) {
        const float x = float(column) + 0.5f - a.x(), y = float(row) + 0.5f - a.y();
        const float s = (x * ac.y() - y * ac.x()) * scale, t = (ab.x() * y - ab.y() * x) * scale;
        if (s < slack || t < slack || s + t > 1 - slack) continue;
        const float depth = a.z() + s * ab.z() + t * ac.z();
        const std::size_t cell = std::size_t(row) * columns_ + column;
        first_[cell] = std::min(first_[cell], depth), last_[cell] = std::max(last_[cell], depth);
      }
  }

  // The share of the four cells round a place that hide what lies ahead of it along the axis, or behind it.
  float hidden(const Vec3f& at, bool ahead) const {
    const float x = at.x() - 0.5f, y = at.y() - 0.5f;
    const int column = int(std::floor(x)), row = int(std::floor(y));
    if (column < 0 || row < 0 || column + 1 >= columns_ || row + 1 >= rows_) return 0;
    const float u = x - float(column), v = y - float(row);
    const std::size_t cell = std::size_t(row) * columns_ + column;
    const auto hides = [&](std::size_t c) { return ahead ? last_[c] > at.z() : first_[c] < at.z(); };
    return (1 - v) * ((1 - u) * hides(cell) + u * hides(cell + 1)) +
           v * ((1 - u) * hides(cell + columns_) + u * hides(cell + columns_ + 1));
  }

 private:
  Eigen::Matrix3d place_;
  Vec3 origin_;
  double cell_m_;
  int columns_, rows_;
  std::vector<float> first_, last_;
};

}  // namespace

Eigen::VectorXd sky_occlusion(const Points& points, const Points& normals,
                              std::span<const Occluder> occluders, const std::optional<Ground>& ground,
                              int cells) {
  LIMBER_CHECK(points.rows() == normals.rows(), points.rows(), normals.rows());
  LIMBER_CHECK(points.allFinite() && normals.allFinite(), points.rows());
  Box box;
  for (const Occluder& occluder : occluders) {
    LIMBER_CHECK(occluder.positions.allFinite(), occluder.positions.rows());
    box.include(bounding_box(occluder.positions));
  }
  if (box.empty()) box.include(Vec3::Zero().eval());
  const Vec3 up = ground ? ground->up.normalized() : Vec3::UnitZ();
  const double floor = ground ? ground->height_m : -std::numeric_limits<double>::infinity();

  Eigen::VectorXd hidden = Eigen::VectorXd::Zero(points.rows()), all = hidden;
  std::vector<Vec3f> placed;
  for (int i = 0; i < axis_count; ++i) {
    const Vec3 along = axis(i);
    DepthMap map(along, box, cells);
    for (const Occluder& occluder : occluders) {
      placed.resize(std::size_t(occluder.positions.rows()));
      for (Eigen::Index v = 0; v < occluder.positions.rows(); ++v)
        placed[std::size_t(v)] = map.place(occluder.positions.row(v));
      for (Eigen::Index t = 0; t < occluder.triangles.rows(); ++t) {
        const auto corner = [&](int k) -> const Vec3f& {
          return placed[std::size_t(occluder.triangles(t, k))];
        };
        map.mark(corner(0), corner(1), corner(2));
      }
    }
    for (Eigen::Index p = 0; p < points.rows(); ++p) {
      const Vec3 point = points.row(p), normal = normals.row(p);
      const double cosine = normal.dot(along), weight = std::abs(cosine);
      const bool ahead = cosine > 0;
      const bool into_ground = ground && (ahead ? 1 : -1) * along.dot(up) < 0;
      const double share = into_ground || point.dot(up) < floor
                               ? 1.0
                               : map.hidden(map.place(point + off_surface * map.cell_m() * normal), ahead);
      hidden[p] += weight * share, all[p] += weight;
    }
  }
  return (all.array() > 0).select(hidden.array() / all.array(), 0.0);
}

}  // namespace limber::render
