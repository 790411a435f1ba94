#include "core/threads.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <memory>

#include "core/error.h"

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

int thread_count() { return count(); }

void parallel_for(int n, const std::function<void(int)>& body) {
  if (count() == 1) {
    for (int i = 0; i < n; ++i) body(i);
    return;
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(count()));
  tbb::parallel_for(0, n, [&](int i) { body(i); });
}

}  // namespace limber
