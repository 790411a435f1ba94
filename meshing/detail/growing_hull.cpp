#include "meshing/detail/growing_hull.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "meshing/detail/orientation.h"

namespace limber::meshing::detail {

namespace {

const std::vector<Vec3> offcuts = [] {
  std::vector<Vec3> directions;
  Rng rng(1, 1);
  for (int i = 0; i < 61; ++i) directions.push_back(rng.direction());
  return directions;
}();

constexpr std::size_t lanes = 8;

// The first block of 8 planes that has one which p is more than `tolerance` beyond; `count` when none has.
// Most of the search's time is spent here. Without contraction wider registers give the same bits.
[[gnu::always_inline]] inline std::size_t find_beyond(const double* nx, const double* ny, const double* nz,
                                                      const double* offset, std::size_t count, const Vec3& p,
                                                      double tolerance) {
  const double x = p.x(), y = p.y(), z = p.z();
  for (std::size_t block = 0; block < count; block += lanes) {
    double d[lanes];
    for (std::size_t k = 0; k < lanes; ++k)
      d[k] = nx[block + k] * x + ny[block + k] * y + nz[block + k] * z + offset[block + k];
    for (std::size_t half = lanes / 2; half > 0; half /= 2)
      for (std::size_t k = 0; k < half; ++k) d[k] = d[k] > d[k + half] ? d[k] : d[k + half];
    if (d[0] > tolerance) return block;
  }
  return count;
}
[[gnu::target("avx2")]] std::size_t find_beyond_avx2(const double* nx, const double* ny, const double* nz,
                                                     const double* offset, std::size_t count, const Vec3& p,
                                                     double tolerance) {
  return find_beyond(nx, ny, nz, offset, count, p, tolerance);
}
std::size_t find_beyond_any(const double* nx, const double* ny, const double* nz, const double* offset,
                            std::size_t count, const Vec3& p, double tolerance) {
  return find_beyond(nx, ny, nz, offset, count, p, tolerance);
}
const auto find_beyond_here = __builtin_cpu_supports("avx2") ? find_beyond_avx2 : find_beyond_any;

}  // namespace

GrowingHull::GrowingHull(double tolerance)
    : tolerance_(std::max(tolerance, insert_distance)),
      jitter_(tolerance_ > insert_distance ? 1e-3 * tolerance_ : 0.0) {}

void GrowingHull::clear() {
  points_.clear(), waiting_.clear(), faces_.clear(), free_.clear();
  nx_.clear(), ny_.clear(), nz_.clear(), offset_.clear();
  rim_from_vertex_.clear(), mark_.clear();
  volume_ = 0;
  stamp_ = 0;
}

double GrowingHull::distance(int face, const Vec3& p) const {
  const std::size_t f = std::size_t(face);
  return nx_[f] * p.x() + ny_[f] * p.y() + nz_[f] * p.z() + offset_[f];
}

bool GrowingHull::visible(int face, const Vec3& p) const {
  const Face& f = faces_[std::size_t(face)];
  const double d = distance(face, p);
  if (std::abs(d) > f.noise) return d > 0;
  return orientation(points_[std::size_t(f.vertex[0])], points_[std::size_t(f.vertex[1])],
                     points_[std::size_t(f.vertex[2])], p) > 0;
}

int GrowingHull::new_face(int a, int b, int c) {
  std::size_t f = faces_.size();
  if (free_.empty()) {
    faces_.emplace_back();
    mark_.push_back(0);
    if (f == nx_.size()) {
      for (auto* row : {&nx_, &ny_, &nz_}) row->resize(f + lanes, 0.0);
      offset_.resize(f + lanes, -1.0);
    }
  } else {
    f = std::size_t(free_.back());
    free_.pop_back();
  }
  const Vec3 &pa = points_[std::size_t(a)], &pb = points_[std::size_t(b)], &pc = points_[std::size_t(c)];
  const Vec3 cross = (pb - pa).cross(pc - pa);
  const double twice_area = cross.norm();
  const Vec3 normal = twice_area > 0 ? Vec3(cross / twice_area) : Vec3::Zero();
  nx_[f] = normal.x(), ny_[f] = normal.y(), nz_[f] = normal.z(), offset_[f] = -normal.dot(pa);
  const double longest =
      std::max({(pb - pa).squaredNorm(), (pc - pb).squaredNorm(), (pa - pc).squaredNorm()});
  faces_[f] = {
      {a, b, c}, {-1, -1, -1}, twice_area, twice_area > 0 ? 2e-15 * (1 + longest / twice_area) : 1e300};
  return int(f);
}

void GrowingHull::add(std::span<const Vec3> points) {
  if (!flat()) {
    for (const Vec3& p : points) insert(p);
    return;
  }
  waiting_.insert(waiting_.end(), points.begin(), points.end());
  if (!start()) return;
  for (const Vec3& p : waiting_) insert(p);
}

bool GrowingHull::start() {
  const auto farthest = [&](auto&& measure) {
    std::size_t best = 0;
    double best_value = -1;
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
      const double value = measure(waiting_[i]);
      if (value > best_value) best = i, best_value = value;
    }
    return std::pair(waiting_[best], best_value);
  };
  if (waiting_.size() < 4) return false;
  const Vec3 a = farthest([&](const Vec3& p) { return (p - waiting_[0]).norm(); }).first;
  const auto [b, length] = farthest([&](const Vec3& p) { return (p - a).norm(); });
  if (length < flat_distance) return false;
  const Vec3 along = (b - a) / length;
  const auto [c, width] = farthest([&](const Vec3& p) { return (p - a).cross(along).norm(); });
  if (width < flat_distance) return false;
  const Vec3 normal = along.cross(c - a).normalized();
  const auto [d, thickness] = farthest([&](const Vec3& p) { return std::abs((p - a).dot(normal)); });
  if (thickness < flat_distance) return false;
  points_ = {a, b, c, d};
  if (signed_volume(a, b, c, d) > 0) std::swap(points_[1], points_[2]);  // abc seen from outside: d is behind
  rim_from_vertex_.assign(4, -1);
  new_face(0, 1, 2), new_face(0, 3, 1), new_face(1, 3, 2), new_face(2, 3, 0);
  faces_[0].neighbour = {1, 2, 3};
  faces_[1].neighbour = {3, 2, 0};
  faces_[2].neighbour = {1, 3, 0};
  faces_[3].neighbour = {2, 1, 0};
  volume_ = std::abs(signed_volume(a, b, c, d));
  return true;
}

