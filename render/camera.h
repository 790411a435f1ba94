// Where the picture is taken from: one camera, one found for a box, or a path through keyframes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh.h"

namespace limber::render {

struct Camera {
  Vec3 eye = {0, -5, 2};  // metres
  Vec3 target = {0, 0, 0};
  Vec3 up = {0, 0, 1};  // any vector that is not along the view
  double fov_deg = 30;  // full angle from the bottom to the top of the picture, (0, 170)
};
// Throws InputError: a number that is not finite, eye = target, up along the view, angle out of range.
void validate(const Camera&);

using Mat4 = Eigen::Matrix4d;
// Camera axes: x to the right, y up, −z into the picture; metres.
Mat4 camera_from_world(const Camera&);
// OpenGL clip space; depths near_m … far_m come out as −w … w.
Mat4 clip_from_camera(double fov_deg, double aspect, double near_m, double far_m);
// Pixels from the left and the top of a picture of this size, and the depth in metres, of a point in front of
// the eye.
Vec3 pixel_from_world(const Camera&, const Vec3& point, int width, int height);

// The nearest camera, looking along −toward_eye, that has all points within the picture's middle `fill` (0 …
// 1) part. Exact: two opposite edges are touched. Pass the points of the whole motion: then it need not move.
Camera frame_automatically(const Points& everything, const Vec3& toward_eye, double aspect,
                           double fov_deg = 30, double fill = 0.88);
Camera frame_automatically(const Box& everything, const Vec3& toward_eye, double aspect, double fov_deg = 30,
                           double fill = 0.88);  // its 8 corners

struct CameraKey {
  double time_s;
  Camera camera;
};
// Cubic (Catmull-Rom) through the keys; before the first and after the last it rests.
// Throws InputError when there is no key or the times do not ascend.
Camera camera_at(const std::vector<CameraKey>&, double time_s);

// Walked round the target about the vertical, z, counter-clockwise seen from above.
Camera turned(const Camera&, double angle_deg);

}  // namespace limber::render
