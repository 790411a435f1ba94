#include "meshing/detail/box_tree.h"

#include <algorithm>
#include <numeric>

namespace limber::meshing::detail {
namespace {
constexpr int box_leaf_size = 4;
}

BoxTree::BoxTree(const std::vector<Box>& boxes) : things_(boxes.size()) {
  std::iota(things_.begin(), things_.end(), 0);
  nodes_.reserve(boxes.size());
  nodes_.push_back({Box{}, -1, 0, int(boxes.size())});
  for (std::size_t node = 0; node < nodes_.size(); ++node) split(int(node), boxes);
}

void BoxTree::split(int node, const std::vector<Box>& boxes) {
  const int first = nodes_[node].first, last = nodes_[node].last;
  Box all, centers;
  for (int i = first; i < last; ++i) {
    all.include(boxes[things_[i]]);
    centers.include(boxes[things_[i]].center());
  }
  nodes_[node].box = all;
  if (last - first <= box_leaf_size) return;
  int axis;
  centers.size().maxCoeff(&axis);
  const int middle = (first + last) / 2;
  std::nth_element(things_.begin() + first, things_.begin() + middle, things_.begin() + last,
                   [&](int a, int b) {
                     const double ca = boxes[a].lower[axis] + boxes[a].upper[axis],
                                  cb = boxes[b].lower[axis] + boxes[b].upper[axis];
                     return ca != cb ? ca < cb : a < b;
                   });
  nodes_[node].left = int(nodes_.size());
  nodes_.push_back({Box{}, -1, first, middle});
  nodes_.push_back({Box{}, -1, middle, last});
}

}  // namespace limber::meshing::detail
