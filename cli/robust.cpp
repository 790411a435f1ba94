#include <fmt/format.h>

#include <algorithm>

#include "cli/commands.h"

namespace limber::cli {

namespace {

Json json_of(const Fate& f) {
  return {{"world", f.world},
          {"reaches", f.reaches},
          {"end", f.end},
          {"distance_m", f.distance_m},
          {"speed_m_s", f.speed_m_s},
          {"duration_s", f.duration_s},
          {"end_center_m", f.end_center_m},
          {"largest_volume_change_percent", 100 * f.volume_change},
          {"deepest_penetration_m", f.penetration_m},
          {"least_stretch", f.min_stretch},
          {"largest_stretch", f.largest_stretch},
          {"deepest_overlap_m", f.overlap_m},
          {"deepest_self_overlap_m", f.self_overlap_m},
          {"largest_force_asked_n", f.asked_n},
          {"largest_force_n", f.force_n},
          {"broken_promises", f.broken}};
}

Json json_of(const Tally& tally) {
  const Fate& worst = tally.worst;
  Json rows = Json::array();
  for (const Fate& fate : tally.fates) rows.push_back(json_of(fate));
  return {{"reached", tally.reached},
          {"share_reached", double(tally.reached) / double(tally.fates.size())},
          {"end_spread_m", tally.spread_m},
          {"end_farthest_m", tally.farthest_m},
          {"largest_volume_change_percent", 100 * worst.volume_change},
          {"deepest_penetration_m", worst.penetration_m},
          {"least_stretch", worst.min_stretch},
          {"largest_stretch", worst.largest_stretch},
          {"deepest_overlap_m", worst.overlap_m},
          {"deepest_self_overlap_m", worst.self_overlap_m},
          {"largest_force_asked_n", worst.asked_n},
          {"largest_force_n", worst.force_n},
          {"keep_all_promises", tally.keep_all},
          {"broken_promises", tally.broken},
          {"replays", rows}};
}

std::string text_of(const Tally& tally, const RobustOptions& options, const Robustness& robust) {
  std::string text =
      "  world  end                      from the goal  speed       lasts   volume  stretch      overlap   "
      "of cages     force    promises\n";
  for (const Fate& f : tally.fates)
    text += fmt::format(
        "  {:5}  {:23}  {:8.3f} m     {:.4f} m/s  {:5.2f} s  {:5.2f} %  {:.2f} … {:.2f}  {:.4f} m  {:.4f} m  "
        "   "
        "{:5.4g} N  {}\n",
        f.world, f.end, f.distance_m, f.speed_m_s, f.duration_s, 100 * f.volume_change, f.min_stretch,
        f.largest_stretch, std::max(f.overlap_m, f.self_overlap_m), f.penetration_m, f.asked_n,
        f.broken.empty() ? "kept" : fmt::format("{} broken", f.broken.size()));
  const Fate& worst = tally.worst;
  text += fmt::format(
      "{} of {} {} in the goal (worlds {}, materials ± {:g} %, forces ± {:g} %, turned by up to {:g} "
      "degrees, "
      "seed {})\n"
      "  end          {:.3f} m from the plan's (root mean square), at most {:.3f} m\n"
      "  volume       changes by at most {:.2f} %\n"
      "  stretch      within {:.3f} and {:.3f}\n"
      "  surfaces     overlap at most {:.4f} m, in themselves {:.4f} m\n"
      "  cages        in one another by at most {:.4f} m\n"
      "  force        asked for at most {:.4g} of {:.4g} N; what acted {:.4g} N\n"
      "  promises     all kept in {} of {}\n",
      tally.reached, tally.fates.size(), robust.settles ? "come to rest" : "end",
      std::min(options.perturbations, options.worlds), 100 * options.material_share,
      100 * options.force_share, options.force_deg, options.seed, tally.spread_m, tally.farthest_m,
      100 * worst.volume_change, worst.min_stretch, worst.largest_stretch, worst.overlap_m,
      worst.self_overlap_m, worst.penetration_m, worst.asked_n, robust.max_force_n, worst.force_n,
      tally.keep_all, tally.fates.size());
  for (const auto& [promise, times] : tally.broken)
    text += fmt::format("    broken in {}: {}\n", times, promise);
  return text;
}

}  // namespace

Outcome robust(const RobustOptions& options) {
  const Robustness robust = test_robustness(options, at_terminal());
  Json json{{"perturbations", options.perturbations},
            {"worlds", std::min(options.perturbations, options.worlds)},
            {"seed", options.seed},
            {"material_share", options.material_share},
            {"force_share", options.force_share},
            {"force_deg", options.force_deg},
            {"max_force_n", robust.max_force_n}};
  json.update(json_of(robust.open_loop));
  std::string text = text_of(robust.open_loop, options, robust);
  if (robust.followed || robust.replanned) text = "open loop\n" + text;
  if (robust.followed) {
    json["followed"] = json_of(*robust.followed);
    text += "followed\n" + text_of(*robust.followed, options, robust);
  }
  if (robust.replanned) {
    json["replanned"] = json_of(*robust.replanned);
    json["replanned"]["searches"] = robust.replanned->searches;
    text += fmt::format("planned anew on the way, {} searches\n{}", robust.replanned->searches,
                        text_of(*robust.replanned, options, robust));
  }
  return {exit_done, json, text};
}

}  // namespace limber::cli
