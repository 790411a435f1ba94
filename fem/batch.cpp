#include "fem/batch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "fem/detail/stepper.h"

namespace limber::fem {
namespace {

detail::Isa isa_of(InstructionSet wanted) {
  const auto isa = wanted == InstructionSet::automatic ? detail::best_isa()
                   : wanted == InstructionSet::avx512  ? detail::Isa::avx512
                   : wanted == InstructionSet::avx2    ? detail::Isa::avx2
                                                       : detail::Isa::sse2;
  if (!detail::machine_has(isa))
    throw InputError("this machine lacks the instruction set asked for; use automatic");
  return isa;
}

// A state that left the world by more than its size, or is not finite, is no state.
Outcome judge(const World& world, const State& state) {
  const Vec3 center = world.bounds_m.center();
  const double far = 2 * world.bounds_m.diagonal() + 1e6 * !world.walls;
  for (const Body& body : world.bodies) {
    for (int n = 0; n < body.node_count() && body.pushed(); ++n)
      for (int c = 0; c < 3; ++c) {
        const std::size_t k = std::size_t(3 * (body.first_node + n) + c);
        const float x = state.positions[k], v = state.velocities[k];
        if (!std::isfinite(x) || !std::isfinite(v))
          return {RunStatus::diverged, fmt::format("body {}: node {} is not finite", body.name, n)};
        if (std::abs(x - center[c]) > far)
          return {RunStatus::diverged,
                  fmt::format("body {}: node {} flew off to {} = {:.3g} m", body.name, n, "xyz"[c], x)};
      }
  }
  return {};
}

}  // namespace

struct Batch::Impl {
  struct Lane {
    Control control;
    int steps_left = 0;
    State state;  // as loaded; when done, as it ended
    Outcome outcome;
    bool stale = false;  // done, and what it ended with still takes part in the steps
  };
  const World& world;
  detail::Stepper<float> stepper;
  std::vector<Lane> lanes;
  State rest;
  Cost cost;  // loads and stores; the rest is the stepper's

  Impl(const World& w, int count, InstructionSet set)
      : world(w), stepper(w, count, isa_of(set)), lanes(std::size_t(count)), rest(rest_state(w)) {
    for (Lane& lane : lanes) lane.state = rest;
  }

