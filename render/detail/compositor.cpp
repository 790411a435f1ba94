// A row of the picture: samples averaged, then put over what is behind them.
//
//     pixel = Σ samples / n + (1 − α) × behind,           (over(): as it is shown, where that is bright)
//     behind = floor faded into the far ground, hazed into the horizon; or sky; or two colours of a
//     background.
//
// The floor is not rasterized: where a pixel's ray meets it follows from the camera, and how much light
// arrives there from two maps (ground_shade.h). Four pixels are taken at a time, and only those that no mesh
// covers.
//
// What always holds: rows do not depend on one another, and √ is the exact one (Eigen's begins with an
// estimate that differs between makes of CPU), so a picture has the same bytes on any machine.
#include "render/detail/compositor.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

#include "render/image.h"

namespace limber::render::detail {

namespace {

constexpr double sky_darkening = 0.85;  // of what the map says
constexpr float sky_rise = 4;           // the sky has its upper colour from 30° on: 1 / sin² of that

using Halves = std::uint16_t __attribute__((vector_size(8)));
using Words = std::uint32_t __attribute__((vector_size(16)));
using Floats = float __attribute__((vector_size(16)));

// A half's exponent is biased by 15, a float's by 127. Infinity becomes 65536, and what is not a number 0.
Floats floats_of(const std::uint16_t* four) {
  Halves halves;
  std::memcpy(&halves, four, sizeof halves);
  const Words bits = __builtin_convertvector(halves, Words);
  Words size = bits & 0x7fff;
  size &= Words(size <= 0x7c00);
  return std::bit_cast<Floats>((size << 13) | ((bits & 0x8000) << 16)) * 0x1p112f;
}

bool is_zero(const std::uint16_t* one_sample) {
  std::uint64_t bits;
  std::memcpy(&bits, one_sample, sizeof bits);
  return bits == 0;
}

Floats clamped(Floats x, float low, float high) {
  x = x > low ? x : Floats{} + low;
  return x < high ? x : Floats{} + high;
}

bool any(Words mask) {
  const auto halves = std::bit_cast<std::array<std::uint64_t, 2>>(mask);
  return (halves[0] | halves[1]) != 0;
}

// Not Eigen's, which begins with an estimate that differs between makes of CPU.
Floats root(const Floats& x) {
  return Floats{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}

// What is behind, laid under a pixel of which `open` is free. What the tone map compresses is mixed as it is
// shown: its inverse of white is huge, and a half covered pixel before white would be white.
constexpr float knee = float(tone_knee);
Floats over(Floats drawn, float open, Floats behind) {
  const Floats linear = drawn + open * behind;
  if (open >= 1 || !any(Words(behind > knee))) return linear;
  Floats mixed = linear;
  for (int c = 0; c < 3; ++c) {
    if (!(behind[c] > knee)) continue;
    const double shown = tone_mapped(double(drawn[c] + open * knee)) +
                         double(open) * (tone_mapped(double(behind[c])) - tone_knee);
    mixed[c] = float(tone_unmapped(shown));
  }
  return mixed;
}

Floats colour(const Vec3& rgb) { return Floats{float(rgb.x()), float(rgb.y()), float(rgb.z()), 0}; }

// Two cells side by side at each of two places.
Floats pairs(const float* one, const float* other) {
  std::array<double, 2> bits;
  std::memcpy(&bits[0], one, sizeof(double)), std::memcpy(&bits[1], other, sizeof(double));
  return std::bit_cast<Floats>(bits);
}

// Bilinear, from a map of shade, at (u, v) m from `origin`; nothing beyond its border, where it has faded
// out.
class Lookup {
 public:
  Lookup(const ShadeMap& map, const Eigen::Vector2d& origin)
      : map_(map),
        per_m_(float(1 / map.cell_m)),
        u0_(float((origin - map.lower).x() / map.cell_m - 0.5)),
        v0_(float((origin - map.lower).y() / map.cell_m - 0.5)) {}

  Floats operator()(Floats u, Floats v) const {
    const float last_column = float(map_.columns - 1), last_row = float(map_.rows - 1);
    const Floats column = u * per_m_ + u0_, row = v * per_m_ + v0_;
    const Words inside =
        Words(column > 0) & Words(column < last_column) & Words(row > 0) & Words(row < last_row);
    if (!any(inside)) return Floats{};
    using Ints = std::int32_t __attribute__((vector_size(16)));
    const Floats in_column = clamped(column, 0, last_column), in_row = clamped(row, 0, last_row);
    const Ints c = __builtin_convertvector(clamped(in_column, 0, last_column - 1), Ints),
               r = __builtin_convertvector(clamped(in_row, 0, last_row - 1), Ints);
    const Floats right = in_column - __builtin_convertvector(c, Floats),
                 up = in_row - __builtin_convertvector(r, Floats);
    std::array<const float*, 4> cell;
    for (int i = 0; i < 4; ++i) cell[std::size_t(i)] = &map_.blocked[std::size_t(r[i] * map_.columns + c[i])];
    const Floats low_01 = pairs(cell[0], cell[1]), low_23 = pairs(cell[2], cell[3]),
                 high_01 = pairs(cell[0] + map_.columns, cell[1] + map_.columns),
                 high_23 = pairs(cell[2] + map_.columns, cell[3] + map_.columns);
    const Floats pairs_01 = low_01 + __builtin_shufflevector(up, up, 0, 0, 1, 1) * (high_01 - low_01),
                 pairs_23 = low_23 + __builtin_shufflevector(up, up, 2, 2, 3, 3) * (high_23 - low_23);
    const Floats lefts = __builtin_shufflevector(pairs_01, pairs_23, 0, 2, 4, 6),
                 rights = __builtin_shufflevector(pairs_01, pairs_23, 1, 3, 5, 7);
    return lefts + right * (rights - lefts);
  }

 private:
  const ShadeMap& map_;
  float per_m_, u0_, v0_;
};

}  // namespace

Compositor::Compositor(const Backdrop& backdrop, const Camera& camera, int width, int height)
    : backdrop_(backdrop), camera_(camera), width_(width), height_(height) {}

// Samples that are 0 in all parts are most of the picture, and passed by.
void Compositor::row(int y, const Samples& samples, float* rgba) const {
  const int per_side = samples.per_side, pixel_row = height_ - 1 - y - samples.above;
  std::fill_n(rgba, 4 * width_, 0.0f);
  if (pixel_row < 0 || pixel_row >= samples.rows) return put_over_ground(y, rgba);
  const std::size_t texels = std::size_t(samples.columns) * std::size_t(per_side);
  const std::uint16_t* lowest = samples.first + 4 * texels * std::size_t(pixel_row) * std::size_t(per_side);
  const float share = 1 / float(per_side * per_side);
  for (int x = 0; x < samples.columns; ++x) {
    Floats sum{};
    for (int j = 0; j < per_side; ++j) {
      const std::uint16_t* sample =
          lowest + 4 * (texels * std::size_t(j) + std::size_t(x) * std::size_t(per_side));
      for (int i = 0; i < per_side; ++i, sample += 4)
        if (!is_zero(sample)) sum += floats_of(sample);
    }
    sum *= share;
    std::memcpy(rgba + 4 * (samples.left + x), &sum, sizeof sum);
  }
  put_over_ground(y, rgba);
}

// With o + s d the ray of a pixel, d = first + x × step: it meets the ground at s = eye height / −d·up. There
// the floor fades by 1 − t² (3 − 2t), t from 0 to 1 between both ends of the fade, and the haze is r²/(r² +
// haze²).
void Compositor::put_over_ground(int y, float* rgba) const {
  const Backdrop& b = backdrop_;
  const double tangent = std::tan(0.5 * camera_.fov_deg * std::numbers::pi / 180);
  const Eigen::Matrix3d axes = camera_from_world(camera_).topLeftCorner<3, 3>().transpose();
  // The ray through a pixel is first + x × step; where it meets the ground follows from its parts along the
  // ground and downward.
  const double height = 1 - 2 * (y + 0.5) / height_;  // −1 … 1, upward
  const double pixel = 2 * tangent / height_;
  const Vec3 step = pixel * axes.col(0),
             first = 0.5 * (1 - width_) * step + height * tangent * axes.col(1) - axes.col(2);
  const auto along_ground = [&](const Vec3& v) { return Eigen::Vector2d(b.ground.plane_from_world * v); };
  const Eigen::Vector2d middle = along_ground(b.fade_middle), eye = along_ground(camera_.eye) - middle;
  const float eye_u = float(eye.x()), step_u = float(along_ground(step).x()),
              first_u = float(along_ground(first).x()), eye_v = float(eye.y()),
              step_v = float(along_ground(step).y()), first_v = float(along_ground(first).y());
  const float step_down = float(-b.ground.up.dot(step)), first_down = float(-b.ground.up.dot(first));
  const float eye_height = float(b.ground.up.dot(camera_.eye) - b.ground.height_m);
  const Lookup key_shade(*b.key_shade, middle), sky_shade(*b.sky_shade, middle);
  const Floats key_share = colour(b.key_share),
               sky_share = colour(sky_darkening * (Vec3::Ones() - b.key_share));
  const float fade_begin = float(b.fade_begin_m), per_fade = float(1 / (b.fade_end_m - b.fade_begin_m));

  const Floats top = colour(b.background_top), bottom = colour(b.background_bottom),
               ground = colour(b.ground_color), far_ground = colour(b.far_ground_color);
  const Floats upright = bottom + float(0.5 + 0.5 * height) * (top - bottom);
  // Of the sky by sin² of the ray's height, so that its colour has no kink at the horizon.
  const float haze_2 = float(b.haze_m * b.haze_m);
  const float row_2 = float(1 + height * tangent * height * tangent), pixel_2 = float(pixel * pixel);

  for (int x0 = 0; x0 < width_; x0 += 4) {
    const int count = std::min(4, width_ - x0);
    float* block = rgba + 4 * x0;
    bool covered = true;
    for (int i = 0; i < count; ++i) covered &= block[4 * i + 3] >= 1;
    if (covered) continue;
    Floats shown{}, key{}, sky{}, haze{}, rise{};
    const Floats x = float(x0) + Floats{0, 1, 2, 3}, down = first_down + x * step_down;
    const Words downward = Words(down > 1e-6f);
    if (b.ground_seen && any(downward)) {
      const Floats way = eye_height / clamped(down, 1e-6f, INFINITY);
      const Floats u = eye_u + way * (first_u + x * step_u), v = eye_v + way * (first_v + x * step_v);
      const Floats distance_2 = u * u + v * v;
      Floats fade{};
      if (any(Words(distance_2 > fade_begin * fade_begin)))
        fade = clamped((root(distance_2) - fade_begin) * per_fade, 0, 1);
      shown = std::bit_cast<Floats>(downward & std::bit_cast<Words>(1 - fade * fade * (3 - 2 * fade)));
      if (any(Words(shown > 0))) key = key_shade(u, v), sky = sky_shade(u, v);
      haze = distance_2 / (distance_2 + haze_2);
    }
    if (b.ground_seen) {
      const Floats from_middle = x - 0.5f * float(width_ - 1);
      rise = clamped(-down, 0, INFINITY);
      rise = rise * rise / (row_2 + pixel_2 * from_middle * from_middle);
    }
    for (int i = 0; i < count; ++i) {
      Floats pixel_rgba;
      std::memcpy(&pixel_rgba, block + 4 * i, sizeof pixel_rgba);
      const float open = 1 - pixel_rgba[3];
      const Floats shade = key_share * key[i] + sky_share * sky[i];
      if (b.transparent)
        pixel_rgba[3] += open * shown[i] * std::max(shade[1], 0.0f);
      else if (!b.ground_seen)
        pixel_rgba = over(pixel_rgba, open, upright);
      else if (down[i] > 1e-6f) {
        const Floats floor = far_ground + shown[i] * (ground - ground * shade - far_ground);
        pixel_rgba = over(pixel_rgba, open, floor + haze[i] * (bottom - floor));
      } else
        pixel_rgba = over(pixel_rgba, open, bottom + std::min(rise[i] * sky_rise, 1.0f) * (top - bottom));
      std::memcpy(block + 4 * i, &pixel_rgba, sizeof pixel_rgba);
    }
  }
}

}  // namespace limber::render::detail
