#include "limber/authoring.h"

#include "limber/detail/authoring/new_scene.h"
#include "limber/detail/authoring/scene_check.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

NewScene make_scene(const NewSceneOptions& options, const Context& context) {
  return detail::working_for(context, [&] { return detail::new_scene(options); });
}

SceneFindings examine_scene(const SceneCheckOptions& options, const Context& context) {
  return detail::working_for(context, [&] { return detail::check_scene(options); });
}

}  // namespace limber
