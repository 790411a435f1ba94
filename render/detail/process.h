// Another program, fed through its standard input; what it says on standard error is kept for our own
// message.
#pragma once

#include <string>
#include <vector>

namespace limber::render::detail {

class Process {
 public:
  // argv[0] is looked up in PATH. Throws InputError when there is no such program.
  explicit Process(const std::vector<std::string>& argv);
  ~Process();  // one that still runs is told to end (SIGTERM) and waited for
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  bool write(const void* bytes, std::size_t size);  // false: it takes no more
  int finish();              // closes its input and waits; its exit code, or 128 + signal
  std::string said() const;  // its standard error so far

 private:
  int input_ = -1, errors_ = -1;
  int pid_ = -1;  // -1: has ended
};

}  // namespace limber::render::detail
