// Runs a function in a process of its own, for libraries that may crash or never come back on a damaged file.
#pragma once

#include <functional>
#include <string>

namespace limber::meshing::detail {

struct OwnProcessResult {
  bool finished = false;
  std::string bytes;  // finished: what the function returned; else why it did not, as an end of a sentence
};

// `work` runs in a forked copy of this process: it may read everything, and change nothing here. It must not
// need other threads, and what it prints is lost. An exception in it counts as not finished, with its text.
// Stopped after `cpu_seconds` of its own time, five times that and a minute by the clock, or when it takes
// three quarters of the machine's memory. Throws Interrupted when a stop signal came meanwhile.
OwnProcessResult run_in_own_process(const std::function<std::string()>& work, int cpu_seconds);

}  // namespace limber::meshing::detail
