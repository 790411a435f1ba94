// A call of the library, for as long as it lasts: what would otherwise be the process' own, its threads, its
// progress, its wish to stop. Threads without a job work for the program at the terminal.
#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "limber/watcher.h"

namespace limber {

class Job {
 public:
  explicit Job(const Context&);  // threads ≥ 0
  int threads() const { return threads_; }
  void progress(const std::string& stage, std::int64_t done, std::int64_t total, const std::string& note);
  void warn(const std::string& text);
  bool stopped();  // once it is true it stays so
  std::atomic<int> with_nothing_to_keep{0};

 private:
  Watcher* watcher_;
  int threads_;
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
};

// Of the program at the terminal: who calls the library with it has no job.
Context at_terminal();
bool is_at_terminal(const Context&);

// Of this thread; nullptr: none. Whoever starts threads hands it on to them.
Job* current_job();

class WorkingFor {
 public:
  explicit WorkingFor(Job*);
  ~WorkingFor();
  WorkingFor(const WorkingFor&) = delete;
  WorkingFor& operator=(const WorkingFor&) = delete;

 private:
  Job* before_;
};

}  // namespace limber
