// What limber throws, beside std::bad_alloc where memory ends. Trouble goes to whoever can fix it: who calls
// (InputError, DiskError), or us (InternalError).
#pragma once

#include <stdexcept>

#include "limber/export.h"

namespace limber {

// Something that was given is wrong. The text says what, where (file, line, element), and what to try.
struct LIMBER_API InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The disk refused: full, read-only, no permission, vanished.
struct LIMBER_API DiskError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A signal arrived, or a Watcher said stop; what was finished is kept.
struct LIMBER_API Interrupted : std::runtime_error {
  explicit Interrupted(int signal_number);
  int signal_number;  // as of <csignal>; by_watcher: no signal
  static constexpr int by_watcher = -1;
};

// A defect of ours.
struct LIMBER_API InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

}  // namespace limber
