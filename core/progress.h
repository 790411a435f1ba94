// A bar on stderr when that is a terminal and logging is not quiet; else nothing. And the wish to stop. Where
// several threads have one at once, the line is the first thread's until that has none any more.
#pragma once

#include <cstdint>
#include <string>

namespace limber {

class Progress {
 public:
  Progress(std::string label, std::int64_t total);  // total 0: unknown
  ~Progress();                                      // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  // Cheap: redraws at most ten times a second. `share` of the work that is done, for the estimate, where it
  // is not that of the number.
  void update(std::int64_t done, const std::string& note = {}, double share = -1);

 private:
  std::string label_;
  std::int64_t total_;
  int owner_;  // the thread that made it; others may update it, one at a time
  double started_, drawn_at_ = -1;
};
void set_progress_enabled(bool);  // false: never draw

// While one lives, what this thread begins is told with its name before it: "heart: decompose".
class ProgressOf {
 public:
  explicit ProgressOf(std::string name);
  ~ProgressOf();
  ProgressOf(const ProgressOf&) = delete;
  ProgressOf& operator=(const ProgressOf&) = delete;

 private:
  std::string before_;
};

// SIGINT and SIGTERM set a flag; a second one ends the process.
void install_stop_signals();
int stop_signal();        // 0, or the number of the signal that arrived
void request_stop(int);   // for tests
void throw_if_stopped();  // throws Interrupted

// While one lives, a stop signal ends by Interrupted what would else be finished first, to be kept.
class NothingToKeep {
 public:
  NothingToKeep();
  ~NothingToKeep();
  NothingToKeep(const NothingToKeep&) = delete;
  NothingToKeep& operator=(const NothingToKeep&) = delete;
};
bool nothing_to_keep();

// Seconds of CPU time used by this process and by those it has waited for, and its own peak memory.
double cpu_seconds();
double peak_memory_mb();

}  // namespace limber
