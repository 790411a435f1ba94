// What stepping costs, in CPU seconds of the thread that steps. Steps are sampled, one in `Cost::sampled`,
// with a clock that results never see; loads and stores are measured each.
#pragma once

#include <cstdint>

namespace limber::fem {

struct Cost {
  static constexpr int sampled = 32;

  double contact_s = 0;      // between bodies and with walls
  double controls_s = 0;     // interpolation forces
  double elastic_s = 0;      // elastic and damping forces
  double integration_s = 0;  // with the boxes of the bodies
  double load_s = 0, store_s = 0;
  std::int64_t steps = 0;  // of all lanes together
  std::int64_t loads = 0, stores = 0;

  double force_step_s() const { return elastic_s + integration_s; }
  Cost& operator+=(const Cost& o) {
    contact_s += o.contact_s, controls_s += o.controls_s, elastic_s += o.elastic_s;
    integration_s += o.integration_s, load_s += o.load_s, store_s += o.store_s;
    steps += o.steps, loads += o.loads, stores += o.stores;
    return *this;
  }
};

double thread_cpu_s();

// Seconds of CPU time since it was made or last asked, without what the asking takes.
class Stopwatch {
 public:
  Stopwatch() : before_(thread_cpu_s()) {}
  double lap_s();

 private:
  double before_;
};

}  // namespace limber::fem
