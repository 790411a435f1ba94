#include "core/progress.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <utility>

#include "core/error.h"
#include "core/events.h"
#include "core/job.h"

namespace limber {

namespace {

bool enabled = true;
std::atomic<int> arrived_signal{0};

std::atomic<int>& count_of_nothing_to_keep() {
  static std::atomic<int> of_the_program{0};
  Job* const job = current_job();
  return job ? job->with_nothing_to_keep : of_the_program;
}

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

thread_local std::string name_of_work;  // ProgressOf

// Which thread's the line on the terminal is; 0: nobody's.
std::atomic<int> line_of{0};
thread_local int bars = 0;

int this_thread() {
  static std::atomic<int> threads{0};
  thread_local const int number = ++threads;
  return number;
}

bool has_line(int thread) {
  int nobody = 0;
  return line_of.compare_exchange_strong(nobody, thread) || nobody == thread;
}

bool on_terminal() { return enabled && ::isatty(STDERR_FILENO) == 1; }

void on_signal(int number) {
  if (arrived_signal.exchange(number) != 0) ::_exit(128 + number);
}

std::string duration_text(double seconds) {
  const int s = int(seconds + 0.5);
  return s < 60 ? fmt::format("{} s", s) : fmt::format("{}:{:02} min", s / 60, s % 60);
}

}  // namespace

Progress::Progress(std::string label, std::int64_t total)
    : label_(name_of_work.empty() ? std::move(label) : name_of_work + ": " + label),
      total_(total),
      owner_(this_thread()),
      started_(seconds_now()) {
  ++bars;
  events::tell({{"event", "stage"}, {"stage", label_}, {"total", total_}});
}

Progress::~Progress() {
  const bool is_its_line = line_of == owner_;
  if (is_its_line && drawn_at_ >= 0 && on_terminal()) fmt::print(stderr, "\r\x1b[K");
  if (--bars == 0 && is_its_line) line_of = 0;
  if (current_job()) return;
  events::tell({{"event", "stage_end"}, {"stage", label_}, {"seconds", seconds_now() - started_}});
}

void Progress::update(std::int64_t done, const std::string& note, double share) {
  Job* const job = current_job();
  if (!job && !on_terminal() && !events::wanted()) return;
  const double now = seconds_now();
  if (drawn_at_ >= 0 && now - drawn_at_ < 0.1 && done < total_) return;
  const bool another_second = std::floor(now) != std::floor(drawn_at_);
  drawn_at_ = now;
  if (job) return job->progress(label_, done, total_, note);
  if (another_second)
    events::tell(
        {{"event", "progress"}, {"stage", label_}, {"done", done}, {"total", total_}, {"note", note}});
  if (!on_terminal() || !has_line(owner_)) return;
  constexpr int width = 24;
  std::string line = fmt::format("\r\x1b[K{} ", label_);
  if (total_ > 0) {
    if (share < 0) share = double(done) / double(total_);
    share = std::clamp(share, 0.0, 1.0);
    const int filled = int(share * width);
    line += fmt::format("[{}{}] {}/{}", std::string(std::size_t(filled), '='),
                        std::string(std::size_t(width - filled), ' '), done, total_);
    if (share > 0.02) line += fmt::format(", {} left", duration_text((now - started_) * (1 - share) / share));
  } else {
    line += fmt::format("{}", done);
  }
  if (!note.empty()) line += ", " + note;
  fmt::print(stderr, "{}", line);
  std::fflush(stderr);
}

void set_progress_enabled(bool on) { enabled = on; }

ProgressOf::ProgressOf(std::string name) : before_(std::exchange(name_of_work, std::move(name))) {}
ProgressOf::~ProgressOf() { name_of_work = std::move(before_); }

void install_stop_signals() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int stop_signal() {
  if (Job* const job = current_job()) return job->stopped() ? Interrupted::by_watcher : 0;
  return arrived_signal.load(std::memory_order_relaxed);
}
void request_stop(int number) { arrived_signal = number; }
void throw_if_stopped() {
  if (const int number = stop_signal()) throw Interrupted(number);
}

NothingToKeep::NothingToKeep() { ++count_of_nothing_to_keep(); }
NothingToKeep::~NothingToKeep() { --count_of_nothing_to_keep(); }
bool nothing_to_keep() { return count_of_nothing_to_keep() > 0; }

double cpu_seconds() {
  rusage usage{}, children{};
  getrusage(RUSAGE_SELF, &usage);
  getrusage(RUSAGE_CHILDREN, &children);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime) + seconds(children.ru_utime) +
         seconds(children.ru_stime);
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024;
}

}  // namespace limber
