// What colours may mean: a number at each node of the cages.
#pragma once

#include <vector>

#include "fem/world.h"
#include "scenes/scene.h"

namespace limber::detail {

// (World::nodes); 0 at nodes of static bodies. strain: von Mises, the mean of the adjacent tets by their
// volume; volume: V/V₀ − 1, likewise; penetration: the depth of the deepest contact that has this node of its
// body nearest, metres; speed: m/s. ColorBy::body has none.
std::vector<double> node_values(const fem::World&, const State&, scenes::ColorBy);

const char* caption_of(scenes::ColorBy);  // "von Mises strain"

}  // namespace limber::detail
