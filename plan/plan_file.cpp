#include "plan/plan_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <functional>
#include <limits>
#include <span>
#include <type_traits>

#include "core/error.h"
#include "core/hash.h"
#include "core/npz.h"
#include "plan/timings.h"

namespace limber::plan {

namespace {

// By edition: 1 had the tree as a list of states like any other, 2 no hash.txt, 3 what the search cost; 5 has
// the path of a tree alone.
constexpr const char* format_names[] = {"limber plan 1", "limber plan 2", "limber plan 3", "limber plan 4",
                                        "limber plan 5"};
constexpr const char* seal_name = "hash.txt";                // of all other entries
constexpr std::int64_t max_counted = std::int64_t(1) << 53;  // steps of all rollouts, …

// One row for each of n, of `width` numbers or, where that is 0, of one that has no dimension of its own.
template <class T, class Put>
void put_rows(NpzRows& file, const std::string& name, std::int64_t n, std::int64_t width, Put put) {
  std::vector<std::int64_t> shape{n};
  if (width > 0) shape.push_back(width);
  file.arrays[name] = NpyRows::of<T>(std::move(shape), std::move(put));
}

// A list of states is three arrays: NAME_step (n), NAME_positions and NAME_velocities (n × 3N).
void put_states(NpzRows& file, const std::string& name, std::span<const State> states) {
  const auto n = std::int64_t(states.size()), width = n == 0 ? 0 : std::int64_t(states[0].positions.size());
  put_rows<std::int64_t>(file, name + "_step", n, 0,
                         [=](std::int64_t i, auto* row) { *row = states[std::size_t(i)].step; });
  for (const auto& [what, half] :
       {std::pair("_positions", &State::positions), {"_velocities", &State::velocities}})
    file.arrays[name + what] = NpyRows::of<float>({n, width}, [=, of = half](std::int64_t i, float* row) {
      std::copy_n((states[std::size_t(i)].*of).begin(), width, row);
    });
}

// What the states of a tree share is written once: tree_step (n), tree_piece (n × 2 × K), the pieces of each
// state's positions and velocities, and tree_pieces (P × 96) themselves.
void put_shared_states(NpzRows& file, const States& states) {
  const auto half = std::int64_t(states.pieces_a_half());
  const std::int32_t* const piece_of = states.piece_of().data();
  put_rows<std::int64_t>(file, "tree_step", states.size(), 0,
                         [&](std::int64_t i, auto* row) { *row = states.steps()[std::size_t(i)]; });
  file.arrays["tree_piece"] = NpyRows::of<std::int32_t>(
      {states.size(), 2, half},
      [=](std::int64_t i, std::int32_t* row) { std::copy_n(piece_of + 2 * half * i, 2 * half, row); });
  put_rows<float>(
      file, "tree_pieces", std::int64_t(states.pieces().size()), States::piece_length,
      [&](std::int64_t i, float* row) { std::ranges::copy(states.pieces()[std::size_t(i)], row); });
}

void put_controls(NpzRows& file, const std::string& name, const std::vector<Control>& controls) {
  const auto column = [&]<class T>(const char* what, T Control::*of) {
    put_rows<T>(file, name + what, std::int64_t(controls.size()), 0,
                [&controls, of](std::int64_t i, T* row) { *row = controls[std::size_t(i)].*of; });
  };
  const auto vectors = [&](const char* what, Vec3f Control::*of) {
    put_rows<float>(file, name + what, std::int64_t(controls.size()), 3,
                    [&controls, of](std::int64_t i, float* row) {
                      std::copy_n((controls[std::size_t(i)].*of).data(), 3, row);
                    });
  };
  put_rows<std::int32_t>(
      file, name + "_manipulation", std::int64_t(controls.size()), 0,
      [&](std::int64_t i, auto* row) { *row = std::int32_t(controls[std::size_t(i)].manipulation); });
  vectors("_force_n", &Control::force_n);
  column("_node", &Control::node);
  column("_radius_m", &Control::radius_m);
  vectors("_target_m", &Control::target_m);
  column("_max_force_n", &Control::max_force_n);
  column("_steps", &Control::steps);
  const auto any = [&](const auto& has) { return std::any_of(controls.begin(), controls.end(), has); };
  if (any([](const Control& c) { return c.pressure_pa != 0; })) column("_pressure_pa", &Control::pressure_pa);
  if (!any([](const Control& c) { return c.second_node >= 0; })) return;
  column("_second_node", &Control::second_node);
  vectors("_second_force_n", &Control::second_force_n);
}

const char* name_of(Ending ending) {
  switch (ending) {
    case Ending::goal:
      return "goal";
    case Ending::iterations:
      return "iterations";
    case Ending::time:
      return "time";
    case Ending::stopped:
      return "stopped";
  }
  return "";
}

constexpr std::pair<Simulation::Ending, const char*> simulation_endings[] = {
    {Simulation::whole, "whole"}, {Simulation::stopped, "stopped"}, {Simulation::diverged, "diverged"}};

// Reads one plan.npz; every complaint names the file. What is large, the pieces of states, goes where it
// stays as it is read; other arrays are held beside the plan until it is whole.
class Reader {
 public:
  explicit Reader(const fs::path& path) : path_(path) {
    const NpzReader reader(path);
    NpzHasher hasher;
    file_.source = path;
    for (const std::string& name : reader.arrays()) {
      NpyArray head = reader.head(name);
      hasher.begin(name, head);
      const Sink sink = sink_of(name, head);
      reader.read(name, [&](std::int64_t, std::span<const std::byte> rows) {
        hasher.rows(rows);
        if (sink)
          sink(rows);
        else
          head.bytes.insert(head.bytes.end(), rows.begin(), rows.end());
      });
      file_.arrays[name] = std::move(head);
    }
    for (const std::string& name : reader.texts()) {
      file_.texts[name] = reader.text(name);
      if (name != seal_name) hasher.text(name, file_.texts[name]);
    }
    hash_ = hasher.digest();
  }
  void say_to_run(const char* command) { command_ = command; }

  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(fmt::format("{}: {}; run `limber {}` again", path_.string(), why, command_));
  }
  void require(bool good, const std::string& why) const {
    if (!good) refuse(why);
  }

