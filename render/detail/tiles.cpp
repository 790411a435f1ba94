#include "render/detail/tiles.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "render/detail/line_quads.h"

namespace limber::render::detail {

namespace {

constexpr int at_once = 16;
using Ints = std::int32_t __attribute__((vector_size(4 * at_once), may_alias));
using Floats = float __attribute__((vector_size(4 * at_once), may_alias));
constexpr Ints ascending{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
// Of a pixel's samples, those of its lower row and of its upper one (Covered).
constexpr Ints bits_of_row[2] = {{1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2},
                                 {4, 8, 4, 8, 4, 8, 4, 8, 4, 8, 4, 8, 4, 8, 4, 8}};

constexpr int parts = 256;       // of a sample, in which corners are given
constexpr int widest = 1 << 15;  // samples that a triangle reaches: more, and edges would not fit 32 bits
constexpr std::int32_t most =
    1 << 30;  // of an edge's function: a tile's steps, of up to 2^30, neither turn its sign nor overflow

// First and last sample whose middle lies in [low, high], given in parts.
int first_in(std::int32_t low) { return (low - parts / 2 + parts - 1) >> 8; }
int last_in(std::int32_t high) { return (high - parts / 2) >> 8; }

// The samples of a pixel at which transparent surfaces are looked for lie a quarter of a sample aside, the
// lower two to the right and the upper two to the left, the left two down and the right two up: in four
// columns and four rows, so that edges along either are as smooth as others (a rotated grid).
constexpr int quarter = parts / 4;
constexpr Ints odd{0, -1, 0, -1, 0, -1, 0, -1, 0, -1, 0, -1, 0, -1, 0, -1};

// e(x, y) ≥ 0 on the inner side of an edge, and on it where it is a top or a left one; for the sample (x, y)
// of a tile e = at + x dx + y dy. Exact: e is a whole number of parts², and of samples' middles only
// multiples of `parts` differ.
struct Edge {
  Ints at[2];  // of even and of odd rows
  std::int32_t dx, dy;
};
template <bool turned>
[[gnu::always_inline]] inline Edge edge_of(const ScreenTriangle& t, int from, int to, int x0, int y0) {
  const std::int64_t dx = t.x[std::size_t(to)] - t.x[std::size_t(from)],
                     dy = t.y[std::size_t(to)] - t.y[std::size_t(from)];
  const std::int64_t px = std::int64_t(x0) * parts + parts / 2 - t.x[std::size_t(from)],
                     py = std::int64_t(y0) * parts + parts / 2 - t.y[std::size_t(from)];
  // Corners go counterclockwise, y is upward: left edges go down, top ones to the left.
  const bool closed = dy < 0 || (dy == 0 && dx < 0);
  const std::int64_t e = dx * py - dy * px - (closed ? 0 : 1);
  const auto at = [&](std::int64_t aside) __attribute__((always_inline)) {
    return Ints{} + std::int32_t(std::clamp<std::int64_t>((e + aside) >> 8, -most, most));
  };
  Edge edge{{}, std::int32_t(-dy), std::int32_t(dx)};
  if constexpr (turned)
    for (int up = 0; up < 2; ++up) {
      const std::int64_t along = (up ? dy : -dy) * quarter, across = dx * quarter;
      edge.at[up] = odd ? at(along + across) : at(along - across);
    }
  else
    edge.at[0] = edge.at[1] = at(0);
  return edge;
}

}  // namespace

Tiles::Tiles(int columns, int rows, Of of)
    : columns_(columns), rows_(rows), aside_(of == Of::transparent ? quarter : 0) {}

void Tiles::add(const std::vector<float>& positions, const std::vector<std::uint32_t>& corners,
                const Mat4& clip_from_world, bool fronts_alone, double stand_back,
                std::span<const Eigen::Vector4d> planes) {
  const std::size_t vertices = positions.size() / 3;
  const Eigen::Matrix4f to_clip = clip_from_world.cast<float>();
  std::vector<Eigen::Vector4f> clip(vertices);
  std::vector<float> above;
  above.reserve(vertices * planes.size());
  for (std::size_t v = 0; v < vertices; ++v) {
    const Eigen::Vector4f place(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2], 1);
    clip[v] = to_clip * place;
    for (const Eigen::Vector4d& plane : planes) above.push_back(float(plane.dot(place.cast<double>())));
  }
  add_clipped(clip, corners, above, true, fronts_alone, stand_back);
}

// The distance from a line's middle is linear in the picture, and not in clip space: there it is that times
// w.
void Tiles::add_lines(std::span<const float> line_corners) {
  const std::size_t count = line_corners.size() / line_corner_floats;
  std::vector<Eigen::Vector4f> clip(count);
  std::vector<float> across(count);
  std::vector<std::uint32_t> corners(count);
  for (std::size_t c = 0; c < count; ++c) {
    const float* from = &line_corners[c * line_corner_floats];
    clip[c] = Eigen::Vector4f(from[0], from[1], from[2], from[3]);
    across[c] = from[4] * from[3];
    corners[c] = std::uint32_t(c);
  }
  add_clipped(clip, corners, across, false, false, 0);
}

float Tiles::across(const ScreenTriangle& t, int x, int y) const {
  const Slope& slope = slopes_[t.first_slope];
  return slope.f + float(x) * slope.dx + float(y) * slope.dy;
}

namespace {

// Distance, in clip space, from the near plane, and from the sides of a field `wide` times as wide as the
// picture: 0 or more within all five.
constexpr int sides = 5;
float above_side(const Eigen::Vector4f& p, int side, float wide) {
  switch (side) {
    case 0:
      return p.z() + p.w();
    case 1:
      return wide * p.w() + p.x();
    case 2:
      return wide * p.w() - p.x();
    case 3:
      return wide * p.w() + p.y();
    default:
      return wide * p.w() - p.y();
  }
}

}  // namespace

// Of a triangle that reaches before the near plane, or far out of the picture, what is left is drawn as a
// fan. Where an edge is cut is found from the same end whichever triangle asks, so that two that share it
// still do.
void Tiles::add_clipped(std::span<const Eigen::Vector4f> clip, std::span<const std::uint32_t> corners,
                        std::span<const float> numbers, bool cut_below_zero, bool fronts_alone,
                        double stand_back) {
  const std::size_t each = clip.empty() ? 0 : numbers.size() / clip.size();
  const float wide = std::min(4.0f, float(widest) / float(std::max(columns_, rows_)));
  const auto vertex_of = [&](const Eigen::Vector4f& p, const float* of, float* divided) {
    for (std::size_t k = 0; k < each; ++k) divided[k] = of[k] / p.w();
    return Vertex{std::int32_t(std::lround((0.5f + 0.5f * p.x() / p.w()) * float(columns_) * parts)),
                  std::int32_t(std::lround((0.5f + 0.5f * p.y() / p.w()) * float(rows_) * parts)),
                  0.5f + 0.5f * p.z() / p.w(), divided, true};
  };
  std::vector<Vertex> placed(clip.size());
  std::vector<float> divided(numbers.size());
  for (std::size_t v = 0; v < clip.size(); ++v) {
    const Eigen::Vector4f& p = clip[v];
    if (p.w() > 0 && p.z() >= -p.w() && std::abs(p.x()) <= wide * p.w() && std::abs(p.y()) <= wide * p.w())
      placed[v] = vertex_of(p, numbers.data() + v * each, divided.data() + v * each);
  }
  // Of a corner, its place and its numbers.
  std::vector<Eigen::VectorXf> polygon, left;
  for (std::size_t c = 0; c < corners.size(); c += 3) {
    Part part{std::uint32_t(c / 3), false, each, cut_below_zero, fronts_alone, stand_back};
    const std::uint32_t* const of = &corners[c];
    const std::array<const Vertex*, 3> v{&placed[of[0]], &placed[of[1]], &placed[of[2]]};
    if (v[0]->is_placed && v[1]->is_placed && v[2]->is_placed) {
      add_triangle(v, part);
      continue;
    }
    bool gone = false;  // all of it beyond one side, as most of what is behind the eye is
    for (int side = 0; side < sides && !gone; ++side)
      gone = above_side(clip[of[0]], side, wide) < 0 && above_side(clip[of[1]], side, wide) < 0 &&
             above_side(clip[of[2]], side, wide) < 0;
    if (gone) continue;
    polygon.clear();
    for (int i = 0; i < 3; ++i) {
      Eigen::VectorXf corner(4 + Eigen::Index(each));
      corner.head<4>() = clip[of[i]];
      std::copy_n(numbers.data() + of[i] * each, each, corner.data() + 4);
      polygon.push_back(corner);
    }
    for (int side = 0; side < sides; ++side) {
      left.clear();
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Eigen::VectorXf &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const float at_a = above_side(a.head<4>(), side, wide), at_b = above_side(b.head<4>(), side, wide);
        if (at_a >= 0) left.push_back(a);
        if ((at_a >= 0) == (at_b >= 0)) continue;
        left.push_back(at_a >= 0 ? a + at_a / (at_a - at_b) * (b - a) : b + at_b / (at_b - at_a) * (a - b));
      }
      polygon.swap(left);
    }
    part.clipped = true;
    std::vector<float> divided_here(polygon.size() * each);
    std::vector<Vertex> fan;
    for (const Eigen::VectorXf& corner : polygon)
      if (corner[3] > 0)
        fan.push_back(
            vertex_of(corner.head<4>(), corner.data() + 4, divided_here.data() + fan.size() * each));
    for (std::size_t i = 2; i < fan.size(); ++i) add_triangle({&fan[0], &fan[i - 1], &fan[i]}, part);
  }
  ++meshes_;
}

