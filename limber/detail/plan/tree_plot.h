// A picture of the tree in the workspace: from above and from the side.
#pragma once

#include <string>

#include "fem/world.h"
#include "plan/search.h"
#include "scenes/scene.h"

namespace limber::detail {

// An SVG document: bounds and obstacles where they start, edges between centres of mass, the path to the best
// node as it is simulated, start and goal. Of a large tree at most some 4,000 edges are drawn, evenly through
// it.
std::string tree_svg(const scenes::Scene&, const fem::World&, const plan::Plan&);

}  // namespace limber::detail
