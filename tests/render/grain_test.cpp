// The reliefs of materials, by what a slope is.
#include "render/detail/grain.h"

#include <gtest/gtest.h>

namespace limber::render::detail {
namespace {

// Slopes of a height that repeats: along each line of cells they add up to nothing.
TEST(Grain, RepeatsWithoutASeam) {
  for (const bool woven : {false, true}) {
    const std::vector<std::uint8_t> levels = grain_slopes(woven);
    constexpr int n = grain_cells;
    ASSERT_EQ(levels.size(), std::size_t(4 * n * n * n));
    int steepest = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int line = 0; line < n * n; ++line) {
        int sum = 0;
        for (int i = 0; i < n; ++i) {
          int cell[3];
          cell[axis] = i, cell[(axis + 1) % 3] = line % n, cell[(axis + 2) % 3] = line / n;
          const int slope = levels[std::size_t(4 * ((cell[2] * n + cell[1]) * n + cell[0]) + axis)] - 128;
          sum += slope, steepest = std::max(steepest, std::abs(slope));
        }
        ASSERT_LE(std::abs(sum), n / 2) << woven << ' ' << axis << ' ' << line;  // half a level a cell
      }
    EXPECT_EQ(steepest, 127);
  }
}

}  // namespace
}  // namespace limber::render::detail
