// How long a list of what is near may be used, by how far all has moved since it was made.
#pragma once

namespace limber::fem::detail::list_margins {

// Share of a distance that movement may use up, and of the reach, by which less; the rest is for rounding.
// And what is farther than this share of the reach is apart, however it is computed.
inline constexpr float kept = 0.9f, rounding = 0.02f, certain = 0.004f;

}  // namespace limber::fem::detail::list_margins
