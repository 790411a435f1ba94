// Runs a call of the interface on behalf of whoever makes it.
#pragma once

#include <string>

#include "core/job.h"

namespace limber::detail {

// For what starts this program once more: throws InputError in another than limber's, which is to run the
// command.
void require_limber_itself(const Context&, const std::string& command);

template <class F>
auto working_for(const Context& context, F&& call) {
  if (is_at_terminal(context)) return call();
  Job job(context);
  const WorkingFor working(&job);
  return call();
}

}  // namespace limber::detail