void Tiles::add_triangle(std::array<const Vertex*, 3> v, const Part& of) {
  const auto [left, right] = std::minmax({v[0]->x, v[1]->x, v[2]->x});
  const auto [low, high] = std::minmax({v[0]->y, v[1]->y, v[2]->y});
  if (std::max(first_in(left - aside_), 0) > std::min(last_in(right + aside_), columns_ - 1) ||
      std::max(first_in(low - aside_), 0) > std::min(last_in(high + aside_), rows_ - 1))
    return;
  const std::int64_t bx = v[1]->x - v[0]->x, by = v[1]->y - v[0]->y, cx = v[2]->x - v[0]->x,
                     cy = v[2]->y - v[0]->y, twice = bx * cy - cx * by;
  if (twice == 0 || (of.fronts_alone && twice < 0)) return;
  const float per = float(parts) / float(twice), from_x = 0.5f - float(v[0]->x) / parts,
              from_y = 0.5f - float(v[0]->y) / parts;
  const auto slope_of = [&](float at0, float at1, float at2) {
    const float b = at1 - at0, d = at2 - at0;
    Slope slope{0, (b * float(cy) - d * float(by)) * per, (d * float(bx) - b * float(cx)) * per};
    slope.f = at0 + slope.dx * from_x + slope.dy * from_y;
    return slope;
  };
  ScreenTriangle t;
  const Slope depth = slope_of(v[0]->z, v[1]->z, v[2]->z);
  t.z = depth.f, t.dz_dx = depth.dx, t.dz_dy = depth.dy;
  if (of.stand_back > 0) {
    const float nearest_one = std::max({v[0]->z, v[1]->z, v[2]->z}),
                step = std::ldexp(1.0f, std::ilogb(std::max(nearest_one, 1e-30f)) - 23);
    t.z += float(of.stand_back) * std::max(std::abs(t.dz_dx), std::abs(t.dz_dy)) + 4 * step;
  }
  t.number = of.number, t.mesh = meshes_, t.clipped = of.clipped;
  t.front = twice > 0;
  t.cuts = 0, t.first_slope = std::uint32_t(slopes_.size());
  bool gone = false;
  for (std::size_t k = 0; k < of.numbers && !gone; ++k) {
    const auto [lowest, highest] = std::minmax({v[0]->numbers[k], v[1]->numbers[k], v[2]->numbers[k]});
    gone = of.cut_below_zero && highest < 0;
    if (of.cut_below_zero && !(lowest < 0)) continue;
    slopes_.push_back(slope_of(v[0]->numbers[k], v[1]->numbers[k], v[2]->numbers[k]));
    t.cuts += std::uint8_t(of.cut_below_zero);
  }
  if (gone) {
    slopes_.resize(t.first_slope);
    return;
  }
  if (!t.front) std::swap(v[1], v[2]);
  for (std::size_t i = 0; i < 3; ++i) t.x[i] = v[i]->x, t.y[i] = v[i]->y;
  triangles_.push_back(t);
}

