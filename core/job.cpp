#include "core/job.h"

#include <tbb/info.h>

#include "core/error.h"

namespace limber {

Watcher::~Watcher() = default;
void Watcher::progress(const std::string&, std::int64_t, std::int64_t, const std::string&) {}
void Watcher::warn(const std::string&) {}
bool Watcher::stop() { return false; }

namespace {
thread_local Job* job_of_thread = nullptr;
Watcher nobody;  // stands for the terminal, and is never asked
}  // namespace

Context at_terminal() { return {.watcher = &nobody}; }
bool is_at_terminal(const Context& context) { return context.watcher == &nobody; }

Job::Job(const Context& context)
    : watcher_(context.watcher),
      threads_(context.threads == 0 ? tbb::info::default_concurrency() : context.threads) {
  constexpr int max_threads = 256;  // the command's, too
  if (context.threads < 0 || context.threads > max_threads)
    throw InputError(fmt::format("threads is {}; it must be in [0, {}], 0: as many as the machine has",
                                 context.threads, max_threads));
}

void Job::progress(const std::string& stage, std::int64_t done, std::int64_t total, const std::string& note) {
  if (!watcher_) return;
  const std::lock_guard lock(mutex_);
  watcher_->progress(stage, done, total, note);
}

void Job::warn(const std::string& text) {
  if (!watcher_) return;
  const std::lock_guard lock(mutex_);
  watcher_->warn(text);
}

bool Job::stopped() {
  if (!watcher_) return false;
  if (!stopped_.load(std::memory_order_relaxed) && watcher_->stop()) stopped_ = true;
  return stopped_.load(std::memory_order_relaxed);
}

Job* current_job() { return job_of_thread; }

WorkingFor::WorkingFor(Job* job) : before_(job_of_thread) { job_of_thread = job; }
WorkingFor::~WorkingFor() { job_of_thread = before_; }

}  // namespace limber
