// Where organs go whose surfaces overlap: in an atlas organs touch, and some are a little in one another.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/contact_shape.h"

namespace limber::detail {

struct LaidBody {
  std::shared_ptr<const ContactShape> shape;
  bool held = false;  // stays where it is
};

// The way that each body goes until all surfaces are `room_m` apart, or as far as they are where they begin,
// but for two that are held; nothing when one would go farther than `reach_m`. (In a scan each vessel has its
// tunnel through an organ, in which there is no more room than the gap between labels.) First each two that
// are nearer part by half the shortest way each, round after round; then each goes back as far as there is
// room. Same input, same result.
// `stuck`: the two that were deepest in one another when it gave up.
std::optional<std::vector<Vec3>> ways_apart(std::vector<LaidBody>, double room_m, double reach_m,
                                            std::pair<std::size_t, std::size_t>* stuck = nullptr);

// How much nearer than `room_m` two surfaces are when one stands at `way_m` from where its shape has it: 0
// where they are not; and the shortest way, of that length, by which the first gets off.
struct Nearness {
  double depth_m = 0;
  Vec3 way_m = Vec3::Zero();
};
Nearness nearness(const ContactShape& one, const Vec3& way_of_one_m, const ContactShape& other,
                  const Vec3& way_of_other_m, double room_m);

}  // namespace limber::detail
