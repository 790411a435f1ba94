#include "limber/detail/verify/verify.h"

#include <fmt/format.h>

#include "cli/commands.h"

namespace limber::cli {

namespace {

// What scene it is that all is derived from.
std::string text_of(const detail::Verified::Scene& scene) {
  std::string edits;
  for (const std::string& set : scene.sets) edits += " --set " + set;
  return fmt::format("a plan of scene {} (hash of its text {}){}\n", scene.name, scene.text_hash,
                     edits.empty() ? "" : ", edited by" + edits);
}

std::string text_of(const detail::Verified& verified) {
  std::string text;
  if (verified.scene) text += text_of(*verified.scene);
  for (const Promise& p : verified.promises.rows())
    text += fmt::format("  {:6}  {:48}  {}\n", p.kept ? "kept" : "BROKEN", p.name, p.value);
  for (const detail::Finding& f : verified.promises.measured())
    text += fmt::format("  {:8}{:48}  {}\n", "found", f.what, f.value);
  if (verified.motion)
    text += fmt::format("largest strain {:.3f} ({}), strongest contact {:.1f} N ({})\n",
                        verified.motion->largest_strain, verified.motion->largest_strain_of,
                        verified.motion->largest_contact_force_n, verified.motion->contact_between);
  return text + (verified.promises.all_kept() ? "every promise is kept\n" : "not every promise is kept\n");
}

Json json_of(const detail::Verified& verified) {
  Json promises = Json::array(), measured = Json::array(), motion, scene;
  for (const Promise& p : verified.promises.rows())
    promises.push_back({{"promise", p.name}, {"kept", p.kept}, {"value", p.value}});
  for (const detail::Finding& f : verified.promises.measured())
    measured.push_back({{"what", f.what}, {"value", f.value}});
  if (verified.motion) motion = detail::json_of(*verified.motion);
  if (verified.scene)
    scene = {
        {"name", verified.scene->name}, {"hash", verified.scene->text_hash}, {"sets", verified.scene->sets}};
  return {{"all_kept", verified.promises.all_kept()},
          {"promises", promises},
          {"measured", measured},
          {"motion", motion},
          {"scene", scene}};
}

}  // namespace

Outcome verify(const detail::VerifyOptions& options) {
  const detail::Verified verified = detail::verify(options);
  return {verified.promises.all_kept() ? exit_done : exit_defect, json_of(verified), text_of(verified)};
}

}  // namespace limber::cli
