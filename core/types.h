// The arrays that all modules share. Row-major, so that row i is element i in memory, in files, and in numpy.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace limber {

using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;   // (N × 3), metres
using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;   // (F × 3), rows of a Points
using Tets = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;        // (T × 4), rows of a Points
using Weights = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;  // (V × 4), barycentric

}  // namespace limber