  // rows −1: any number.
  template <class T>
  std::span<const T> array(const std::string& name, std::int64_t rows, std::int64_t columns) const {
    const NpyArray& a = file_.array(name);
    const bool shaped = columns == 1 ? a.shape.size() == 1 : a.shape.size() == 2 && a.shape[1] == columns;
    require(shaped && (rows < 0 || a.shape[0] == rows),
            name + " has another shape than the rest of the file");
    return a.as<T>(path_.string() + ": " + name);
  }

  // Of floats: each is a number, no nan and no infinity.
  std::span<const float> numbers(const std::string& name, std::int64_t rows, std::int64_t columns) const {
    const auto all = array<float>(name, rows, columns);
    const auto odd = std::find_if(all.begin(), all.end(), [](float x) { return !std::isfinite(x); });
    if (odd != all.end())
      refuse(fmt::format("{}[{}] holds {}, which is no number", name, (odd - all.begin()) / columns, *odd));
    return all;
  }

  std::int64_t width_of(const std::string& name) const {
    const NpyArray& a = file_.array(name);
    require(a.shape.size() == 2 && a.shape[1] % 3 == 0, name + " is not a list of states");
    return a.shape[1];
  }

  std::vector<State> states(const std::string& name, std::int64_t width) const {
    const auto steps = array<std::int64_t>(name + "_step", -1, 1);
    const std::int64_t n = std::int64_t(steps.size());
    const auto positions = numbers(name + "_positions", n, width);
    const auto velocities = numbers(name + "_velocities", n, width);
    std::vector<State> states;
    for (std::int64_t i = 0; i < n; ++i) {
      const auto x = positions.subspan(std::size_t(i * width), std::size_t(width));
      const auto v = velocities.subspan(std::size_t(i * width), std::size_t(width));
      states.push_back({steps[std::size_t(i)], {x.begin(), x.end()}, {v.begin(), v.end()}});
    }
    return states;
  }

