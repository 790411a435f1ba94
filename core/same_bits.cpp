#include "core/same_bits.h"

#include <cstring>

namespace limber {

bool same_bits(const State& a, const State& b) {
  const auto same = [](const std::vector<float>& one, const std::vector<float>& other) {
    return one.size() == other.size() &&
           (one.empty() || std::memcmp(one.data(), other.data(), one.size() * sizeof(float)) == 0);
  };
  return a.step == b.step && same(a.positions, b.positions) && same(a.velocities, b.velocities);
}

bool same_bits(const Vec3f& a, const Vec3f& b) { return std::memcmp(a.data(), b.data(), sizeof(Vec3f)) == 0; }

bool same_bits(const Control& a, const Control& b) {
  const auto same = [](float one, float other) { return std::memcmp(&one, &other, sizeof one) == 0; };
  return a.manipulation == b.manipulation && a.node == b.node && a.steps == b.steps &&
         a.second_node == b.second_node && same_bits(a.second_force_n, b.second_force_n) &&
         same_bits(a.force_n, b.force_n) && same_bits(a.target_m, b.target_m) &&
         same(a.radius_m, b.radius_m) && same(a.max_force_n, b.max_force_n) &&
         same(a.pressure_pa, b.pressure_pa);
}

}  // namespace limber
