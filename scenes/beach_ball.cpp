// A beach ball: panels between two caps, welded along grooves; its own images, made of integers.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "scenes/detail/plain_png.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

// Longitude and latitude, evenly. Panels and caps end between two pixels.
constexpr int width = 1152, height = 576, panels = 6, cap_rows = 38;
constexpr int groove = 9;  // pixels from its middle to its rim, where the image is not drawn out

using Color = std::array<std::uint8_t, 3>;
constexpr Color white{243, 240, 232}, red{209, 63, 72}, yellow{240, 180, 60}, blue{46, 120, 178};
constexpr std::array<Color, panels> color_of_panel{red, white, yellow, white, blue, white};

// What a pixel is to the nearest groove: 1024ths of its half width across it, east and north.
struct Across {
  std::int64_t east = 1024, north = 1024;
};

Across across(int x, int y) {
  // 1024 times the sine of a polar angle by Bhaskara I, within two: how much narrower a pixel is there. Four
  // rows have one width, so that most rows are as the one above.
  const std::int64_t a = y / 4 * 4 + 2, ab = a * (height - a);
  const std::int64_t sine = 1024 * 16 * ab / (5 * std::int64_t(height) * height - 4 * ab);
  const auto from = [](int pixel, int line) { return std::int64_t(2 * (pixel - line) + 1) * 512 / groove; };
  const auto clamped = [](std::int64_t d) { return std::clamp<std::int64_t>(d, -1024, 1024); };
  constexpr int panel = width / panels;
  Across result;
  if (y >= cap_rows && y < height - cap_rows)
    result.east = clamped(from(x, (x + panel / 2) / panel * panel) * sine / 1024);
  const bool above = y < height / 2;
  result.north = clamped(-from(y, above ? cap_rows : height - cap_rows));
  return result;
}

std::uint8_t as_level(std::int64_t component, std::int64_t length) {
  return std::uint8_t((component * 127 + length * 128) / length);
}

Picture colors_of_ball() {
  Picture picture{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool is_cap = y < cap_rows || y >= height - cap_rows;
      Color color = is_cap ? white : color_of_panel[std::size_t(x / (width / panels))];
      const Across d = across(x, y);
      const std::int64_t from_weld = std::min({std::int64_t(512), std::abs(d.east), std::abs(d.north)});
      for (std::uint8_t& level : color) level = std::uint8_t(level * (1024 + from_weld) / 1536);
      picture.rgb.insert(picture.rgb.end(), color.begin(), color.end());
    }
  return picture;
}

// A groove of depth (1 − d²)²: its slope is as d (1 − d²), 0 in its middle and at its rim.
Picture normals_of_ball() {
  Picture picture{width, height, {}};
  const auto slope = [](std::int64_t d) { return d * ((1 << 20) - d * d) >> 19; };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Across d = across(x, y);
      const std::int64_t east = -slope(d.east), north = -slope(d.north);
      const auto length = std::int64_t(std::sqrt(double(east * east + north * north + (1 << 20))));
      for (const std::int64_t component : {east, north, std::int64_t(1024)})
        picture.rgb.push_back(as_level(component, length));
    }
  return picture;
}

}  // namespace

SurfaceMesh make_beach_ball() { return make_sphere({1, 0.05}); }

Appearance beach_ball_appearance(const SurfaceMesh& ball) {
  // Its axis goes through vertices of make_sphere, and leans, so that panels and a cap are seen at once.
  const Vec3 pole = Vec3(0, -1, std::numbers::phi).normalized(), east = Vec3::UnitX(),
             north = pole.cross(east);
  Appearance a;
  a.uv.resize(3 * ball.triangles.rows(), 2);
  for (Eigen::Index t = 0; t < ball.triangles.rows(); ++t) {
    std::array<double, 3> u{};
    double sum = 0;
    int at_pole = -1;
    for (int c = 0; c < 3; ++c) {
      const Vec3 p = Vec3(ball.positions.row(ball.triangles(t, c))).normalized();
      a.uv(3 * t + c, 1) = 0.5 + std::asin(std::clamp(p.dot(pole), -1.0, 1.0)) / std::numbers::pi;
      if (std::abs(p.dot(pole)) > 1 - 1e-9) {
        at_pole = c;
        continue;
      }
      u[std::size_t(c)] = std::atan2(p.dot(north), p.dot(east)) / (2 * std::numbers::pi);
      // Together where the image is repeated.
      const int first = at_pole == 0 ? 1 : 0;
      u[std::size_t(c)] -= std::round(u[std::size_t(c)] - u[std::size_t(first)]);
      sum += u[std::size_t(c)];
    }
    if (at_pole >= 0) u[std::size_t(at_pole)] = sum / 2;
    const double whole = std::floor(*std::min_element(u.begin(), u.end()));
    for (int c = 0; c < 3; ++c) a.uv(3 * t + c, 0) = u[std::size_t(c)] - whole;
  }
  a.material_from_triangle.assign(std::size_t(ball.triangles.rows()), 0);
  a.materials = {{.name = "beach ball", .image = 0, .normal_image = 1}};
  a.images = {{"beach_ball.png", plain_png(colors_of_ball())},
              {"beach_ball_normals.png", plain_png(normals_of_ball())}};
  return a;
}

}  // namespace limber::scenes
