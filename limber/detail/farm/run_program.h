// Other programs, and limber once more.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"

namespace limber::detail {

struct RanProgram {
  int code = 0;  // 128 + the number of the signal that ended it
  std::string out, err;
};
// Waits until it ends, at most `patience_s`, then it is killed. Throws InputError where it cannot be started
// or does not end.
RanProgram run_program(const std::vector<std::string>& words, double patience_s = 120);

// limber once more, which ends with this process; what it says goes to the end of a file.
class ChildWorker {
 public:
  ChildWorker(const std::vector<std::string>& words, const fs::path& log);
  ~ChildWorker();  // kills it where it still runs
  ChildWorker(const ChildWorker&) = delete;
  ChildWorker& operator=(const ChildWorker&) = delete;
  bool ended();                       // asks
  int code() const { return code_; }  // of one that has ended, as of RanProgram
  void stop();                        // SIGTERM

 private:
  int pid_ = -1, code_ = 0;
};

}  // namespace limber::detail