  void finish(int index) {
    Stopwatch watch;
    Lane& lane = lanes[index];
    State end{lane.state.step + lane.control.steps, std::vector<float>(rest.positions.size()),
              std::vector<float>(rest.velocities.size())};
    stepper.store(index, end.positions.data(), end.velocities.data());
    lane.outcome = judge(world, end);
    if (lane.outcome.status == RunStatus::ok) lane.state = std::move(end);
    lane.stale = true;
    cost.store_s += watch.lap_s(), ++cost.stores;
  }
  // A lane that is not loaded anew goes along at rest: numbers that grow or shrink without end are slow.
  void rest_stale_lanes() {
    for (std::size_t l = 0; l < lanes.size(); ++l)
      if (std::exchange(lanes[l].stale, false))
        stepper.load(int(l), 0, rest.positions.data(), rest.velocities.data(), {}, false);
  }
};

Batch::Batch(const World& world, int lanes, InstructionSet set)
    : impl_(std::make_unique<Impl>(world, lanes, set)) {}
Batch::~Batch() = default;
Batch::Batch(Batch&&) noexcept = default;

int Batch::lanes() const { return int(impl_->lanes.size()); }
const World& Batch::world() const { return impl_->world; }

void Batch::load(int lane, const State& state, const Control& control) {
  LIMBER_CHECK(state.positions.size() == impl_->rest.positions.size(), state.positions.size(),
               impl_->rest.positions.size());
  LIMBER_CHECK(state.velocities.size() == impl_->rest.velocities.size(), state.velocities.size(),
               impl_->rest.velocities.size());
  LIMBER_CHECK(control.steps >= 0, control.steps);
  Stopwatch watch;
  impl_->lanes.at(std::size_t(lane)) = {control, control.steps, state, {}};
  impl_->stepper.load(lane, state.step, state.positions.data(), state.velocities.data(), control,
                      control.steps > 0);
  impl_->cost.load_s += watch.lap_s(), ++impl_->cost.loads;
  if (control.steps == 0) impl_->finish(lane);
}

int Batch::advance(int max_steps) {
  int steps = max_steps, busy = 0;
  for (const auto& lane : impl_->lanes)
    if (lane.steps_left > 0) steps = std::min(steps, lane.steps_left), ++busy;
  if (busy == 0 || steps <= 0) return 0;
  impl_->rest_stale_lanes();
  for (int s = 0; s < steps; ++s) impl_->stepper.step();
  for (int l = 0; l < lanes(); ++l) {
    auto& lane = impl_->lanes[l];
    if (lane.steps_left == 0) continue;
    lane.steps_left -= steps;
    if (lane.steps_left == 0) impl_->finish(l);
  }
  return steps;
}

int Batch::steps_left(int lane) const { return impl_->lanes.at(std::size_t(lane)).steps_left; }

Batch::Motion Batch::motion(int lane, int index) const {
  const Body& body = impl_->world.bodies.at(std::size_t(index));
  Motion sum{Vec3::Zero(), Vec3::Zero(), std::numeric_limits<double>::infinity()};
  for (int n = 0; n < body.node_count(); ++n) {
    const auto [place, velocity] = impl_->stepper.node(lane, body.first_node + n);
    sum.center_m += body.node_mass_kg[std::size_t(n)] * place;
    sum.velocity_m_s += body.node_mass_kg[std::size_t(n)] * velocity;
    sum.lowest_m = std::min(sum.lowest_m, double(place.z()));
  }
  return {sum.center_m / body.mass_kg, sum.velocity_m_s / body.mass_kg, sum.lowest_m};
}

void Batch::peek(int lane, State& state) const {
  const auto& mine = impl_->lanes.at(std::size_t(lane));
  LIMBER_CHECK(mine.steps_left > 0, lane, mine.steps_left);
  state.step = mine.state.step + mine.control.steps - mine.steps_left;
  state.positions.resize(impl_->rest.positions.size()),
      state.velocities.resize(impl_->rest.velocities.size());
  impl_->stepper.store(lane, state.positions.data(), state.velocities.data());
}

void Batch::stop(int lane) {
  auto& mine = impl_->lanes.at(std::size_t(lane));
  if (mine.steps_left == 0) return;
  mine.control.steps -= std::exchange(mine.steps_left, 0);
  impl_->finish(lane);
}

const Outcome& Batch::outcome(int lane) const {
  LIMBER_CHECK(steps_left(lane) == 0, lane, steps_left(lane));
  return impl_->lanes[lane].outcome;
}

void Batch::store(int lane, State& state) const {
  LIMBER_CHECK(steps_left(lane) == 0, lane, steps_left(lane));
  state = impl_->lanes[lane].state;
}

bool Batch::is_clear(int lane) { return impl_->stepper.is_clear(lane); }

Cost Batch::cost() const {
  Cost all = impl_->stepper.cost();
  all += impl_->cost;
  return all;
}

void propagate(Batch& batch, std::span<Rollout> rollouts) {
  constexpr std::size_t none = ~std::size_t(0);
  std::vector<std::size_t> rollout_of_lane(std::size_t(batch.lanes()), none);
  std::size_t next = 0, running = 0;
  do {
    for (int lane = 0; lane < batch.lanes(); ++lane) {
      std::size_t& mine = rollout_of_lane[lane];
      while (true) {
        if (mine != none && batch.steps_left(lane) == 0) {
          batch.store(lane, rollouts[mine].end);
          rollouts[mine].outcome = batch.outcome(lane);
          rollouts[mine].clear = rollouts[mine].outcome.status != RunStatus::ok ||
                                 rollouts[mine].control.steps == 0 || batch.is_clear(lane);
          mine = none, --running;
        }
        if (mine != none || next == rollouts.size()) break;
        mine = next++, ++running;
        batch.load(lane, *rollouts[mine].start, rollouts[mine].control);
      }
    }
    batch.advance();
  } while (running > 0);
}

Rollout propagate(const World& world, const State& start, const Control& control) {
  Batch batch(world, 1);
  Rollout rollout{&start, control, {}, {}};
  propagate(batch, {&rollout, 1});
  return rollout;
}

}  // namespace limber::fem
