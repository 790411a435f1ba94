// How limber's process ends: what the program says, and what a batch hears from those that it starts.
#pragma once

namespace limber {

// docs/cli.md tells users.
enum ExitCode : int {
  exit_done = 0,
  exit_defect = 1,     // ours
  exit_bad_input = 2,  // or usage
  exit_no_plan = 3,    // the best one found is kept, and can be rendered
  exit_frames_failed = 4,
  exit_disk = 5,
  exit_models_failed = 6,  // some of many; the others are prepared
  exit_signal = 128,       // plus the signal's number
};

// Of exit code 2.
inline constexpr const char* not_enough_memory =
    "the machine's memory is not enough for this; ask for fewer tets, shells or iterations";

}  // namespace limber
