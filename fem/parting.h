// How far bodies that overlap at the start are parted (docs/contact.md, "Overlap at the start").
#pragma once

namespace limber::fem {

// No deeper than that share of the smaller one's size, the longest edge of its surface's box: beyond, the
// nearest way out leads anywhere.
inline constexpr double deepest_parted_share = 0.25;

}  // namespace limber::fem
