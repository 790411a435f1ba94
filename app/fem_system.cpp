#include "app/fem_system.h"

#include "core/hash.h"
#include "fem/batch.h"
#include "fem/observe.h"

namespace limber::app {

namespace {

constexpr int preferred_lanes = 16;

std::uint64_t hash_of(const fem::World& world) {
  Hasher hasher;
  hasher.value(world.robot).matrix(world.bounds_m.lower).matrix(world.bounds_m.upper).value(int(world.walls));
  hasher.matrix(world.gravity_m_s2).value(world.dt_s).value(world.contact_dt_s).value(world.rest_speed_m_s);
  for (const fem::Body& body : world.bodies) {
    const fem::Material& m = body.material;
    hasher.value(limber::hash_of(body.cage))
        .value(int(body.moving))
        .value(int(body.kind))
        .value(int(body.self_contact));
    for (const double v : {m.youngs_modulus_pa, m.poisson_ratio, m.density_kg_m3, m.damping_ratio, m.friction,
                           body.stiffness_share})
      hasher.value(v);
    for (const auto* of_tets : {&body.youngs_modulus_from_tet_pa, &body.density_from_tet_kg_m3})
      for (const double v : *of_tets) hasher.value(v);
    for (const bool fixed : body.fixed) hasher.value(int(fixed));
  }
  return hasher.digest();
}

}  // namespace

class FemSystem::Propagator final : public plan::Propagator {
 public:
  explicit Propagator(const FemSystem& system)
      : system_(system), batch_(system.world_, preferred_lanes), single_(system.world_, 1) {}
  ~Propagator() override {
    const std::lock_guard lock(system_.mutex_);
    system_.cost_ += batch_.cost(), system_.cost_ += single_.cost();
  }

  void propagate(std::span<plan::Rollout> rollouts) override {
    work_.resize(rollouts.size());
    for (std::size_t i = 0; i < rollouts.size(); ++i)
      work_[i].start = rollouts[i].from, work_[i].control = rollouts[i].control;
    fem::propagate(rollouts.size() == 1 ? single_ : batch_, work_);
    for (std::size_t i = 0; i < rollouts.size(); ++i) {
      rollouts[i].ok = work_[i].outcome.status == fem::RunStatus::ok;
      rollouts[i].to = std::move(work_[i].end);
    }
  }

 private:
  const FemSystem& system_;
  fem::Batch batch_, single_;  // a path is simulated one rollout at a time; fifteen idle lanes would cost
  std::vector<fem::Rollout> work_;
};

FemSystem::FemSystem(const fem::World& world, const MovingGoal& goal)
    : world_(world), goal_(goal), goal_body_start_m_(Vec3::Zero()), hash_(hash_of(world)) {
  if (goal.body < 0) return;
  goal_body_start_m_ = fem::center_of_mass_m(world, start(), goal.body);
  Hasher hasher;
  hasher.value(hash_)
      .value(goal.body)
      .value(int(goal.lost_below_m.has_value()))
      .value(goal.lost_below_m.value_or(0));
  hash_ = hasher.digest();
}

State FemSystem::start() const { return fem::rest_state(world_); }
Vec3 FemSystem::robot_center(const State& state) const {
  return fem::center_of_mass_m(world_, state, world_.robot);
}
double FemSystem::mean_speed(const State& state) const {
  return fem::mean_speed_m_s(world_, state, world_.robot);
}
int FemSystem::robot_nodes() const { return world_.bodies[std::size_t(world_.robot)].node_count(); }
Box FemSystem::sample_bounds() const { return world_.bounds_m; }
double FemSystem::dt_s() const { return world_.dt_s; }
std::uint64_t FemSystem::hash() const { return hash_; }
bool FemSystem::acceptable(const State& state) const {
  if (goal_.lost_below_m) {
    const fem::Body& body = world_.bodies[std::size_t(goal_.body)];
    for (int n = body.first_node; body.moving && n < body.first_node + body.node_count(); ++n)
      if (double(state.positions[std::size_t(3 * n + 2)]) < *goal_.lost_below_m) return false;
  }
  return fem::inverted_tets(world_, state) == 0;
}
Vec3 FemSystem::goal_shift(const State& state) const {
  if (goal_.body < 0) return Vec3::Zero();
  return fem::center_of_mass_m(world_, state, goal_.body) - goal_body_start_m_;
}
int FemSystem::lanes() const { return preferred_lanes; }
std::unique_ptr<plan::Propagator> FemSystem::make_propagator() const {
  return std::make_unique<Propagator>(*this);
}
fem::Cost FemSystem::cost() const {
  const std::lock_guard lock(mutex_);
  return cost_;
}

}  // namespace limber::app
