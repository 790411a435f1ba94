#include "limber/robust.h"

#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"
#include "limber/detail/verify/robustness.h"

namespace limber {

Robustness test_robustness(const RobustOptions& options, const Context& context) {
  using detail::require_in;
  require_in("perturbations", options.perturbations, 1, 10'000);
  require_in("seed", options.seed, 0, std::uint64_t{1} << 53);
  require_in("material_share", options.material_share, 0, 0.9);
  require_in("force_share", options.force_share, 0, 0.9);
  require_in("force_deg", options.force_deg, 0, 90);
  if (options.replan_s != 0) require_in("replan_s", options.replan_s, 0.01, 60);
  require_in("worlds", options.worlds, 1, 10'000);
  return detail::working_for(context, [&] { return detail::robust(options); });
}

}  // namespace limber
