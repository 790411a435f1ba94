#include "meshing/detail/triangle_bvh.h"

#include <algorithm>
#include <numeric>

namespace limber::meshing::detail {

TriangleBvh build_triangle_bvh(const Points& positions, const Triangles& triangles, int leaf_size) {
  const int count = int(triangles.rows());
  Points centroids(count, 3);
  std::vector<Box> boxes(static_cast<std::size_t>(count));
  for (int t = 0; t < count; ++t) {
    for (int k = 0; k < 3; ++k) boxes[std::size_t(t)].include(positions.row(triangles(t, k)).transpose());
    centroids.row(t) =
        (positions.row(triangles(t, 0)) + positions.row(triangles(t, 1)) + positions.row(triangles(t, 2))) /
        3.0;
  }
  TriangleBvh bvh;
  bvh.order.resize(std::size_t(count));
  std::iota(bvh.order.begin(), bvh.order.end(), 0);
  if (count == 0) return bvh;
  bvh.nodes.push_back({{}, 0, count, -1, -1});
  for (std::size_t n = 0; n < bvh.nodes.size(); ++n) {
    const int begin = bvh.nodes[n].begin, end = bvh.nodes[n].end;
    Box box, centroid_box;
    for (int i = begin; i < end; ++i) {
      const int t = bvh.order[std::size_t(i)];
      box.include(boxes[std::size_t(t)]);
      centroid_box.include(centroids.row(t).transpose());
    }
    bvh.nodes[n].box = box;
    if (end - begin <= leaf_size) continue;
    int axis = 0;
    centroid_box.size().maxCoeff(&axis);
    const int middle = begin + (end - begin) / 2;
    std::nth_element(bvh.order.begin() + begin, bvh.order.begin() + middle, bvh.order.begin() + end,
                     [&](int a, int b) {
                       const double pa = centroids(a, axis), pb = centroids(b, axis);
                       return pa < pb || (pa == pb && a < b);
                     });
    bvh.nodes[n].left = int(bvh.nodes.size());
    bvh.nodes[n].right = int(bvh.nodes.size()) + 1;
    bvh.nodes.push_back({{}, begin, middle, -1, -1});
    bvh.nodes.push_back({{}, middle, end, -1, -1});
  }
  return bvh;
}

}  // namespace limber::meshing::detail
