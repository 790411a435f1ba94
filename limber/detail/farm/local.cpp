#include <unistd.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "limber/detail/farm/engines.h"
#include "limber/detail/farm/run_program.h"
#include "limber/exit_codes.h"

namespace limber::detail {

namespace {

constexpr int between_workers_us = 20000;
constexpr int max_crashes = 50;                 // of all workers together; a unit gives up long before
constexpr double patience_with_stopped_s = 20;  // with those that are told to stop: a search is kept
constexpr double between_counts_s = 0.5;

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

std::string last_line(const fs::path& file) {
  std::string text;
  try {
    text = read_file(file);
  } catch (const InputError&) {
    return "";
  }
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

class Workers {
 public:
  explicit Workers(const FarmFolder& farm)
      : farm_(farm), workers_(std::size_t(farm.spec().options.workers)) {}

  void run() {
    Progress progress("farm", 0);
    Clock::time_point counted = Clock::now();
    for (std::size_t w = 0; w < workers_.size(); ++w) start(w);
    while (any_runs()) {
      if (stop_signal() != 0 || farm_.is_cancelled()) {
        stop();
        throw_if_stopped();
        throw Interrupted(SIGTERM);
      }
      ::usleep(between_workers_us);
      for (std::size_t w = 0; w < workers_.size(); ++w) look_after(w);
      if (seconds_since(counted) > between_counts_s) tell(progress), counted = Clock::now();
    }
  }

 private:
  fs::path log_of(std::size_t w) const { return farm_.logs() / fmt::format("worker-{}.log", w + 1); }

  void start(std::size_t w) {
    workers_[w] = std::make_unique<ChildWorker>(
        std::vector<std::string>{"farm", "work", farm_.work().string(), "--wait", "--threads",
                                 std::to_string(farm_.spec().options.threads)},
        log_of(w));
  }

  bool any_runs() const {
    for (const auto& worker : workers_)
      if (worker) return true;
    return false;
  }

  void look_after(std::size_t w) {
    if (!workers_[w] || !workers_[w]->ended()) return;
    const int code = workers_[w]->code();
    workers_[w].reset();
    if (code == exit_disk) throw DiskError(last_line(log_of(w)));
    const bool crashed = code > exit_signal && code != exit_signal + SIGTERM && code != exit_signal + SIGINT;
    if (!crashed) return;
    log::warn("worker {} was ended by the signal {}; another goes on", w + 1, code - exit_signal);
    if (++crashes_ > max_crashes)
      throw InputError(
          fmt::format("workers were killed or crashed {} times; see {}", crashes_, farm_.logs().string()));
    start(w);
  }

  void stop() {
    for (const auto& worker : workers_)
      if (worker) worker->stop();
    for (const Clock::time_point began = Clock::now();
         any_runs() && seconds_since(began) < patience_with_stopped_s;) {
      ::usleep(between_workers_us);
      for (auto& worker : workers_)
        if (worker && worker->ended()) worker.reset();
    }
  }

  void tell(Progress& progress) {
    std::int64_t done = 0;
    std::string at;
    for (const Stage stage : farm_.stages())
      for (const Unit& unit : farm_.units(stage)) {
        const bool known = known_done_.contains(unit.name);
        if (known || farm_.is_done(unit))
          known_done_.insert(unit.name), ++done;
        else if (at.empty())
          at = name_of(stage);
      }
    progress.update(done, at);
  }

  const FarmFolder& farm_;
  std::vector<std::unique_ptr<ChildWorker>> workers_;
  std::set<std::string> known_done_;
  int crashes_ = 0;
};

}  // namespace

void run_here(const FarmFolder& farm) { Workers(farm).run(); }

}  // namespace limber::detail
