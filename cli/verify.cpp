#include <fmt/format.h>

#include "cli/commands.h"

namespace limber::cli {

namespace {

// What scene it is that all is derived from.
std::string text_of(const Verdict::Scene& scene) {
  std::string edits;
  for (const std::string& set : scene.sets) edits += " --set " + set;
  return fmt::format("a plan of scene {} (hash of its text {}){}\n", scene.name, scene.text_hash,
                     edits.empty() ? "" : ", edited by" + edits);
}

std::string text_of_motion(const Json& motion) {
  return fmt::format(
      "largest strain {:.3f} ({}), strongest contact {:.1f} N ({})\n",
      motion.at("largest_strain").get<double>(), motion.at("largest_strain_of").get<std::string>(),
      motion.at("largest_contact_force_n").get<double>(), motion.at("contact_between").get<std::string>());
}

std::string text_of(const Verdict& verdict, const Json& motion) {
  std::string text;
  if (verdict.scene) text += text_of(*verdict.scene);
  for (const Promise& p : verdict.promises)
    text += fmt::format("  {:6}  {:48}  {}\n", p.kept ? "kept" : "BROKEN", p.name, p.value);
  for (const Finding& f : verdict.measured)
    text += fmt::format("  {:8}{:48}  {}\n", "found", f.what, f.value);
  if (!motion.is_null()) text += text_of_motion(motion);
  return text + (verdict.all_kept ? "every promise is kept\n" : "not every promise is kept\n");
}

Json json_of(const Verdict& verdict, const Json& motion) {
  Json promises = Json::array(), measured = Json::array(), scene;
  for (const Promise& p : verdict.promises)
    promises.push_back({{"promise", p.name}, {"kept", p.kept}, {"value", p.value}});
  for (const Finding& f : verdict.measured) measured.push_back({{"what", f.what}, {"value", f.value}});
  if (verdict.scene)
    scene = {
        {"name", verdict.scene->name}, {"hash", verdict.scene->text_hash}, {"sets", verdict.scene->sets}};
  return {{"all_kept", verdict.all_kept},
          {"promises", promises},
          {"measured", measured},
          {"motion", motion},
          {"scene", scene}};
}

}  // namespace

Outcome verify(const VerifyOptions& options) {
  const Verdict verdict = limber::verify(options, at_terminal());
  const Json motion = verdict.motion_json.empty() ? Json() : parse_json(verdict.motion_json, "motion");
  return {verdict.all_kept ? exit_done : exit_defect, json_of(verdict, motion), text_of(verdict, motion)};
}

}  // namespace limber::cli