std::size_t GrowingHull::block_beyond(const Vec3& p) const {
  return find_beyond_here(nx_.data(), ny_.data(), nz_.data(), offset_.data(), nx_.size(), p, tolerance_);
}

bool GrowingHull::holds(const Vec3& p) const { return !flat() && block_beyond(p) == nx_.size(); }

void GrowingHull::insert(Vec3 p) {
  int seed = int(block_beyond(p));
  const int end = int(faces_.size());
  while (seed < end && (distance(seed, p) <= tolerance_ || !visible(seed, p))) ++seed;
  if (seed >= end) return;
  // Points of a cut lie in one plane, where only exact arithmetic finds signs; a little to the side, rounding
  // does. The seed may have been a sliver, whose plane a step of any length can cross: the moved point must
  // see it.
  if (jitter_ > 0) {
    p += jitter_ * offcuts[points_.size() % offcuts.size()];
    while (seed < end && (distance(seed, p) <= 0.5 * tolerance_ || !visible(seed, p))) ++seed;
    if (seed >= end) return;
  }

  // The faces seen from p, connected to the seed, and the sides that bound them.
  ++stamp_;
  visible_.assign(1, seed);
  mark_[std::size_t(seed)] = stamp_;
  rim_face_.clear(), rim_side_.clear();
  double gained = 0;
  for (std::size_t i = 0; i < visible_.size(); ++i) {
    const Face& face = faces_[std::size_t(visible_[i])];
    gained += distance(visible_[i], p) * face.twice_area / 6;
    for (int k = 0; k < 3; ++k) {
      const int other = face.neighbour[std::size_t(k)];
      if (mark_[std::size_t(other)] == stamp_) continue;
      if (visible(other, p)) {
        mark_[std::size_t(other)] = stamp_;
        visible_.push_back(other);
      } else {
        rim_face_.push_back(visible_[i]), rim_side_.push_back(k);
      }
    }
  }
  // With exact signs the rim is one loop.
  for (std::size_t i = 0; i < rim_face_.size(); ++i)
    rim_from_vertex_[std::size_t(faces_[std::size_t(rim_face_[i])].vertex[std::size_t(rim_side_[i])])] =
        int(i);
  const auto end_of = [&](int rim) {
    return faces_[std::size_t(rim_face_[std::size_t(rim)])]
        .vertex[std::size_t((rim_side_[std::size_t(rim)] + 1) % 3)];
  };

  volume_ += gained;
  const int apex = int(points_.size());
  points_.push_back(p);
  rim_from_vertex_.push_back(-1);
  rim_.clear();
  for (int rim = 0;;) {
    const Face& face = faces_[std::size_t(rim_face_[std::size_t(rim)])];
    const std::size_t side = std::size_t(rim_side_[std::size_t(rim)]);
    rim_.push_back({face.vertex[side], end_of(rim), face.neighbour[side]});
    rim = rim_from_vertex_[std::size_t(end_of(rim))];
    if (rim == 0 || rim_.size() > rim_face_.size()) break;
  }
  LIMBER_CHECK(rim_.size() == rim_face_.size(), rim_.size(), rim_face_.size());
  for (int f : visible_) {
    faces_[std::size_t(f)].vertex[0] = -1;
    nx_[std::size_t(f)] = ny_[std::size_t(f)] = nz_[std::size_t(f)] = 0;
    offset_[std::size_t(f)] = -1;
    free_.push_back(f);
  }
  int first = -1, previous = -1;
  for (const auto& [from, to, beyond] : rim_) {
    const int f = new_face(from, to, apex);
    faces_[std::size_t(f)].neighbour[0] = beyond;
    Face& outer = faces_[std::size_t(beyond)];
    for (std::size_t k = 0; k < 3; ++k)
      if (outer.vertex[k] == to && outer.vertex[(k + 1) % 3] == from) outer.neighbour[k] = f;
    if (previous >= 0) {
      faces_[std::size_t(previous)].neighbour[1] = f;
      faces_[std::size_t(f)].neighbour[2] = previous;
    } else {
      first = f;
    }
    previous = f;
  }
  faces_[std::size_t(previous)].neighbour[1] = first;
  faces_[std::size_t(first)].neighbour[2] = previous;
}