  std::vector<Control> controls(const std::string& name, std::int64_t rows) const {
    const auto manipulation = array<std::int32_t>(name + "_manipulation", rows, 1);
    const std::int64_t n = std::int64_t(manipulation.size());
    const auto force = numbers(name + "_force_n", n, 3), target = numbers(name + "_target_m", n, 3);
    const auto node = array<std::int32_t>(name + "_node", n, 1),
               steps = array<std::int32_t>(name + "_steps", n, 1);
    const auto radius = numbers(name + "_radius_m", n, 1), max_force = numbers(name + "_max_force_n", n, 1);
    // Where nobody has a second carrier, or a pressure, nothing is told of it.
    std::span<const std::int32_t> second_node;
    std::span<const float> second_force, pressure;
    if (const std::string key = name + "_pressure_pa"; file_.arrays.contains(key))
      pressure = numbers(key, n, 1);
    if (const std::string key = name + "_second_node"; file_.arrays.contains(key)) {
      second_node = array<std::int32_t>(key, n, 1);
      second_force = numbers(name + "_second_force_n", n, 3);
    }
    std::vector<Control> controls(manipulation.size());
    for (std::size_t i = 0; i < controls.size(); ++i) {
      require(manipulation[i] >= 0 && manipulation[i] <= std::int32_t(Manipulation::hold),
              fmt::format("{}_manipulation[{}] is {}, which is none", name, i, manipulation[i]));
      require(steps[i] >= 0, fmt::format("{}_steps[{}] is {}", name, i, steps[i]));
      const bool at_a_node = Manipulation(manipulation[i]) == Manipulation::control_point;
      require(node[i] >= (at_a_node ? 0 : -1),
              fmt::format("{}_node[{}] is {}, which is none", name, i, node[i]));
      controls[i] = {Manipulation(manipulation[i]),
                     Vec3f(force.data() + 3 * i),
                     node[i],
                     radius[i],
                     Vec3f(target.data() + 3 * i),
                     max_force[i],
                     steps[i]};
      if (!pressure.empty()) {
        require(pressure[i] >= 0, fmt::format("{}_pressure_pa[{}] is {}, below 0", name, i, pressure[i]));
        controls[i].pressure_pa = pressure[i];
      }
      if (second_node.empty()) continue;
      require(second_node[i] >= -1 && (at_a_node || second_node[i] == -1),
              fmt::format("{}_second_node[{}] is {}, which is none", name, i, second_node[i]));
      controls[i].second_node = second_node[i];
      controls[i].second_force_n = Vec3f(second_force.data() + 3 * i);
    }
    return controls;
  }

  // Takes the pieces over.
  States shared_states() {
    const std::int64_t width = width_of("end_positions"), length = States::piece_length;
    const std::int64_t a_half = (width + length - 1) / length;
    const auto steps = array<std::int64_t>("tree_step", -1, 1);
    require(
        file_.array("tree_piece").shape == std::vector<std::int64_t>{std::int64_t(steps.size()), 2, a_half},
        "tree_piece has another shape than the rest of the file");
    // What went elsewhere is of the right type and shape; of what did not the complaint is to be made.
    if (piece_of_.empty()) file_.array("tree_piece").as<std::int32_t>(path_.string() + ": tree_piece");
    if (pieces_.empty()) numbers("tree_pieces", -1, length);
    for (std::size_t i = 0; i < pieces_.size(); ++i)
      for (const float x : pieces_[i])
        if (!std::isfinite(x)) refuse(fmt::format("tree_pieces[{}] holds {}, which is no number", i, x));
    const std::int64_t count = std::int64_t(pieces_.size()), used = width - (a_half - 1) * length;
    for (std::size_t i = 0; i < piece_of_.size(); ++i) {
      const std::int64_t piece = piece_of_[i];
      require(piece >= 0 && piece < count, fmt::format("tree_piece names piece {} of {}", piece, count));
      const bool last = std::int64_t(i) % a_half == a_half - 1;
      for (std::int64_t k = last ? used : length; k < length; ++k)
        require(pieces_[std::size_t(piece)][std::size_t(k)] == 0, "tree_pieces is not filled up with zeros");
    }
    return States::of_pieces(std::size_t(width), steps, std::move(piece_of_), std::move(pieces_));
  }