// Counted, then put in place.
void Tiles::sort() {
  const int across = columns();
  first_.assign(std::size_t(across * rows()) + 1, 0);
  const auto each_tile = [&](const ScreenTriangle& t, const auto& visit) {
    const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
    const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
    const int c0 = std::max(first_in(left - aside_), 0) / tile_samples,
              c1 = std::min(last_in(right + aside_), columns_ - 1) / tile_samples;
    const int r0 = std::max(first_in(low - aside_), 0) / tile_samples,
              r1 = std::min(last_in(high + aside_), rows_ - 1) / tile_samples;
    for (int r = r0; r <= r1; ++r)
      for (int c = c0; c <= c1; ++c) visit(std::size_t(r * across + c));
  };
  for (const ScreenTriangle& t : triangles_) each_tile(t, [&](std::size_t tile) { ++first_[tile + 1]; });
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  of_tiles_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    each_tile(triangles_[t], [&](std::size_t tile) { of_tiles_[next[tile]++] = std::uint32_t(t); });
}

bool Tiles::empty(int column, int row) const {
  const std::size_t tile = std::size_t(row * columns() + column);
  return first_[tile] == first_[tile + 1];
}

// Which samples a triangle covers that no plane cuts off, sixteen of a row at a time (bits of −1), and their
// depths.
template <bool turned, class Visit>
[[gnu::always_inline]] inline void Tiles::visit_blocks(int column, int row, const Visit& visit) const {
  const std::size_t tile = std::size_t(row * columns() + column);
  const int x0 = column * tile_samples, y0 = row * tile_samples;
  for (std::uint32_t k = first_[tile]; k < first_[tile + 1]; ++k) {
    const ScreenTriangle& t = triangles_[of_tiles_[k]];
    const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
    const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
    const int c0 = std::max(first_in(left - aside_) - x0, 0) / at_once,
              c1 = std::min(last_in(right + aside_) - x0, tile_samples - 1) / at_once;
    const int r0 = std::max(first_in(low - aside_) - y0, 0),
              r1 = std::min(last_in(high + aside_) - y0, tile_samples - 1);
    const Edge a = edge_of<turned>(t, 0, 1, x0, y0), b = edge_of<turned>(t, 1, 2, x0, y0),
               c = edge_of<turned>(t, 2, 0, x0, y0);
    const float z0 = t.z + float(x0) * t.dz_dx + float(y0) * t.dz_dy;
    for (int block = c0; block <= c1; ++block) {
      const Ints x = ascending + at_once * block;
      const Ints ax = x * a.dx, bx = x * b.dx, cx = x * c.dx;
      const Floats zx = z0 + __builtin_convertvector(x, Floats) * t.dz_dx;
      visit(
          std::int32_t(of_tiles_[k]), block, r0, r1, [&](int r, Floats& z) __attribute__((always_inline)) {
            const int up = turned ? r & 1 : 0;
            const Ints outside =
                (a.at[up] + ax + r * a.dy) | (b.at[up] + bx + r * b.dy) | (c.at[up] + cx + r * c.dy);
            z = zx + float(r) * t.dz_dy;
            Ints inside = outside >= 0;
            for (std::uint32_t i = t.first_slope; i < t.first_slope + t.cuts; ++i) {
              const Slope& cut = slopes_[i];
              Floats sx = float(x0) + __builtin_convertvector(x, Floats), sy = Floats{} + float(y0 + r);
              if (turned) sx += up ? -0.25f : 0.25f, sy += odd ? Floats{} + 0.25f : Floats{} - 0.25f;
              inside &= cut.f + sx * cut.dx + sy * cut.dy >= 0;
            }
            return inside;
          });
    }
  }
}

