#include "meshing/detail/growing_hull.h"

#include <immintrin.h>

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

// Blocks of 8 planes, rounded to float: the first, from `block` on, that has one which p is more than
// `distance` beyond, as floats see it; `count` when none has. So an answer is only where to look closer. Most
// points are in the hull, and are done with here.
[[gnu::target("avx2,fma")]] std::size_t find_block_avx2(const float* blocks, std::size_t block,
                                                        std::size_t count, const Vec3& p, float distance) {
  const __m256 x = _mm256_set1_ps(float(p.x())), y = _mm256_set1_ps(float(p.y())),
               z = _mm256_set1_ps(float(p.z())), least = _mm256_set1_ps(distance);
  for (; block < count; ++block) {
    const float* const at = blocks + 4 * lanes * block;
    const __m256 d = _mm256_fmadd_ps(_mm256_loadu_ps(at), x,
                                     _mm256_fmadd_ps(_mm256_loadu_ps(at + lanes), y,
                                                     _mm256_fmadd_ps(_mm256_loadu_ps(at + 2 * lanes), z,
                                                                     _mm256_loadu_ps(at + 3 * lanes))));
    if (_mm256_movemask_ps(_mm256_cmp_ps(d, least, _CMP_GT_OQ)) != 0) break;
  }
  return block;
}
std::size_t find_block_any(const float* blocks, std::size_t block, std::size_t count, const Vec3& p,
                           float distance) {
  const float x = float(p.x()), y = float(p.y()), z = float(p.z());
  for (; block < count; ++block) {
    const float* const at = blocks + 4 * lanes * block;
    bool any = false;
    for (std::size_t k = 0; k < lanes; ++k)
      any |= at[k] * x + at[lanes + k] * y + at[2 * lanes + k] * z + at[3 * lanes + k] > distance;
    if (any) break;
  }
  return block;
}
const auto find_block =
    __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? find_block_avx2 : find_block_any;

