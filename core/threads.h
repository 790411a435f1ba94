// How many threads limber may use (--threads), and a loop over them. Results never depend on the number.
#pragma once

#include <algorithm>
#include <functional>

namespace limber {

void set_thread_count(int);  // 0: as many as the machine has
int thread_count();

// Calls body(i) for i in [0, n), each once, on up to thread_count() threads, in no order. The first exception
// is passed on.
void parallel_for(int n, const std::function<void(int)>& body);

// The same for so little work each that threads take them by the hundred.
template <class Body>
void parallel_for_many(int n, const Body& body) {
  constexpr int chunk = 256;
  parallel_for((n + chunk - 1) / chunk, [&](int c) {
    for (int i = c * chunk; i < std::min(n, (c + 1) * chunk); ++i) body(i);
  });
}

// The same for a few long pieces of work that may loop in parallel themselves. They begin in order, none
// behind one that has thrown; of several exceptions the one of the least i is passed on.
void side_by_side(int n, const std::function<void(int)>& body);

}  // namespace limber
