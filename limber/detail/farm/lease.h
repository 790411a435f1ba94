// Who does which unit of work, where many processes on many machines share a folder and nothing else.
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "core/file.h"

namespace limber::detail {

// While it lives the unit is this process's. Its file is UNIT.N, which only one can create: the N-th who
// takes the unit. A number in it counts on every few seconds. Given back when it goes; a process that is
// killed leaves it.
class Lease {
 public:
  Lease(fs::path folder, std::string unit, int taken, std::string owner);
  ~Lease();
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

 private:
  void write_beat();
  fs::path folder_, file_;
  std::string unit_, owner_;
  int taken_;
  long beat_ = 0;
  std::mutex mutex_;
  std::condition_variable ends_;
  bool ended_ = false;
  std::thread heart_;
};

// The leases of a folder as one process sees them over time. A lease is lost when its process has ended,
// where that can be known (core/temporary_files.h), else when its number has not changed while this process
// has looked on for `patience_s`: no clock of another machine counts. Should an owner be taken for lost that
// only slept, a unit is done twice.
class Leases {
 public:
  explicit Leases(fs::path folder, double patience_s = usual_patience_s);

  static constexpr double usual_patience_s = 45, between_beats_s = 3;

  struct Seen {
    int taken = 0;  // times
    bool lost = false;
    std::string owner;  // "HOST" or "HOST, job 17_3"
  };
  // By unit; of units that nobody holds there is none.
  std::map<std::string, Seen> look();
  // Of a unit that nobody holds, or of a lost lease. Nothing where somebody else was quicker.
  std::unique_ptr<Lease> take(const std::string& unit, const Seen* lost = nullptr);

  // Somebody who looks once, and cannot wait: lost by the time of the file where nothing else tells.
  static std::map<std::string, Seen> look_once(const fs::path& folder);

 private:
  using Clock = std::chrono::steady_clock;
  struct Content {
    std::string text;
    Clock::time_point since;
  };
  fs::path folder_;
  double patience_s_;
  std::map<fs::path, Content> contents_;
};

// "HOST", and within a scheduler's job "HOST, job 17_3".
std::string this_worker();

}  // namespace limber::detail
