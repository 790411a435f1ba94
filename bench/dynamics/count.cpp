#include "bench/dynamics/count.h"

#include <immintrin.h>

#include <utility>

#include "fem/detail/kernels.h"

namespace limber::fem::detail {
namespace {

bench::Operations counted;

struct Counted {
  double value = 0;
  constexpr Counted() = default;
  constexpr explicit Counted(double v) : value(v) {}
  Counted& operator=(int v) { return value = v, *this; }
};
Counted operator+(Counted a, Counted b) { return ++counted.sums, Counted(a.value + b.value); }
Counted operator-(Counted a, Counted b) { return ++counted.sums, Counted(a.value - b.value); }
Counted operator*(Counted a, Counted b) { return ++counted.products, Counted(a.value * b.value); }
Counted operator/(Counted a, Counted b) { return ++counted.divisions, Counted(a.value / b.value); }
Counted operator-(Counted a) { return Counted(-a.value); }
Counted& operator+=(Counted& a, Counted b) { return a = a + b; }
Counted& operator-=(Counted& a, Counted b) { return a = a - b; }
bool operator<(Counted a, Counted b) { return ++counted.comparisons, a.value < b.value; }
bool operator>(Counted a, Counted b) { return b < a; }
Counted root(Counted a) { return ++counted.roots, a; }
Counted fused(Counted a, Counted b, Counted c) { return a * b + c; }

#include "fem/detail/kernels.inc"

// Forces of one element on nodes at different places.
template <class E>
bench::Operations count_element() {
  constexpr Layout state = state_layout(1), force = force_layout(1);
  Counted records[4 * state.node], f[4 * force.node];
  for (int k = 0; k < 4 * state.node; ++k) records[k] = Counted(k * k % 7);
  E element{};
  for (int i = 0; i < E::nodes; ++i) element.node[i] = i;
  counted = {};
  add_forces<1>(List<E>{&element, nullptr, 1}, records, records + 4, f);
  return counted;
}

bench::Operations count_node() {
  Counted record[8], f[4], inverse_mass(1), box[6], speed2;
  Motion<Counted> motion{0, 1, &inverse_mass, Counted(1), {}, Counted(1), nullptr, box, box + 3, &speed2};
  counted = {};
  integrate_body<Counted, 1, false>(motion, record, record + 4, f);
  return counted;
}

}  // namespace
}  // namespace limber::fem::detail

namespace limber::bench {

OperationCounts count_operations() {
  using namespace fem::detail;
  OperationCounts counts;
  [&]<int... Kind>(std::integer_sequence<int, Kind...>) {
    ((counts.of_kind[Kind] = count_element<ElementOfKind<Counted, Kind>>()), ...);
  }
  (std::make_integer_sequence<int, kinds>());
  counts.node = count_node();
  return counts;
}

double flops_a_tet_step(const fem::World& world, const OperationCounts& counts) {
  double flops = double(world.moving_nodes) * counts.node.flops();
  for (const fem::detail::Run& run : world.tables.elements.runs)
    flops += double(run.count) * counts.of_kind[run.kind].flops();
  return flops / double(world.elements.volumes.size() + world.elements.neo_hookeans.size());
}

}  // namespace limber::bench