// Two doubles at once: + − × ÷ of each, with the bits of one alone.
using Two = __m128d;
struct TwoPlaces {
  Two x, y, z;
  TwoPlaces operator-(const TwoPlaces& o) const { return {x - o.x, y - o.y, z - o.z}; }
};
Two dot(const TwoPlaces& a, const TwoPlaces& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
TwoPlaces cross(const TwoPlaces& a, const TwoPlaces& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace

GrowingHull::GrowingHull(double tolerance)
    : tolerance_(std::max(tolerance, insert_distance)),
      jitter_(tolerance_ > insert_distance ? 1e-3 * tolerance_ : 0.0) {}

void GrowingHull::clear() {
  points_.clear(), waiting_.clear(), faces_.clear(), free_.clear();
  rough_.clear(), rim_from_vertex_.clear();
  volume_ = reach_ = 0;
  stamp_ = 0;
}

bool GrowingHull::visible(const Face& f, const Vec3& p, double d) const {
  if (std::abs(d) > f.noise) return d > 0;
  return orientation(points_[std::size_t(f.vertex[0])], points_[std::size_t(f.vertex[1])],
                     points_[std::size_t(f.vertex[2])], p) > 0;
}

void GrowingHull::keep_point(const Vec3& p) {
  points_.push_back(p);
  reach_ = std::max(reach_, p.lpNorm<1>());
}

void GrowingHull::new_faces(std::span<const int> corners, int apex) {
  const std::size_t count = corners.size() - 1;
  for (auto& column : columns_) column.resize(count + 2);
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (int c = 0; c < 3; ++c) columns_[c][i] = points_[std::size_t(corners[i])][c];
  for (int c = 0; c < 3; ++c) columns_[c][count + 1] = columns_[c][count];  // of an odd number the last
  made_.resize(count);
  for (int& f : made_) {
    if (!free_.empty()) {
      f = free_.back(), free_.pop_back();
      continue;
    }
    f = int(faces_.size());
    faces_.emplace_back();
    if (faces_.size() * 4 > rough_.size()) {
      rough_.resize(rough_.size() + 4 * lanes, 0.0f);
      std::fill(rough_.end() - lanes, rough_.end(), -1.0f);
    }
  }
  const Vec3& top = points_[std::size_t(apex)];
  const TwoPlaces c{_mm_set1_pd(top.x()), _mm_set1_pd(top.y()), _mm_set1_pd(top.z())};
  const Two zero = _mm_setzero_pd();
  for (std::size_t i = 0; i < count; i += 2) {
    const auto two_from = [&](std::size_t first) {
      return TwoPlaces{_mm_loadu_pd(&columns_[0][first]), _mm_loadu_pd(&columns_[1][first]),
                       _mm_loadu_pd(&columns_[2][first])};
    };
    const TwoPlaces a = two_from(i), b = two_from(i + 1), ab = b - a, ac = c - a, bc = c - b;
    const TwoPlaces across = cross(ab, ac);
    const Two twice_area = _mm_sqrt_pd(dot(across, across));
    const Two some = _mm_cmpgt_pd(twice_area, zero);
    const auto where_some = [&](Two value) { return _mm_and_pd(value, some); };
    const TwoPlaces normal{where_some(across.x / twice_area), where_some(across.y / twice_area),
                           where_some(across.z / twice_area)};
    const Two offset = -dot(normal, a);
    const Two longest = _mm_max_pd(_mm_max_pd(dot(ab, ab), dot(bc, bc)), dot(ac, ac));
    const Two noise =
        _mm_or_pd(where_some(2e-15 * (1 + longest / twice_area)), _mm_andnot_pd(some, _mm_set1_pd(1e300)));
    for (std::size_t k = 0; k < 2 && i + k < count; ++k) {
      const std::size_t f = std::size_t(made_[i + k]);
      float* const rough = &rough_[4 * lanes * (f / lanes) + f % lanes];
      rough[0] = float(normal.x[k]), rough[lanes] = float(normal.y[k]);
      rough[2 * lanes] = float(normal.z[k]), rough[3 * lanes] = float(offset[k]);
      faces_[f] = {{normal.x[k], normal.y[k], normal.z[k]},
                   offset[k],
                   twice_area[k],
                   noise[k],
                   {corners[i + k], corners[i + k + 1], apex},
                   {-1, -1, -1},
                   0};
    }
  }
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
  for (const Vec3& p : {a, b, c, d}) keep_point(p);
  if (signed_volume(a, b, c, d) > 0) std::swap(points_[1], points_[2]);  // abc seen from outside: d is behind
  rim_from_vertex_.assign(4, -1);
  for (const auto& [from, to, apex] : {std::array{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}})
    new_faces(std::array{from, to}, apex);
  faces_[0].neighbour = {1, 2, 3};
  faces_[1].neighbour = {3, 2, 0};
  faces_[2].neighbour = {1, 3, 0};
  faces_[3].neighbour = {2, 1, 0};
  volume_ = std::abs(signed_volume(a, b, c, d));
  return true;
}

template <class Accept>
int GrowingHull::first_beyond(int first, const Vec3& p, double least, const Accept& accept) const {
  // Of a number rounded to float, and of each product and sum, at most 2⁻²⁴ is lost.
  const double slack = 5e-7 * (p.lpNorm<1>() + reach_);
  const std::size_t blocks = rough_.size() / (4 * lanes), count = faces_.size();
  for (std::size_t f = std::size_t(first); f < count;) {
    const std::size_t block = find_block(rough_.data(), f / lanes, blocks, p, float(least - slack));
    f = std::max(f, block * lanes);
    for (const std::size_t end = std::min(count, (block + 1) * lanes); f < end; ++f) {
      const double d = faces_[f].distance(p);
      if (d > least && accept(faces_[f], d)) return int(f);
    }
  }
  return int(count);
}

bool GrowingHull::holds(const Vec3& p) const {
  return !flat() &&
         first_beyond(0, p, tolerance_, [](const Face&, double) { return true; }) == int(faces_.size());
}

void GrowingHull::insert(Vec3 p) {
  const int end = int(faces_.size());
  const auto first_seen = [&](int first, double least) {
    return first_beyond(first, p, least, [&](const Face& face, double d) { return visible(face, p, d); });
  };
  int seed = first_seen(0, tolerance_);
  if (seed >= end) return;
  // Points of a cut lie in one plane, where only exact arithmetic finds signs; a little to the side, rounding
  // does. The seed may have been a sliver, whose plane a step of any length can cross: the moved point must
  // see it.
  if (jitter_ > 0) {
    p += jitter_ * offcuts[points_.size() % offcuts.size()];
    seed = first_seen(seed, 0.5 * tolerance_);
    if (seed >= end) return;
  }

  // The faces seen from p, connected to the seed, and the sides that bound them.
  stamp_ += 2;
  Face* const faces = faces_.data();
  if (visible_.size() < faces_.size()) visible_.resize(faces_.size()), rim_.resize(3 * faces_.size());
  std::size_t seen = 1, sides = 0;
  visible_[0] = seed;
  faces[seed].mark = stamp_;
  double gained = 0;
  for (std::size_t i = 0; i < seen; ++i) {
    const Face& face = faces[visible_[i]];
    gained += face.distance(p) * face.twice_area / 6;
    for (std::size_t k = 0; k < 3; ++k) {
      Face& other = faces[face.neighbour[k]];
      if (other.mark < stamp_) {
        other.mark = stamp_ + (visible(other, p, other.distance(p)) ? 0 : 1);
        if (other.mark == stamp_) visible_[seen++] = face.neighbour[k];
      }
      if (other.mark == stamp_) continue;
      rim_from_vertex_[std::size_t(face.vertex[k])] = int(sides);
      rim_[sides++] = {face.vertex[k], face.vertex[(k + 1) % 3], face.neighbour[k]};
    }
  }
  // With exact signs the rim is one loop.
  volume_ += gained;
  const int apex = int(points_.size());
  keep_point(p);
  rim_from_vertex_.push_back(-1);
  loop_.clear(), beyond_.clear();
  int at = 0;
  do {
    const Rim& rim = rim_[std::size_t(at)];
    loop_.push_back(rim.from), beyond_.push_back(rim);
    at = rim_from_vertex_[std::size_t(rim.to)];
  } while (at != 0 && beyond_.size() <= sides);
  LIMBER_CHECK(beyond_.size() == sides, beyond_.size(), sides);
  loop_.push_back(rim_[0].from);
  for (std::size_t i = 0; i < seen; ++i) {
    const std::size_t f = std::size_t(visible_[i]);
    faces[f].vertex[0] = -1, faces[f].offset = -1;
    std::fill_n(faces[f].normal, 3, 0.0);
    float* const rough = &rough_[4 * lanes * (f / lanes) + f % lanes];
    rough[0] = rough[lanes] = rough[2 * lanes] = 0, rough[3 * lanes] = -1;
  }
  free_.insert(free_.end(), visible_.begin(), visible_.begin() + std::ptrdiff_t(seen));
  new_faces(loop_, apex);
  for (std::size_t i = 0; i < beyond_.size(); ++i) {
    const auto& [from, to, beyond] = beyond_[i];
    const int f = made_[i];
    faces_[std::size_t(f)].neighbour = {beyond, made_[i + 1 < made_.size() ? i + 1 : 0],
                                        made_[i > 0 ? i - 1 : made_.size() - 1]};
    Face& outer = faces_[std::size_t(beyond)];
    for (std::size_t k = 0; k < 3; ++k)
      if (outer.vertex[k] == to && outer.vertex[(k + 1) % 3] == from) outer.neighbour[k] = f;
  }
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
    if (faces_[f].twice_area > min_altitude * longest) {
      const auto& [x, y, z] = faces_[f].normal;
      planes.row(count++) << x, y, z, faces_[f].offset;
    }
  }
  return planes.topRows(count);
}

}  // namespace limber::meshing::detail
