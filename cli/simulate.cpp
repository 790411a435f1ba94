#include <fmt/format.h>

#include "cli/kept_plan.h"

namespace limber::cli {

namespace {

std::string text_of_following(const Json& follows, const fs::path& folder) {
  return fmt::format(
      "  follows      {}; at most {:.3f} m from its path, with at most {:.4g} N\n"
      "  goal         {}: {:.3f} m from it at {:.4f} m/s\n",
      folder.string(), follows.at("farthest_from_path_m").get<double>(),
      follows.at("largest_force_n").get<double>(),
      follows.at("reaches").get<bool>() ? "reached" : "not reached", follows.at("distance_m").get<double>(),
      follows.at("speed_m_s").get<double>());
}

}  // namespace

Outcome simulate(const SimulateOptions& options) {
  return outcome_of(simulate_scene(options, at_terminal()), [&](const Json& summary) {
    return options.follow.empty() ? text_of_beginning(summary, options.from)
                                  : text_of_following(summary.at("follows"), options.follow);
  });
}

}  // namespace limber::cli
