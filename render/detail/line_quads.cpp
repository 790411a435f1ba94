// Each segment is cut in clip space, by the near plane, far out of the picture, and by the planes that open
// bodies, before it is divided by w: an end behind the eye has no place on the screen. Then the quad is made
// in samples of the screen, along ± the normal of what is left, and goes back to clip space with the w of
// each end, so that depths stay those of the line.
#include "render/detail/line_quads.h"

#include <algorithm>

namespace limber::render::detail {

namespace {

// What is left of a segment, as shares of the way from its first end to its second.
struct Span {
  double from = 0, to = 1;
  // a, b: signed distances of the ends from a plane; what is below zero goes.
  void keep_above(double a, double b) {
    if (a <= 0 && b <= 0) to = -1;
    const double crossing = a / (a - b);
    if (a <= 0 && b > 0) from = std::max(from, crossing);
    if (a > 0 && b <= 0) to = std::min(to, crossing);
  }
};

}  // namespace

void line_quads(const Points& ends, const Screen& screen, double width_samples,
                std::span<const Eigen::Vector4d> planes, std::vector<float>& corners) {
  const Eigen::Vector2d half = 0.5 * screen.size;
  const double reach = 0.5 * width_samples + 0.5;
  corners.clear();
  for (Eigen::Index i = 0; i + 1 < ends.rows(); i += 2) {
    const Eigen::Vector4d first = Vec3(ends.row(i)).homogeneous(),
                          second = Vec3(ends.row(i + 1)).homogeneous();
    const Eigen::Vector4d clip_first = screen.clip_from_world * first,
                          clip_second = screen.clip_from_world * second;
    Span left;
    left.keep_above(clip_first.z() + clip_first.w(), clip_second.z() + clip_second.w());  // the near plane
    for (int axis = 0; axis < 2; ++axis) {  // as far again as the picture reaches, and the line's width
      const double margin = 2 + reach / half[axis];
      for (const double side : {-1.0, 1.0})
        left.keep_above(margin * clip_first.w() + side * clip_first[axis],
                        margin * clip_second.w() + side * clip_second[axis]);
    }
    for (const Eigen::Vector4d& plane : planes) left.keep_above(plane.dot(first), plane.dot(second));
    if (!(left.from < left.to)) continue;
    const Eigen::Vector4d a = clip_first + left.from * (clip_second - clip_first),
                          b = clip_first + left.to * (clip_second - clip_first);
    const Eigen::Vector2d along = (b.head<2>() / b.w() - a.head<2>() / a.w()).cwiseProduct(half);
    if (!(along.norm() > 1e-9)) continue;  // it points at the eye
    const Eigen::Vector2d across = Eigen::Vector2d(-along.y(), along.x()).normalized() * reach;
    const auto corner = [&](const Eigen::Vector4d& end, double side) {
      const Eigen::Vector2d moved = end.head<2>() + side * across.cwiseQuotient(half) * end.w();
      corners.insert(corners.end(), {float(moved.x()), float(moved.y()), float(end.z()), float(end.w()),
                                     float(side * reach)});
    };
    corner(a, -1), corner(b, -1), corner(b, 1);
    corner(a, -1), corner(b, 1), corner(a, 1);
  }
}

}  // namespace limber::render::detail