  States unshared_states(std::span<const std::int32_t> parents) const {
    const std::vector<State> all = states("tree", width_of("tree_positions"));
    require(all.size() == parents.size(), "tree_parent has another shape than the rest of the file");
    States shared;
    for (std::size_t i = 0; i < all.size(); ++i) shared.push_back(all[i], parents[i]);
    return shared;
  }

  Tree tree(bool shared) {
    Tree t;
    const std::int64_t n = std::int64_t(array<std::int64_t>("tree_step", -1, 1).size());
    require(n > 0, "the tree is empty");
    const auto parents = array<std::int32_t>("tree_parent", n, 1);
    const auto iterations = array<std::int64_t>("tree_iteration", n, 1);
    const auto centers = numbers("tree_center_m", n, 3);
    t.parents.assign(parents.begin(), parents.end());
    t.iterations.assign(iterations.begin(), iterations.end());
    t.controls = controls("tree", n);
    for (std::int64_t i = 0; i < n; ++i) {
      t.centers.push_back(Vec3f(centers.data() + 3 * i));
      const std::int32_t parent = parents[std::size_t(i)];
      require(i == 0 ? parent == -1 : parent >= 0 && parent < i,
              fmt::format("node {} has parent {}", i, parent));
    }
    t.states = shared ? shared_states() : unshared_states(parents);
    require_steps(t);
    return t;
  }

  void require_steps(const Tree& t) const {
    const std::span<const std::int64_t> steps = t.states.steps();
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::int64_t due = i == 0 ? steps[0] : steps[std::size_t(t.parents[i])] + t.controls[i].steps;
      require(steps[i] >= 0 && steps[i] <= max_counted && steps[i] == due,
              fmt::format("node {} is at step {}, its control ends at step {}", i, steps[i], due));
      require(t.iterations[i] >= -1 && t.iterations[i] <= iteration_limit,
              fmt::format("node {} is of iteration {}", i, t.iterations[i]));
    }
  }

  int whole(const Json& json, const char* name) const {
    const auto n = json.at(name).get<double>();
    require(n == std::floor(n) && std::abs(n) <= std::numeric_limits<std::int32_t>::max(),
            fmt::format("{} is {}", name, n));
    return int(n);
  }

  Ending ending(const Json& name) const {
    for (const Ending ending : {Ending::goal, Ending::iterations, Ending::time, Ending::stopped})
      if (name == name_of(ending)) return ending;
    refuse("its ending is " + name.dump() + ", which is none");
  }

  // Each leg begins at a node on the path, none before the one ahead of it.
  std::vector<Leg> legs(const Json& list, const Plan& plan) const {
    const std::vector<int> path = path_to(plan.tree, plan.best_node);
    std::vector<Leg> legs;
    for (const Json& leg : list) {
      legs.push_back({whole(leg, "root"), whole(leg, "first_iteration")});
      const Leg before = legs.size() == 1 ? Leg{} : legs[legs.size() - 2], now = legs.back();
      require(std::count(path.begin(), path.end(), now.root) == 1 && now.root >= before.root &&
                  now.first_iteration >= before.first_iteration &&
                  now.first_iteration <= plan.statistics.iterations && (legs.size() > 1 || now.root == 0),
              fmt::format("leg {} begins where none can", legs.size()));
    }
    const std::size_t goals = plan.settings.via.size() + 1;
    require(!legs.empty() && legs.size() <= goals && (!plan.solved() || legs.size() == goals),
            fmt::format("it has {} legs to {} goals", legs.size(), goals));
    return legs;
  }

