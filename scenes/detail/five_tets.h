// A cell in the form of a box, cut in five tets: one in the middle, one at each of four corners. Neighbours
// are cut in the two mirrored ways and share the triangles of their faces. Corner c lies at (c & 1,
// c >> 1 & 1, c >> 2).
#pragma once

namespace limber::scenes {

inline constexpr int five_tets[2][5][4] = {
    {{0, 3, 5, 6}, {1, 0, 5, 3}, {2, 0, 3, 6}, {4, 0, 6, 5}, {7, 3, 5, 6}},   // where i + j + k is even
    {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}}};  // odd

}  // namespace limber::scenes
