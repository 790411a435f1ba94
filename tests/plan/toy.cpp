#include "tests/plan/toy.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "core/hash.h"

namespace limber::plan::testing {

namespace {

constexpr float spring_per_s2 = 40;  // divided by the mass

Vec3f at(const std::vector<float>& v, int node) { return Vec3f(v.data() + 3 * node); }
void put(std::vector<float>& v, int node, const Vec3f& p) {
  std::copy(p.begin(), p.end(), v.begin() + 3 * node);
}

class ToyPropagator final : public Propagator {
 public:
  explicit ToyPropagator(const Toy& toy) : toy_(toy) {}
  void propagate(std::span<Rollout> rollouts) override {
    for (Rollout& r : rollouts) {
      begin();
      r.to = *r.from;
      r.ok = steps(r.control, r.control.steps, r.to);
      r.clear = toy_.is_clear(r.to);
    }
  }

  // All that the supply gives side by side, a piece of each in turn.
  void run(RolloutSource& supply, int look_every) override {
    struct Running {
      Rollout* rollout;
      State now;
      int steps = 0;
    };
    std::vector<Running> running;
    while (true) {
      while (Rollout* r = supply.next()) begin(), running.push_back({r, *r->from});
      if (running.empty()) return;
      if (!supply.wanted()) {
        for (const Running& mine : running) mine.rollout->ok = false, supply.done(*mine.rollout);
        return;
      }
      for (std::size_t i = 0; i < running.size();) {
        Running& mine = running[i];
        Rollout& rollout = *mine.rollout;
        const std::int64_t shown = supply.next_shown(mine.now.step);
        const int piece =
            int(std::min<std::int64_t>({look_every - mine.steps % look_every,
                                        rollout.control.steps - mine.steps, shown - mine.now.step}));
        rollout.ok = steps(rollout.control, piece, mine.now);
        mine.steps += piece;
        rollout.clear = toy_.is_clear(mine.now);
        const Observation look{mine.steps, toy_.robot_center(mine.now), toy_.robot_velocity(mine.now),
                               toy_.goal_shift(mine.now)};
        const bool whole = !rollout.ok || mine.steps == rollout.control.steps;
        if (!whole && (mine.steps % look_every || supply.goes_on(rollout, look)) &&
            (mine.now.step < shown || supply.goes_on(rollout, mine.now))) {
          ++i;
          continue;
        }
        if (rollout.ok) rollout.control.steps = mine.steps;
        rollout.to = mine.now;
        running.erase(running.begin() + std::ptrdiff_t(i));
        supply.done(rollout);
      }
    }
  }

 private:
  void begin() {
    if (toy_.before_each_rollout) toy_.before_each_rollout();
    const std::int64_t number = toy_.rollouts++;
    if (toy_.jitter) std::this_thread::sleep_for(std::chrono::microseconds(number * 7919 % 200));
  }
  bool steps(const Control& control, int count, State& state) const {
    for (int i = 0; i < count; ++i)
      if (!toy_.step(control, state)) return false;
    return true;
  }

  const Toy& toy_;
};

}  // namespace

State Toy::start() const {
  if (begins_at) return *begins_at;
  State s{0, std::vector<float>(std::size_t(3 * nodes)), std::vector<float>(std::size_t(3 * nodes))};
  for (int i = 0; i < nodes; ++i) put(s.positions, i, Vec3f(1, 1.5f, 1) + rest_place(i));
  return s;
}

Vec3 Toy::robot_center(const State& s) const {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < nodes; ++i) sum += at(s.positions, i).cast<double>();
  return sum / nodes;
}

Vec3 Toy::robot_velocity(const State& s) const {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < nodes; ++i) sum += at(s.velocities, i).cast<double>();
  return sum / nodes;
}

// The wall that stands at x = 5.
Workspace Toy::workspace() const {
  Workspace w;
  w.box = sample_bounds(), w.cell_m = 0.25, w.cells = {40, 24, 8};
  w.what.assign(std::size_t(w.cells.prod()), Workspace::open);
  w.walls = false, w.robot_radius_m = 0.25;
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 24 && wall; ++y)
      for (const int x : {19, 20})
        if (y < 8 || y >= 16) w.what[std::size_t((z * 24 + y) * 40 + x)] = Workspace::rigid;
  return w;
}

double Toy::mean_speed(const State& s) const {
  double sum = 0;
  for (int i = 0; i < nodes; ++i) sum += double(at(s.velocities, i).norm());
  return sum / nodes;
}

std::uint64_t Toy::hash() const {
  return Hasher()
      .value(nodes)
      .value(mass_kg)
      .value(damping_per_s)
      .bytes(&weight_m_s2, sizeof weight_m_s2)
      .value(int(wall))
      .value(int(lava))
      .value(unacceptable_above_z)
      .digest();
}

bool Toy::acceptable(const State& s) const { return robot_center(s).z() <= double(unacceptable_above_z); }

std::size_t Toy::first_refused(std::span<const State> frames) const {
  const auto above = [&](const State& s) { return robot_center(s).z() > double(refused_above_z); };
  return std::size_t(std::find_if(frames.begin(), frames.end(), above) - frames.begin());
}