  LeftOut left_out(const Json& whole_tree, const Plan& plan) const {
    require(!plan.simulation, "a simulation has no tree to be left out");
    const int nodes = plan.tree.size();
    const auto numbers = array<std::int32_t>("tree_number", nodes, 1);
    for (int n = 0; n < nodes; ++n) {
      const auto i = std::size_t(n);
      require(plan.tree.parents[i] == n - 1, fmt::format("node {} does not come after node {}", n, n - 1));
      require(n == 0 ? numbers[i] == 0 : numbers[i] > numbers[i - 1],
              fmt::format("tree_number[{}] is {}", n, numbers[i]));
    }
    require(plan.best_node == nodes - 1, "best_node is not the last of its path");
    LeftOut left_out{whole(whole_tree, "nodes"),
                     hash_from_hex(whole_tree.at("tree_hash").get<std::string>()),
                     hash_from_hex(whole_tree.at("search_hash").get<std::string>()),
                     {numbers.begin(), numbers.end()}};
    require(left_out.nodes > numbers.back(),
            fmt::format("whole_tree.nodes is {}, and there is a node {}", left_out.nodes, numbers.back()));
    return left_out;
  }

  // The frames are of the path: from the tree's start to the path's end, one a frame time. What they must be
  // to the step is known to who knows the length of a step (require_frame_times).
  void require_one_path(const Plan& plan) const {
    const Trajectory& t = plan.trajectory;
    require(!t.frames.empty(), "its path has no frame");
    std::int64_t step = plan.tree.states.steps()[0];
    require(t.frames.front().step == step, "frame 0 is not at the start");
    for (std::size_t f = 1; f < t.frames.size(); ++f)
      require(t.frames[f].step >= t.frames[f - 1].step, fmt::format("frame {} is before frame {}", f, f - 1));
    require(t.frames.back().step <= t.end.step, "its last frame is after the end");
    for (const Control& control : t.controls) {
      step += control.steps;
      require(step <= t.end.step, "its controls last longer than the path");
    }
    require(step == t.end.step, "its controls do not last as long as the path");
    require(t.settle_steps >= 0 && t.settle_steps <= (t.controls.empty() ? 0 : t.controls.back().steps),
            fmt::format("settle_steps is {}", t.settle_steps));
    require(t.frames_per_second == plan.settings.frames_per_second,
            fmt::format("frames_per_second is {}, and {} in its settings", t.frames_per_second,
                        plan.settings.frames_per_second));
  }

  // Entries that nothing else contradicts are at least those that were written.
  void require_seal() const {
    const auto found = file_.texts.find(seal_name);
    require(found != file_.texts.end() && found->second == hex(hash_) + "\n",
            "an entry was changed since it was written");
  }

  // What the tree says once more.
  void require_path_nodes(const std::vector<std::int32_t>& path) const {
    const auto written = array<std::int32_t>("path_node_of_tree", -1, 1);
    require(std::equal(written.begin(), written.end(), path.begin(), path.end()),
            "path_node_of_tree is not the way through the tree to best_node");
  }

  Json meta() const { return parse_json(file_.text("meta.json"), path_.string() + ": meta.json"); }

 private:
  using Sink = std::function<void(std::span<const std::byte>)>;

  // Where the rows of this array go; nothing: they stay in its entry.
  Sink sink_of(const std::string& name, const NpyArray& head) {
    const auto taken_as = [](auto& all) -> Sink {
      return [&all](std::span<const std::byte> rows) {
        using Row = typename std::remove_reference_t<decltype(all)>::value_type;
        for (; !rows.empty(); rows = rows.subspan(sizeof(Row)))
          std::memcpy(&all.emplace_back(), rows.data(), sizeof(Row));
      };
    };
    if (name == "tree_pieces" && head.dtype == "<f4" && head.shape.size() == 2 &&
        head.shape[1] == States::piece_length)
      return taken_as(pieces_);
    if (name == "tree_piece" && head.dtype == "<i4") return taken_as(piece_of_);
    return {};
  }