std::vector<Vec3> GrowingHull::vertices() const {
  if (flat()) return waiting_;
  std::vector<char> used(points_.size(), 0);
  for (const Face& face : faces_)
    if (face.vertex[0] >= 0)
      for (int v : face.vertex) used[std::size_t(v)] = 1;
  std::vector<Vec3> vertices;
  for (std::size_t v = 0; v < points_.size(); ++v)
    if (used[v]) vertices.push_back(points_[v]);
  return vertices;
}

Eigen::Matrix<double, Eigen::Dynamic, 4> GrowingHull::planes() const {
  constexpr double min_altitude = 1e-9;
  Eigen::Matrix<double, Eigen::Dynamic, 4> planes(Eigen::Index(faces_.size()), 4);
  Eigen::Index count = 0;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const auto& [a, b, c] = faces_[f].vertex;
    if (a < 0) continue;
    const Vec3 &pa = points_[std::size_t(a)], &pb = points_[std::size_t(b)], &pc = points_[std::size_t(c)];
    const double longest = std::max({(pb - pa).norm(), (pc - pb).norm(), (pa - pc).norm()});
    if (faces_[f].twice_area > min_altitude * longest)
      planes.row(count++) << nx_[f], ny_[f], nz_[f], offset_[f];
  }
  return planes.topRows(count);
}

}  // namespace limber::meshing::detail
