// limber once more, in a process of its own, with an end to its time and memory.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace limber::detail {

struct ProcessLimits {
  double cpu_s, clock_s;
  double memory_mb;
};

struct EndedProcess {
  enum Reason { exited, out_of_time, out_of_memory, crashed } reason = exited;
  int code = 0;  // exit code, or the number of the signal that ended it
  double cpu_s = 0, clock_s = 0, peak_mb = 0;
  std::string out, err;  // what it said; of stderr the end
};

// It ends with this process, however that ends.
class LimitedProcess {
 public:
  LimitedProcess(const std::vector<std::string>& words, const ProcessLimits&);
  ~LimitedProcess();  // kills it where it still runs
  LimitedProcess(const LimitedProcess&) = delete;
  LimitedProcess& operator=(const LimitedProcess&) = delete;

  // Nothing while it runs. Ends it when it is over a limit, so ask a few times a second at least.
  std::optional<EndedProcess> ended();
  void stop();  // SIGTERM; it ends soon

 private:
  double clock_s() const;
  ProcessLimits limits_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  int pid_ = -1, out_ = -1, err_ = -1;
  EndedProcess::Reason over_ = EndedProcess::exited;
  double memory_asked_s_ = 0;
};

}  // namespace limber::detail