  fs::path path_;
  Npz file_;
  std::deque<States::Piece> pieces_;
  std::vector<std::int32_t> piece_of_;
  std::uint64_t hash_ = 0;        // of all entries but the seal
  const char* command_ = "plan";  // that makes such files
};

Statistics statistics_from_json(const Reader& reader, const Json& json, int edition) {
  const auto count = [&](const char* name) {
    const auto n = json.at(name).get<double>();  // of a whole number beyond 64 bits this, too, is a number
    reader.require(n >= 0 && n <= double(max_counted),
                   fmt::format("statistics.{} is {}; it must be in [0, {}]", name, n, max_counted));
    return json.at(name).get<std::int64_t>();
  };
  const auto seconds = [&](const char* name) {
    const auto s = json.at(name).get<double>();
    reader.require(std::isfinite(s) && s >= 0, fmt::format("statistics.{} is {}", name, s));
    return s;
  };
  Statistics s;
  s.iterations = count("iterations");
  reader.require(
      s.iterations <= iteration_limit,
      fmt::format("statistics.iterations is {}; it must be at most {}", s.iterations, iteration_limit));
  s.diverged = count("diverged"), s.rejected = count("rejected");
  if (json.contains("refused")) s.refused = count("refused");  // since edition 2 of the world
  if (json.contains("last_refusal")) s.last_refusal = json.at("last_refusal").get<std::string>();
  s.rollout_steps = count("rollout_steps");
  if (edition >= first_without_timings) return s;
  s.rollouts = count("rollouts"), s.rollouts_wrong = count("rollouts_wrong");
  s.cpu_s = seconds("cpu_s"), s.wall_s = seconds("wall_s");
  return s;
}

}  // namespace

Json json_of(const Statistics& s) {
  Json json{{"iterations", s.iterations}, {"diverged", s.diverged}, {"rejected", s.rejected},
            {"refused", s.refused},       {"rollouts", s.rollouts}, {"rollouts_wrong", s.rollouts_wrong},
            {"cpu_s", s.cpu_s},           {"wall_s", s.wall_s},     {"rollout_steps", s.rollout_steps}};
  if (!s.last_refusal.empty()) json["last_refusal"] = s.last_refusal;
  return json;
}

