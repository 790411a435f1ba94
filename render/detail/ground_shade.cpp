// Shadows on the ground, by bands of height (the idea: ground_shade.h). In order: a map that holds all that
// the stage can cast; triangles projected along the light and put into bands, a cell's height between two;
// each band blurred by its height; the sum.
//
// What always holds: a cell is marked by the most that any caster holds back there, and not by a sum, so a
// body of many layers casts no darker shadow than its outline, and the order of casters does not count.
//
// The blur is three box filters (Wells, Efficient Synthesis of Gaussian Filters by Cascaded Uniform Filters,
// 1986): its cost does not depend on how wide it is.
#include "render/detail/ground_shade.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/mesh.h"

namespace limber::render::detail {

namespace {

// Band k is for what is 2^k times as high as band 0; a height between two bands is shared by both.
constexpr int bands = 8;

using Plane = std::vector<float>;

struct Rectangle {  // of cells, upper bounds included
  int left = 1 << 30, low = 1 << 30, right = -1, high = -1;
};

struct Raster {
  int columns, rows;
  std::array<Plane, bands> cover;
  std::array<Rectangle, bands> covered;

  void mark(int column, int row, double height, float blocks) {  // height: in units of band 0
    const double place = std::clamp(std::log2(std::max(height, 1e-6)), 0.0, bands - 1.0);
    const int band = std::min(int(place), bands - 2);
    const float share = float(place - band);
    raise(band, column, row, (1 - share) * blocks);
    raise(band + 1, column, row, share * blocks);
  }
  void raise(int band, int column, int row, float share) {
    if (share <= 0) return;
    if (cover[band].empty()) cover[band].assign(std::size_t(columns) * rows, 0.0f);
    float& cell = cover[band][std::size_t(row) * columns + column];
    cell = std::max(cell, share);
    Rectangle& r = covered[band];
    r.left = std::min(r.left, column), r.right = std::max(r.right, column);
    r.low = std::min(r.low, row), r.high = std::max(r.high, row);
  }
};

struct Corner {
  double u, v;    // cells
  double height;  // in units of band 0
};

// Cells whose centre the triangle covers, either way round. `above`: how far above each plane that cuts it
// the corners are.
void rasterize(const std::array<Corner, 3>& c, std::span<const Eigen::Vector3d> above, float blocks,
               Raster& raster) {
  const auto [u0, u1] = std::minmax({c[0].u, c[1].u, c[2].u});
  const auto [v0, v1] = std::minmax({c[0].v, c[1].v, c[2].v});
  const int left = std::max(0, int(std::ceil(u0 - 0.5))),
            right = std::min(raster.columns - 1, int(std::floor(u1 - 0.5)));
  const int low = std::max(0, int(std::ceil(v0 - 0.5))),
            high = std::min(raster.rows - 1, int(std::floor(v1 - 0.5)));
  if (left > right || low > high) return;
  const double area = (c[1].u - c[0].u) * (c[2].v - c[0].v) - (c[2].u - c[0].u) * (c[1].v - c[0].v);
  if (area == 0) return;
  for (int row = low; row <= high; ++row)
    for (int column = left; column <= right; ++column) {
      const double u = column + 0.5, v = row + 0.5;
      const double w1 = ((u - c[0].u) * (c[2].v - c[0].v) - (c[2].u - c[0].u) * (v - c[0].v)) / area;
      const double w2 = ((c[1].u - c[0].u) * (v - c[0].v) - (u - c[0].u) * (c[1].v - c[0].v)) / area;
      if (w1 < 0 || w2 < 0 || w1 + w2 > 1) continue;
      const Eigen::Vector3d weights(1 - w1 - w2, w1, w2);
      if (std::any_of(above.begin(), above.end(),
                      [&](const Eigen::Vector3d& heights) { return heights.dot(weights) < 0; }))
        continue;
      raster.mark(column, row,
                  c[0].height + w1 * (c[1].height - c[0].height) + w2 * (c[2].height - c[0].height), blocks);
    }
}

// One box filter of the given (odd, fractional) width down the columns; `out` comes transposed, so that
// calling it twice filters both ways.
void box_filter_transposed(const Plane& in, int columns, int rows, double width, Plane& out) {
  const double reach = 0.5 * (width - 1);
  const int whole = int(reach);
  const float part = float(reach - whole), scale = float(1 / width);
  std::vector<float> sum(std::size_t(columns), 0.0f), line;
  const auto row = [&](int r) { return r >= 0 && r < rows ? &in[std::size_t(r) * columns] : nullptr; };
  const auto add = [&](std::vector<float>& to, const float* from, float factor) {
    if (from)
      for (int c = 0; c < columns; ++c) to[c] += factor * from[c];
  };
  constexpr int block = 16;
  std::vector<float> lines(std::size_t(columns) * block);
  for (int r = 0; r < std::min(whole, rows); ++r) add(sum, row(r), 1);
  for (int r0 = 0; r0 < rows; r0 += block) {
    const int count = std::min(block, rows - r0);
    for (int k = 0; k < count; ++k) {
      const int r = r0 + k;
      add(sum, row(r + whole), 1);
      line = sum;
      add(line, row(r + whole + 1), part);
      add(line, row(r - whole - 1), part);
      add(sum, row(r - whole), -1);
      for (int c = 0; c < columns; ++c) lines[std::size_t(k) * columns + c] = scale * line[c];
    }
    for (int c = 0; c < columns; ++c)
      for (int k = 0; k < count; ++k)
        out[std::size_t(c) * rows + r0 + k] = lines[std::size_t(k) * columns + c];
  }
}

// Adds share × the blurred band. Three box filters come close to a Gaussian; each adds (width² − 1) / 12 to
// the variance. Only where the band is not zero, for most of the ground is empty.
void add_blurred(const Raster& raster, int band, double deviation, float share, Plane& sum) {
  const double width = std::sqrt(4 * deviation * deviation + 1);
  const int reach = int(1.5 * width) + 3;
  const Rectangle& covered = raster.covered[band];
  const int left = std::max(0, covered.left - reach),
            columns = std::min(raster.columns, covered.right + reach + 1) - left;
  const int low = std::max(0, covered.low - reach),
            rows = std::min(raster.rows, covered.high + reach + 1) - low;
  Plane plane(std::size_t(columns) * rows), turned(plane.size());
  for (int r = 0; r < rows; ++r)
    std::copy_n(&raster.cover[band][std::size_t(low + r) * raster.columns + left], columns,
                &plane[std::size_t(r) * columns]);
  for (int pass = 0; pass < 3; ++pass) {
    box_filter_transposed(plane, columns, rows, width, turned);
    box_filter_transposed(turned, rows, columns, width, plane);
  }
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      sum[std::size_t(low + r) * raster.columns + left + c] += share * plane[std::size_t(r) * columns + c];
}

}  // namespace

GroundFrame ground_frame(const Vec3& up, double height_m) {
  GroundFrame frame;
  frame.up = up.normalized();
  frame.height_m = height_m;
  const Vec3 x = frame.up.cross(Vec3(0, 1, 0)).norm() > 0.1 ? Vec3(Vec3(0, 1, 0).cross(frame.up).normalized())
                                                            : Vec3::UnitX();
  frame.plane_from_world << x.transpose(), frame.up.cross(x).transpose();
  return frame;
}

ShadeMap shade_ground(std::span<const GroundCaster> casters, const GroundFrame& frame,
                      const Vec3& toward_light, std::span<const double> spreads, const Box& stage,
                      int cells) {
  const Vec3 light = toward_light / frame.up.dot(toward_light);
  const double widest = *std::max_element(spreads.begin(), spreads.end());
  const auto height = [&](const Vec3& p) { return std::max(0.0, frame.up.dot(p) - frame.height_m); };
  const auto onto_ground = [&](const Vec3& p) {
    return Eigen::Vector2d(frame.plane_from_world * (p - height(p) * light));
  };

  ShadeMap map;
  Eigen::Vector2d lower(1e300, 1e300), upper(-1e300, -1e300);
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner = stage.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(stage.size());
    const Eigen::Vector2d p = onto_ground(corner),
                          margin = Eigen::Vector2d::Constant(std::min(3 * widest, 2.0) * height(corner));
    lower = lower.cwiseMin(p - margin), upper = upper.cwiseMax(p + margin);
  }
  map.cell_m = std::max((upper - lower).maxCoeff() / (cells - 4), 1e-9);
  map.columns = int(std::ceil((upper - lower).x() / map.cell_m)) + 4;
  map.rows = int(std::ceil((upper - lower).y() / map.cell_m)) + 4;
  map.lower = lower - Eigen::Vector2d::Constant(2 * map.cell_m);
  // Lower than this, the blur is less than a cell and no two heights differ.
  const double band_0_m = 0.7 * map.cell_m / std::max(widest, 1e-3);

