#include "render/detail/tiles.h"

#include <algorithm>
#include <cmath>

namespace limber::render::detail {

namespace {

constexpr int at_once = 16;
using Ints = std::int32_t __attribute__((vector_size(4 * at_once), may_alias));
using Floats = float __attribute__((vector_size(4 * at_once), may_alias));
constexpr Ints ascending{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

constexpr int parts = 256;           // of a sample, in which corners are given
constexpr float farthest = 1 << 14;  // samples from the picture: beyond it edges would not fit 32 bits
constexpr std::int32_t most =
    1 << 30;  // of an edge's function: a tile's steps, of up to 2^30, neither turn its sign nor overflow

// First and last sample whose middle lies in [low, high], given in parts.
int first_in(std::int32_t low) { return (low - parts / 2 + parts - 1) >> 8; }
int last_in(std::int32_t high) { return (high - parts / 2) >> 8; }

// e(x, y) ≥ 0 on the inner side of an edge, and on it where it is a top or a left one; for the sample (x, y)
// of a tile e = at + x dx + y dy. Exact: e is a whole number of parts², and of samples' middles only
// multiples of `parts` differ.
struct Edge {
  std::int32_t at, dx, dy;
};
Edge edge_of(const ScreenTriangle& t, int from, int to, int x0, int y0) {
  const std::int64_t dx = t.x[std::size_t(to)] - t.x[std::size_t(from)],
                     dy = t.y[std::size_t(to)] - t.y[std::size_t(from)];
  const std::int64_t px = std::int64_t(x0) * parts + parts / 2 - t.x[std::size_t(from)],
                     py = std::int64_t(y0) * parts + parts / 2 - t.y[std::size_t(from)];
  // Corners go counterclockwise, y is upward: left edges go down, top ones to the left.
  const bool closed = dy < 0 || (dy == 0 && dx < 0);
  const std::int64_t e = (dx * py - dy * px - (closed ? 0 : 1)) >> 8;
  return {std::int32_t(std::clamp<std::int64_t>(e, -most, most)), std::int32_t(-dy), std::int32_t(dx)};
}

}  // namespace

Tiles::Tiles(int columns, int rows) : columns_(columns), rows_(rows) {}

bool Tiles::add(const std::vector<float>& positions, const std::vector<std::uint32_t>& corners,
                const Mat4& clip_from_world, bool fronts_alone, double stand_back,
                const Eigen::Vector4d* cut) {
  struct Vertex {
    std::int32_t x, y;
    float z, above;  // the last: of the cut, over w, which is linear in the picture
  };
  const std::size_t vertices = positions.size() / 3;
  std::vector<Vertex> placed(vertices);
  Eigen::Matrix4f clip = clip_from_world.cast<float>();
  for (std::size_t v = 0; v < vertices; ++v) {
    const float* p = &positions[3 * v];
    const Eigen::Vector4f c = clip * Eigen::Vector4f(p[0], p[1], p[2], 1);
    if (!(c.w() > 0) || c.z() < -c.w()) return false;
    const float x = (0.5f + 0.5f * c.x() / c.w()) * float(columns_),
                y = (0.5f + 0.5f * c.y() / c.w()) * float(rows_);
    if (!(std::abs(x) < farthest && std::abs(y) < farthest)) return false;
    const float above = cut ? float(cut->head<3>().dot(Vec3(p[0], p[1], p[2])) + (*cut)[3]) / c.w() : 1;
    placed[v] = {std::int32_t(std::lround(x * parts)), std::int32_t(std::lround(y * parts)),
                 0.5f + 0.5f * c.z() / c.w(), above};
  }
  for (std::size_t c = 0; c < corners.size(); c += 3) {
    std::array<const Vertex*, 3> v{&placed[corners[c]], &placed[corners[c + 1]], &placed[corners[c + 2]]};
    const auto [lowest, highest] = std::minmax({v[0]->above, v[1]->above, v[2]->above});
    if (highest < 0) continue;
    const auto [left, right] = std::minmax({v[0]->x, v[1]->x, v[2]->x});
    const auto [low, high] = std::minmax({v[0]->y, v[1]->y, v[2]->y});
    if (std::max(first_in(left), 0) > std::min(last_in(right), columns_ - 1) ||
        std::max(first_in(low), 0) > std::min(last_in(high), rows_ - 1))
      continue;
    const std::int64_t bx = v[1]->x - v[0]->x, by = v[1]->y - v[0]->y, cx = v[2]->x - v[0]->x,
                       cy = v[2]->y - v[0]->y, twice = bx * cy - cx * by;
    if (twice == 0 || (fronts_alone && twice < 0)) continue;
    const float per = float(parts) / float(twice), bz = v[1]->z - v[0]->z, cz = v[2]->z - v[0]->z;
    ScreenTriangle t;
    t.dz_dx = (bz * float(cy) - cz * float(by)) * per;
    t.dz_dy = (cz * float(bx) - bz * float(cx)) * per;
    const float middle = 0.5f;
    t.z = v[0]->z + t.dz_dx * (middle - float(v[0]->x) / parts) + t.dz_dy * (middle - float(v[0]->y) / parts);
    if (stand_back > 0) {
      const float nearest_one = std::max({v[0]->z, v[1]->z, v[2]->z}),
                  step = std::ldexp(1.0f, std::ilogb(std::max(nearest_one, 1e-30f)) - 23);
      t.z += float(stand_back) * std::max(std::abs(t.dz_dx), std::abs(t.dz_dy)) + 4 * step;
    }
    t.number = std::uint32_t(c / 3), t.mesh = meshes_;
    t.front = twice > 0;
    t.cut = -1;
    if (lowest < 0) {
      const float b = v[1]->above - v[0]->above, d = v[2]->above - v[0]->above;
      Cut through;
      through.dx = (b * float(cy) - d * float(by)) * per;
      through.dy = (d * float(bx) - b * float(cx)) * per;
      through.f = v[0]->above + through.dx * (middle - float(v[0]->x) / parts) +
                  through.dy * (middle - float(v[0]->y) / parts);
      t.cut = std::int32_t(cuts_.size());
      cuts_.push_back(through);
    }
    if (!t.front) std::swap(v[1], v[2]);
    for (std::size_t i = 0; i < 3; ++i) t.x[i] = v[i]->x, t.y[i] = v[i]->y;
    triangles_.push_back(t);
  }
  ++meshes_;
  return true;
}

// Counted, then put in place.
void Tiles::sort() {
  const int across = columns();
  first_.assign(std::size_t(across * rows()) + 1, 0);
  const auto each_tile = [&](const ScreenTriangle& t, const auto& visit) {
    const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
    const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
    const int c0 = std::max(first_in(left), 0) / tile_samples,
              c1 = std::min(last_in(right), columns_ - 1) / tile_samples;
    const int r0 = std::max(first_in(low), 0) / tile_samples,
              r1 = std::min(last_in(high), rows_ - 1) / tile_samples;
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

[[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]] void Tiles::resolve(
    int column, int row, Samples& samples) const {
  const std::size_t tile = std::size_t(row * columns() + column);
  samples.triangle.fill(-1);
  samples.depth.fill(1);
  const int x0 = column * tile_samples, y0 = row * tile_samples;
  for (std::uint32_t k = first_[tile]; k < first_[tile + 1]; ++k) {
    const ScreenTriangle& t = triangles_[of_tiles_[k]];
    const auto [left, right] = std::minmax({t.x[0], t.x[1], t.x[2]});
    const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
    const int c0 = std::max(first_in(left) - x0, 0) / at_once,
              c1 = std::min(last_in(right) - x0, tile_samples - 1) / at_once;
    const int r0 = std::max(first_in(low) - y0, 0), r1 = std::min(last_in(high) - y0, tile_samples - 1);
    const Edge a = edge_of(t, 0, 1, x0, y0), b = edge_of(t, 1, 2, x0, y0), c = edge_of(t, 2, 0, x0, y0);
    const float z0 = t.z + float(x0) * t.dz_dx + float(y0) * t.dz_dy;
    for (int block = c0; block <= c1; ++block) {
      const Ints x = ascending + at_once * block;
      const Ints ea = a.at + x * a.dx, eb = b.at + x * b.dx, ec = c.at + x * c.dx;
      const Floats zx = z0 + __builtin_convertvector(x, Floats) * t.dz_dx;
      for (int r = r0; r <= r1; ++r) {
        const Ints outside = (ea + r * a.dy) | (eb + r * b.dy) | (ec + r * c.dy);
        Floats* const depth =
            reinterpret_cast<Floats*>(&samples.depth[std::size_t(r * tile_samples + at_once * block)]);
        Ints* const shown =
            reinterpret_cast<Ints*>(&samples.triangle[std::size_t(r * tile_samples + at_once * block)]);
        const Floats z = zx + float(r) * t.dz_dy;
        Ints nearer = (outside >= 0) & (z < *depth);
        if (t.cut >= 0) {
          const Cut& cut = cuts_[std::size_t(t.cut)];
          const Floats above =
              cut.f + float(y0 + r) * cut.dy + (float(x0) + __builtin_convertvector(x, Floats)) * cut.dx;
          nearer &= above >= 0;
        }
        *depth = nearer ? z : *depth;
        *shown = nearer ? Ints{} + std::int32_t(of_tiles_[k]) : *shown;
      }
    }
  }
}

}  // namespace limber::render::detail