[[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]] void Tiles::resolve(
    int column, int row, Samples& samples) const {
  samples.triangle.fill(-1);
  samples.depth.fill(1);
  visit_blocks<false>(
      column, row,
      [&](std::int32_t triangle, int block, int first, int last, const auto& inside_of)
          __attribute__((always_inline)) {
            for (int r = first; r <= last; ++r) {
              const std::size_t at = std::size_t(r * tile_samples + at_once * block);
              Floats* const depth = reinterpret_cast<Floats*>(&samples.depth[at]);
              Ints* const shown = reinterpret_cast<Ints*>(&samples.triangle[at]);
              Floats z;
              const Ints inside = inside_of(r, z), nearer = inside & (z < *depth);
              *depth = nearer ? z : *depth;
              *shown = nearer ? Ints{} + triangle : *shown;
            }
          });
}

// Two rows at a time, which are one of pixels.
[[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]] void Tiles::cover(
    int column, int row, const Samples& opaque, std::vector<Covered>& covered) const {
  covered.clear();
  const auto put = [&](std::int32_t triangle, int block, int first, int last, const auto& inside_of)
      __attribute__((always_inline)) {
    for (int y = first / 2; y <= last / 2; ++y) {
      Ints two_rows{};
      for (int up = 0; up < 2; ++up) {
        const int r = 2 * y + up;
        Floats z;
        const Ints inside = inside_of(r, z);
        const Floats depth =
            *reinterpret_cast<const Floats*>(&opaque.depth[std::size_t(r * tile_samples + at_once * block)]);
        two_rows |= inside & (z < depth) & bits_of_row[up];
      }
      std::uint32_t all = 0;
      for (int i = 0; i < at_once; ++i) all |= std::uint32_t(two_rows[i]) << (i / 2 * 4);
      for (; all != 0;) {
        const int pixel = std::countr_zero(all) / 4;
        covered.push_back({triangle, std::int16_t(at_once / 2 * block + pixel), std::int16_t(y),
                           std::uint8_t(all >> (4 * pixel) & 15)});
        all &= ~(15u << (4 * pixel));
      }
    }
  };
  aside_ > 0 ? visit_blocks<true>(column, row, put) : visit_blocks<false>(column, row, put);
}

}  // namespace limber::render::detail
