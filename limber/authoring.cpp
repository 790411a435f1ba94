#include "limber/authoring.h"

#include "limber/detail/authoring/new_scene.h"
#include "limber/detail/authoring/scene_check.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

NewScene make_scene(const NewSceneOptions& options, const Context& context) {
  using detail::require_in;
  using detail::require_one_of;
  require_in("scale", options.scale, 1e-9, 1e9);
  require_in("shrink", options.shrink, 0.3, 1);
  if (options.fascia_hz != 0) require_in("fascia_hz", options.fascia_hz, 1, 30);
  require_in("tets", options.tets, 60, 20'000);
  require_one_of("goal", options.goal, {"", "front", "back", "left", "right", "up", "down"});
  for (const std::string& axis : {options.up, options.front})
    require_one_of("axis", axis, {"+x", "-x", "+y", "-y", "+z", "-z"});
  detail::require_label_surfaces_in_range(options);
  return detail::working_for(context, [&] { return detail::new_scene(options); });
}

SceneFindings examine_scene(const SceneCheckOptions& options, const Context& context) {
  return detail::working_for(context, [&] { return detail::check_scene(options); });
}

}  // namespace limber
