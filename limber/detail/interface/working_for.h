// Runs a call of the interface on behalf of whoever makes it.
#pragma once

#include "core/job.h"

namespace limber::detail {

template <class F>
auto working_for(const Context& context, F&& call) {
  if (is_at_terminal(context)) return call();
  Job job(context);
  const WorkingFor working(&job);
  return call();
}

}  // namespace limber::detail