namespace {

Json json_of(const Simulation& simulation) {
  const auto ending = std::find_if(std::begin(simulation_endings), std::end(simulation_endings),
                                   [&](const auto& e) { return e.first == simulation.ending; });
  Json json{{"simulation", {{"duration_s", simulation.duration_s}, {"ending", ending->second}}}};
  if (simulation.steered) json["simulation"]["steered"] = true;
  return json;
}

Json json_of_search(const Plan& plan, int edition) {
  Json meta;
  meta["solved"] = plan.solved();
  meta["ending"] = name_of(plan.ending);
  meta["goal_node"] = plan.goal_node;
  meta["best_node"] = plan.best_node;
  meta["best_distance_m"] = plan.best_distance_m;
  for (std::size_t leg = 0; leg < plan.legs.size() && !plan.settings.via.empty(); ++leg)
    meta["legs"].push_back(
        {{"root", plan.legs[leg].root}, {"first_iteration", plan.legs[leg].first_iteration}});
  if (!plan.measured) meta["measured"] = false;
  meta["settings"] = json_of(plan.settings);
  meta["statistics"] = json_of(plan.statistics);
  if (edition < first_without_timings) return meta;
  meta["settings"].erase("in_flight");
  if (plan.ending != Ending::time) meta["settings"].erase("time_limit_s");
  meta["statistics"] = without_timings(meta["statistics"]);
  return meta;
}

void read_simulation(const Reader& reader, const Json& json, double frames_per_second, Plan& plan) {
  Simulation& simulation = plan.simulation.emplace();
  json.at("duration_s").get_to(simulation.duration_s);
  reader.require(simulation.duration_s > 0 && std::isfinite(simulation.duration_s),
                 fmt::format("it lasts {} s", simulation.duration_s));
  const auto ending = std::find_if(std::begin(simulation_endings), std::end(simulation_endings),
                                   [&](const auto& e) { return json.at("ending") == e.second; });
  reader.require(ending != std::end(simulation_endings),
                 "its ending is " + json.at("ending").dump() + ", which is none");
  simulation.ending = ending->first;
  reader.require(frames_per_second >= min_frames_per_second && frames_per_second <= max_frames_per_second,
                 fmt::format("frames_per_second is {}", frames_per_second));
  plan.settings.frames_per_second = frames_per_second;
  simulation.steered = json.value("steered", false);
  reader.require(simulation.steered || plan.tree.size() == 2,
                 "a simulation has a start and an end, and nothing else");
  for (int node = 1; node < plan.tree.size(); ++node)
    reader.require(plan.tree.parents[std::size_t(node)] == node - 1,
                   fmt::format("node {} does not come after node {}", node, node - 1));
  plan.best_node = plan.tree.size() - 1;
}

void read_search(const Reader& reader, const Json& meta, int edition, const std::string& file, Plan& plan) {
  Json settings = meta.at("settings");
  if (edition >= first_without_timings && settings.is_object()) {
    settings["in_flight"] = Settings{}.in_flight;
    settings.emplace("time_limit_s", nullptr);  // it is there where it ended the search
  }
  plan.settings = settings_from_json(settings, file);
  plan.statistics = statistics_from_json(reader, meta.at("statistics"), edition);
  plan.goal_node = reader.whole(meta, "goal_node"), plan.best_node = reader.whole(meta, "best_node");
  meta.at("best_distance_m").get_to(plan.best_distance_m);
  reader.require(plan.best_distance_m >= 0 && std::isfinite(plan.best_distance_m),
                 fmt::format("best_distance_m is {}", plan.best_distance_m));
  try {
    validate(plan.settings);
  } catch (const InputError& error) {
    reader.refuse(error.what());
  }
  plan.ending = reader.ending(meta.at("ending"));
  plan.measured = meta.value("measured", true);
  reader.require(plan.best_node >= 0 && plan.best_node < plan.tree.size(),
                 "best_node is not a node of the tree");
  reader.require(plan.goal_node == -1 || plan.goal_node == plan.best_node, "goal_node is not best_node");
  reader.require(meta.at("solved") == plan.solved(),
                 fmt::format("solved is {}, and goal_node {}", meta.at("solved").dump(), plan.goal_node));
  if (!plan.settings.via.empty()) plan.legs = reader.legs(meta.at("legs"), plan);
}

}  // namespace