  Raster raster{map.columns, map.rows, {}, {}};
  std::vector<Corner> corners;
  for (const auto& [mesh, blocks, planes] : casters) {
    corners.resize(mesh->vertex_from_drawn.size());
    for (std::size_t v = 0; v < corners.size(); ++v) {
      const Vec3 p(mesh->positions[3 * v], mesh->positions[3 * v + 1], mesh->positions[3 * v + 2]);
      const Eigen::Vector2d at = (onto_ground(p) - map.lower) / map.cell_m;
      corners[v] = {at.x(), at.y(), height(p) / band_0_m};
    }
    std::vector<Eigen::Vector3d> above(planes.size());
    for (std::size_t c = 0; c < mesh->corners.size(); c += 3) {
      for (std::size_t i = 0; i < 3 && !planes.empty(); ++i) {
        const float* p = &mesh->positions[3 * mesh->corners[c + i]];
        for (std::size_t k = 0; k < planes.size(); ++k)
          above[k][int(i)] = planes[k].dot(Eigen::Vector4d(p[0], p[1], p[2], 1));
      }
      rasterize({corners[mesh->corners[c]], corners[mesh->corners[c + 1]], corners[mesh->corners[c + 2]]},
                above, blocks, raster);
    }
  }

  map.blocked.assign(std::size_t(map.columns) * map.rows, 0.0f);
  for (int band = 0; band < bands; ++band)
    for (const double spread : raster.cover[band].empty() ? std::span<const double>() : spreads)
      add_blurred(raster, band, std::exp2(band) * band_0_m * spread / map.cell_m, 1 / float(spreads.size()),
                  map.blocked);
  // A margin that is cut short ends softly.
  const double slope = 3 * widest > 2 ? 8 : 1e9;
  const auto fade = [&](int at, int size) {
    return std::min(1.0, slope * std::min(at, size - 1 - at) / size);
  };
  for (int r = 0; r < map.rows; ++r)
    for (int c = 0; c < map.columns; ++c) {
      float& blocked = map.blocked[std::size_t(r) * map.columns + c];
      blocked = std::clamp(blocked, 0.0f, 1.0f) * float(fade(r, map.rows) * fade(c, map.columns));
    }
  return map;
}

}  // namespace limber::render::detail
