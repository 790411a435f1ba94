#include "core/threads.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/job.h"

namespace limber {

namespace {
int& count() {
  static int threads = tbb::info::default_concurrency();
  return threads;
}
}  // namespace

void set_thread_count(int threads) {
  LIMBER_CHECK(threads >= 0, threads);
  count() = threads == 0 ? tbb::info::default_concurrency() : threads;
}

int thread_count() {
  const Job* const job = current_job();
  return job ? job->threads() : count();
}

namespace {

enum class Waiting { takes_up_any_loop, takes_up_this_loop };

void loop(int n, const std::function<void(int)>& body, [[maybe_unused]] Waiting waiting) {
  const int threads = thread_count();
  if (threads == 1) {
    for (int i = 0; i < n; ++i) body(i);
    return;
  }
  Job* const job = current_job();
#ifdef __SANITIZE_THREAD__
  // ThreadSanitizer does not see how TBB's library, which it has not built, hands work over.
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&] {
    const WorkingFor working(job);
    for (int i; (i = next++) < n;) try {
        body(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = n;
      }
  };
  std::vector<std::jthread> workers;
  for (int t = 1; t < std::min(threads, n); ++t) workers.emplace_back(work);
  work();
  workers.clear();
  if (failure) std::rethrow_exception(failure);
#else
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
  const auto all = [&] {
    tbb::parallel_for(0, n, [&](int i) {
      const WorkingFor working(job);
      body(i);
    });
  };
  waiting == Waiting::takes_up_this_loop ? tbb::this_task_arena::isolate(all) : all();
#endif
}

}  // namespace

// Who waits for a loop takes up nothing of a loop around it: that is work of another kind, and may be long.
void parallel_for(int n, const std::function<void(int)>& body) { loop(n, body, Waiting::takes_up_this_loop); }

void side_by_side(int n, const std::function<void(int)>& body) {
  std::atomic<int> next{0};
  std::vector<std::exception_ptr> failures(std::size_t(std::max(n, 0)));
  const auto work = [&](int) {
    for (int i; (i = next++) < n;) try {
        body(i);
      } catch (...) {
        failures[std::size_t(i)] = std::current_exception();
        next = n;
      }
  };
  loop(std::min(n, thread_count()), work, Waiting::takes_up_any_loop);
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace limber