std::string Toy::why_refused(const State& s) const {
  return robot_center(s).z() > double(refused_above_z) ? "it is too high" : "";
}

Measures Toy::measures(const State& s) const {
  Measures m;
  for (int i = 1; i < nodes; ++i) {
    const Vec3f rest = rest_place(i) - rest_place(i - 1);
    const Vec3f stretch = at(s.positions, i) - at(s.positions, i - 1) - rest;
    m.strain_energy_j += 0.5 * double(spring_per_s2 * mass_kg * stretch.squaredNorm());
    m.volume_change = std::max(m.volume_change, double(stretch.norm() / rest.norm()));
  }
  return m;
}

std::unique_ptr<Propagator> Toy::make_propagator() const { return std::make_unique<ToyPropagator>(*this); }

bool Toy::step(const Control& c, State& s) const {
  constexpr float h = 0.01f, pull_per_s2 = 9;  // divided by the mass
  const State before = s;
  for (int i = 0; i < nodes; ++i) {
    const Vec3f x = at(before.positions, i), v = at(before.velocities, i);
    Vec3f a = weight_m_s2 - damping_per_s * v;
    for (const int j : {i - 1, i + 1}) {
      if (j < 0 || j >= nodes) continue;
      a += spring_per_s2 * ((at(before.positions, j) - x) - (rest_place(j) - rest_place(i)));
    }
    const bool near_node = c.node >= 0 && (rest_place(i) - rest_place(c.node)).norm() <= c.radius_m;
    if (c.manipulation == Manipulation::body || (c.manipulation == Manipulation::control_point && near_node))
      a += c.force_n / mass_kg;
    if (c.manipulation == Manipulation::interpolation) {
      const Vec3f pull = pull_per_s2 * (c.target_m + rest_place(i) - x) - 6.0f * v;
      const float cap = c.max_force_n / mass_kg, length = pull.norm();
      a += length > cap ? Vec3f(pull * (cap / length)) : pull;
    }
    Vec3f v_next = v + h * a, x_next = x + h * v_next;
    const bool in_gap = x_next.y() > 2 && x_next.y() < 4;
    if (wall && !in_gap && std::abs(x_next.x() - 5) < 0.2f) {
      x_next.x() = x.x() < 5 ? 4.8f : 5.2f;
      v_next.x() = 0;
    }
    if (lava && x_next.y() < 0.5f) return false;
    put(s.positions, i, x_next);
    put(s.velocities, i, v_next);
  }
  ++s.step;
  return true;
}

Settings toy_settings() {
  Settings s;
  s.seed = 7;
  s.max_iterations = 2000;
  s.goal = {Vec3(9, 1.5, 1), 0.4};
  s.max_force_n = 8;
  s.control_point_radius_m = 0.25;
  return s;
}

bool passes(const System& system, const Settings& settings, Propagator& propagator, Rollout& rollout) {
  const double steps_per_frame = 1 / (settings.frames_per_second * system.dt_s());
  const State from = *rollout.from;
  const std::int64_t end = from.step + rollout.control.steps;
  Rollout piece = rollout;
  for (std::int64_t frame = 0;; ++frame) {
    const auto step =
        std::min<std::int64_t>(end, system.start().step + std::llround(double(frame) * steps_per_frame));
    if (step <= from.step) continue;
    piece.control.steps = int(step - from.step);  // from its beginning: pieces are nobody's business here
    propagator.propagate({&piece, 1});
    if (!piece.ok || !piece.clear || !system.acceptable(piece.to)) return false;
    if (step == end) break;
  }
  rollout.to = piece.to, rollout.ok = true;
  return true;
}

Tree sequential_tree(const System& system, const Settings& settings, std::int64_t first_iteration) {
  const auto propagator = system.make_propagator();
  Tree tree;
  const State start = system.start();
  tree.add(start, -1, Control{}, -1, system.robot_center(start).cast<float>());
  for (std::int64_t i = first_iteration; i < settings.max_iterations; ++i) {
    const Sample d = draw_sample(settings, system, i);
    const auto shift = [&](int node) { return system.goal_shift(tree.states[std::size_t(node)]); };
    const auto distance2 = [&](int node) {
      const Vec3f from_goal = tree.centers[node] - shift(node).cast<float>();
      return squared_distance(d.towards_goal ? from_goal : tree.centers[node], d.point.cast<float>());
    };
    int near = 0;
    for (int node = 1; node < tree.size(); ++node)
      if (distance2(node) < distance2(near)) near = node;
    Rollout r;
    const State from = tree.states[std::size_t(near)];
    r.from = &from;
    r.control = control_of(d, settings, tree.centers[near].cast<double>(), shift(near));
    if (!passes(system, settings, *propagator, r)) continue;
    const Vec3 center = system.robot_center(r.to);
    tree.add(r.to, near, r.control, i, center.cast<float>());
    if ((center - system.goal_shift(r.to) - settings.goal.center_of_mass_m).norm() <= settings.goal.radius_m)
      break;
  }
  return tree;
}

}  // namespace limber::plan::testing