NpzRows rows_of(const Plan& plan, const Json& given, std::optional<int> wanted) {
  const int edition = wanted.value_or(plan.left_out ? path_alone : newest_edition);
  LIMBER_CHECK(edition >= first_sealed && edition <= (plan.left_out ? path_alone : newest_edition), edition);
  NpzRows file;
  if (plan.left_out)
    put_rows<std::int32_t>(file, "tree_number", plan.tree.size(), 0,
                           [&](std::int64_t i, auto* row) { *row = plan.left_out->numbers[std::size_t(i)]; });
  put_shared_states(file, plan.tree.states);
  put_controls(file, "tree", plan.tree.controls);
  const std::int64_t nodes = plan.tree.size();
  put_rows<float>(file, "tree_center_m", nodes, 3,
                  [&](std::int64_t i, float* row) { std::copy_n(plan.tree.centers[int(i)].data(), 3, row); });
  put_rows<std::int32_t>(file, "tree_parent", nodes, 0,
                         [&](std::int64_t i, auto* row) { *row = plan.tree.parents[std::size_t(i)]; });
  put_rows<std::int64_t>(file, "tree_iteration", nodes, 0,
                         [&](std::int64_t i, auto* row) { *row = plan.tree.iterations[std::size_t(i)]; });
  const std::vector<std::int32_t> path_nodes = path_to(plan.tree, plan.best_node);
  put_rows<std::int32_t>(file, "path_node_of_tree", std::int64_t(path_nodes.size()), 0,
                         [=](std::int64_t i, auto* row) { *row = path_nodes[std::size_t(i)]; });
  put_controls(file, "path", plan.trajectory.controls);
  put_states(file, "frame", plan.trajectory.frames);
  put_states(file, "end", {&plan.trajectory.end, 1});

  Json meta;
  meta["format"] = format_names[edition - 1];
  meta.update(plan.simulation ? json_of(*plan.simulation) : json_of_search(plan, edition));
  meta["settle_steps"] = plan.trajectory.settle_steps;
  meta["frames_per_second"] = plan.trajectory.frames_per_second;
  if (const auto& left_out = plan.left_out)
    meta["whole_tree"] = {{"nodes", left_out->nodes},
                          {"tree_hash", hex(left_out->tree_hash)},
                          {"search_hash", hex(left_out->search_hash)}};
  meta["system_hash"] = hex(plan.system_hash);
  meta["tree_hash"] = hex(hash_of(plan.tree));
  meta["trajectory_hash"] = hex(hash_of(plan.trajectory));
  meta["given"] = given;
  file.texts["meta.json"] = meta.dump(2) + "\n";
  file.texts[seal_name] = hex(hash_of(file, seal_name)) + "\n";
  return file;
}

Npz npz_of(const Plan& plan, const Json& given, std::optional<int> edition) {
  return whole(rows_of(plan, given, edition));
}

void write_plan(const fs::path& path, const Plan& plan, const Json& given) {
  write_npz(path, rows_of(plan, given));
}

PlanFile read_plan(const fs::path& path) {
  Reader reader(path);
  const Json meta = reader.meta();
  reader.say_to_run(meta.contains("simulation") ? "simulate" : "plan");
  try {
    PlanFile file;
    const auto format = std::find(std::begin(format_names), std::end(format_names), meta.at("format"));
    reader.require(format != std::end(format_names), "it is not of this version's format");
    file.edition = int(format - std::begin(format_names)) + 1;
    Plan& plan = file.plan;
    plan.tree = reader.tree(file.edition > 1);
    if (meta.contains("simulation"))
      read_simulation(reader, meta.at("simulation"), meta.at("frames_per_second").get<double>(), plan);
    else
      read_search(reader, meta, file.edition, path.string(), plan);

    if (file.edition == path_alone) plan.left_out = reader.left_out(meta.at("whole_tree"), plan);

    Trajectory& t = plan.trajectory;
    t.controls = reader.controls("path", -1);
    const std::int64_t width = std::int64_t(plan.tree.states.numbers());
    t.frames = reader.states("frame", width);
    const auto end = reader.states("end", width);
    reader.require(end.size() == 1, "end is not one state");
    t.end = end.front();
    t.settle_steps = reader.whole(meta, "settle_steps");
    meta.at("frames_per_second").get_to(t.frames_per_second);
    reader.require_one_path(plan);

    plan.system_hash = hash_from_hex(meta.at("system_hash").get<std::string>());
    reader.require(meta.at("tree_hash") == hex(hash_of(plan.tree)),
                   "the tree was changed since it was written");
    reader.require(meta.at("trajectory_hash") == hex(hash_of(t)),
                   "the path was changed since it was written");
    reader.require_path_nodes(path_to(plan.tree, plan.best_node));
    if (file.sealed()) reader.require_seal();
    file.given = meta.at("given");
    return file;
  } catch (const Json::exception& trouble) {
    reader.refuse("meta.json: " + words_of(trouble));
  }
}

}  // namespace limber::plan
