// Which of the numbers 0 … n − 1 hang together.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace limber {

// The root of a set is its lowest number.
class UnionFind {
 public:
  explicit UnionFind(int n) : parent_(std::size_t(n)) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[std::size_t(i)] != i)
      i = parent_[std::size_t(i)] = parent_[std::size_t(parent_[std::size_t(i)])];
    return i;
  }
  void join(int i, int j) {
    i = root(i), j = root(j);
    if (i != j) parent_[std::size_t(std::max(i, j))] = std::min(i, j);
  }

 private:
  std::vector<int> parent_;
};

}  // namespace limber
