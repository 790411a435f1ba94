#include "plan/tree.h"

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/hash.h"
#include "plan/detail/hash_control.h"

namespace limber::plan {

int Tree::add(const State& state, int parent, const Control& control, std::int64_t iteration,
              const Vec3f& center) {
  states.push_back(state, parent);
  parents.push_back(parent);
  controls.push_back(control);
  iterations.push_back(iteration);
  centers.push_back(center);
  return size() - 1;
}

float squared_distance(const Vec3f& a, const Vec3f& b) {
  const float x = a.x() - b.x(), y = a.y() - b.y(), z = a.z() - b.z();
  return x * x + y * y + z * z;
}

// Every lane keeps the best of its own columns, so the inner loop is branch-free and the compiler vectorises
// it.
int nearest(const Centers& centers, const Vec3f& point) {
  LIMBER_CHECK(centers.size() > 0, centers.size());
  constexpr int lanes = 8;
  float best[lanes];
  std::int32_t block[lanes] = {};
  std::fill(best, best + lanes, std::numeric_limits<float>::infinity());
  const float px = point.x(), py = point.y(), pz = point.z();
  const int blocks = centers.size() / lanes;
  for (std::int32_t b = 0; b < blocks; ++b) {
    const float* xs = centers.x.data() + std::ptrdiff_t(b) * lanes;
    const float* ys = centers.y.data() + std::ptrdiff_t(b) * lanes;
    const float* zs = centers.z.data() + std::ptrdiff_t(b) * lanes;
    for (int l = 0; l < lanes; ++l) {
      const float x = xs[l] - px, y = ys[l] - py, z = zs[l] - pz;
      const float d = x * x + y * y + z * z;
      block[l] = d < best[l] ? b : block[l];
      best[l] = d < best[l] ? d : best[l];
    }
  }
  int winner = 0;
  float least = std::numeric_limits<float>::infinity();
  const auto offer = [&](int i, float d) {
    if (d < least || (d == least && i < winner)) winner = i, least = d;
  };
  for (int l = 0; l < lanes && blocks > 0; ++l) offer(block[l] * lanes + l, best[l]);
  for (int i = blocks * lanes; i < centers.size(); ++i) offer(i, squared_distance(centers[i], point));
  return winner;
}

std::vector<int> path_to(const Tree& tree, int node) {
  std::vector<int> path;
  for (int i = node; i >= 0; i = tree.parents[std::size_t(i)]) path.push_back(i);
  std::reverse(path.begin(), path.end());
  return path;
}

std::uint64_t hash_of(const Tree& tree) {
  Hasher hasher;
  hasher.value(std::int64_t(tree.size()));
  for (int i = 0; i < tree.size(); ++i) hasher.value(limber::hash_of(tree.states[std::size_t(i)]));
  hasher.values(std::span<const std::int32_t>(tree.parents));
  hasher.values(std::span<const std::int64_t>(tree.iterations));
  for (const Control& control : tree.controls) detail::hash_control(hasher, control);
  for (const auto* axis : {&tree.centers.x, &tree.centers.y, &tree.centers.z})
    hasher.values(std::span<const float>(*axis));
  return hasher.digest();
}

std::uint64_t hash_of_search(const Tree& tree) {
  Hasher hasher;
  for (int n = 0; n < tree.size(); ++n) {
    const auto i = std::size_t(n);
    if (tree.iterations[i] < 0) continue;
    hasher.value(n).value(limber::hash_of(tree.states[i])).value(tree.parents[i]).value(tree.iterations[i]);
    detail::hash_control(hasher, tree.controls[i]);
    hasher.values(std::span<const float>(tree.centers[n].data(), 3));
  }
  return hasher.digest();
}

}  // namespace limber::plan
