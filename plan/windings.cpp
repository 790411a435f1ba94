#include "plan/windings.h"

#include <algorithm>
#include <cstdlib>

namespace limber::plan {

void wind(Windings& windings, std::span<const Hole> holes, const Vec3& from, const Vec3& to) {
  std::vector<std::pair<double, int>> passed;  // (share of the segment, letter)
  for (std::size_t h = 0; h < holes.size(); ++h) {
    const double before = (from - holes[h].middle_m).dot(holes[h].normal),
                 after = (to - holes[h].middle_m).dot(holes[h].normal);
    if ((before < 0) == (after < 0)) continue;
    const double share = before / (before - after);
    if ((from + share * (to - from) - holes[h].middle_m).norm() < holes[h].radius_m)
      passed.emplace_back(share, before < 0 ? int(h) + 1 : -int(h) - 1);
  }
  std::sort(passed.begin(), passed.end());
  for (const auto& [share, letter] : passed)
    if (!windings.empty() && windings.back() == -letter)
      windings.pop_back();
    else
      windings.push_back(letter);
}

int pieces_in(const Windings& windings, int hole) {
  return int(std::count_if(windings.begin(), windings.end(),
                           [&](int letter) { return std::abs(letter) == hole + 1; }));
}

bool hangs_as_asked(const Windings& windings, std::span<const Hole> holes) {
  for (std::size_t h = 0; h < holes.size(); ++h)
    if (pieces_in(windings, int(h)) != holes[h].pieces) return false;
  return true;
}

}  // namespace limber::plan
