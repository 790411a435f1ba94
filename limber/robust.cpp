#include "limber/robust.h"

#include "limber/detail/interface/working_for.h"
#include "limber/detail/verify/robustness.h"

namespace limber {

Robustness test_robustness(const RobustOptions& options, const Context& context) {
  return detail::working_for(context, [&] { return detail::robust(options); });
}

}  // namespace limber
