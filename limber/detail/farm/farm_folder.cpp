#include "limber/detail/farm/farm_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/json_shape.h"
#include "core/json_text.h"
#include "core/threads.h"
#include "core/version.h"
#include "limber/detail/farm/lease.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/plan/manifest.h"
#include "render/film.h"
#include "render/png_file.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

constexpr const char* remedy = "submit anew with limber farm submit SCENE -o DIR";

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

// What the result depends on, by the names of the command's options.
Json result_of(const FarmSpec& spec) {
  if (const std::optional<BenchOptions>& bench = spec.options.bench)
    return {{"scenes", bench->scenes},
            {"scene_hash", spec.scene_hash},
            {"set", bench->sets},
            {"seeds", bench->seeds},
            {"presets", bench->presets},
            {"iterations", or_null(bench->iterations)},
            {"time_limit", std::isfinite(bench->time_limit_s) ? Json(bench->time_limit_s) : Json()},
            {"program", spec.program}};
  const PlanOptions& plan = spec.options.plan;
  const RenderOptions& film = spec.options.film;
  return {{"scene", plan.scene.scene},
          {"scene_hash", spec.scene_hash},
          {"set", plan.scene.sets},
          {"preset", plan.preset},
          {"seed", spec.first_seed},
          {"portfolio", plan.portfolio},
          {"iterations", or_null(plan.iterations)},
          {"shortcut", or_null(plan.shortcut_rounds)},
          {"cost", plan.cost},
          {"size", film.size},
          {"camera", film.camera},
          {"passes", film.passes},
          {"bits", film.bits},
          {"program", spec.program}};
}

Json json_of(const FarmSpec& spec) {
  Json json{{"version", version}, {"key", spec.key}, {"result", result_of(spec)}};
  std::vector<std::string> data;
  const SceneOptions& scene = spec.options.plan.scene;
  const std::optional<BenchOptions>& bench = spec.options.bench;
  for (const fs::path& folder : bench ? bench->data : scene.data) data.push_back(folder.string());
  json["data"] = data;
  json["store"] = (bench ? bench->store : scene.store).string();
  if (bench) json["runs_per_task"] = spec.options.runs_per_task, json["in_flight"] = bench->in_flight;
  json["bodies"] = spec.bodies;
  json["engine"] = spec.options.engine;
  json["workers"] = spec.options.workers;
  json["threads"] = spec.options.threads;
  json["frames_per_task"] = spec.options.frames_per_task;
  json["chunks"] = spec.options.chunks;
  json["sbatch"] = spec.options.sbatch;
  json["until"] = name_of(spec.options.until);
  return json;
}

// Whether it is there and not null, of which is asked that it is a number.
bool has_number(const Json& result, const char* key, const fs::path& file) {
  const Json value = result.value(key, Json());
  if (value.is_null()) return false;
  if (!value.is_number())
    throw InputError(fmt::format("{}: result.{} is no number; {}", file.string(), key, remedy));
  return true;
}
std::optional<std::int64_t> whole_or_nothing(const Json& result, const char* key, const fs::path& file) {
  if (!has_number(result, key, file)) return std::nullopt;
  if (!result.at(key).is_number_integer())
    throw InputError(fmt::format("{}: result.{} is no whole number; {}", file.string(), key, remedy));
  return result.at(key).get<std::int64_t>();
}

std::vector<fs::path> folders_in(const Json& list) {
  std::vector<fs::path> folders;
  for (const Json& folder : list) folders.emplace_back(folder.get<std::string>());
  return folders;
}

void read_scene_farm(const Json& json, const fs::path& file, FarmSpec& spec) {
  const Json& result = json.at("result");
  require_like(result,
               {{"scene", ""},
                {"set", {""}},
                {"preset", ""},
                {"seed", 1},
                {"portfolio", -1},
                {"cost", ""},
                {"size", ""},
                {"camera", ""},
                {"passes", {""}},
                {"bits", -1}},
               Keys::all, file.string() + ": result", remedy);
  PlanOptions& plan = spec.options.plan;
  RenderOptions& film = spec.options.film;
  result.at("scene").get_to(plan.scene.scene);
  result.at("set").get_to(plan.scene.sets);
  plan.scene.data = folders_in(json.at("data"));
  plan.scene.store = json.at("store").get<std::string>();
  result.at("preset").get_to(plan.preset);
  result.at("portfolio").get_to(plan.portfolio);
  plan.iterations = whole_or_nothing(result, "iterations", file);
  if (const auto rounds = whole_or_nothing(result, "shortcut", file)) plan.shortcut_rounds = int(*rounds);
  result.at("cost").get_to(plan.cost);
  result.at("size").get_to(film.size);
  result.at("camera").get_to(film.camera);
  result.at("passes").get_to(film.passes);
  result.at("bits").get_to(film.bits);
  film.resume = true;
  result.at("seed").get_to(spec.first_seed);
  plan.seed = std::int64_t(spec.first_seed);
}

void read_bench_farm(const Json& json, const fs::path& file, FarmSpec& spec) {
  const Json& result = json.at("result");
  require_like(result, {{"scenes", {""}}, {"set", {""}}, {"seeds", ""}, {"presets", {""}}}, Keys::all,
               file.string() + ": result", remedy);
  require_like(json, {{"runs_per_task", -1}, {"in_flight", -1}}, Keys::all, file.string(), remedy);
  BenchOptions& bench = spec.options.bench.emplace();
  result.at("scenes").get_to(bench.scenes);
  result.at("set").get_to(bench.sets);
  result.at("seeds").get_to(bench.seeds);
  result.at("presets").get_to(bench.presets);
  bench.data = folders_in(json.at("data"));
  bench.store = json.at("store").get<std::string>();
  bench.iterations = whole_or_nothing(result, "iterations", file);
  if (has_number(result, "time_limit", file)) bench.time_limit_s = result.at("time_limit").get<double>();
  json.at("in_flight").get_to(bench.in_flight);
  json.at("runs_per_task").get_to(spec.options.runs_per_task);
}

FarmSpec spec_from(const Json& json, const fs::path& file) {
  require_like(json,
               {{"version", ""},
                {"key", ""},
                {"result", {{"scene_hash", ""}, {"program", ""}}},
                {"data", {""}},
                {"store", ""},
                {"bodies", {""}},
                {"engine", ""},
                {"workers", -1},
                {"threads", -1},
                {"frames_per_task", -1},
                {"chunks", -1},
                {"sbatch", {""}},
                {"until", ""}},
               Keys::all, file.string(), remedy);
  FarmSpec spec;
  const Json& result = json.at("result");
  const bool is_bench = result.contains("scenes");
  is_bench ? read_bench_farm(json, file, spec) : read_scene_farm(json, file, spec);
  result.at("scene_hash").get_to(spec.scene_hash);
  result.at("program").get_to(spec.program);
  json.at("key").get_to(spec.key);
  json.at("bodies").get_to(spec.bodies);
  json.at("engine").get_to(spec.options.engine);
  json.at("workers").get_to(spec.options.workers);
  json.at("threads").get_to(spec.options.threads);
  json.at("frames_per_task").get_to(spec.options.frames_per_task);
  json.at("chunks").get_to(spec.options.chunks);
  json.at("sbatch").get_to(spec.options.sbatch);
  spec.options.until = stage_named(json.at("until").get<std::string>());
  if (is_bench != (spec.options.until >= Stage::runs))
    throw InputError(fmt::format("{}: until is {}, which is no stage of {}; {}", file.string(),
                                 name_of(spec.options.until), is_bench ? "a benchmark" : "a scene", remedy));
  const auto within = [&](const char* key, int value, int least, int most) {
    if (value < least || value > most)
      throw InputError(fmt::format("{}: {} is {}; it must be in [{}, {}]; {}", file.string(), key, value,
                                   least, most, remedy));
  };
  within("result.portfolio", spec.options.plan.portfolio, 1, 1000);
  within("workers", spec.options.workers, 1, 1000);
  within("threads", spec.options.threads, 1, 256);
  within("frames_per_task", spec.options.frames_per_task, 1, 1000000);
  within("chunks", spec.options.chunks, 0, 1000000);
  within("runs_per_task", spec.options.runs_per_task, 1, 1000000);
  return spec;
}

// The work folder may be moved, so its path is not in it.
FarmSpec read_spec(const fs::path& work) {
  const fs::path file = work / "farm" / "farm.json";
  if (!fs::exists(file))
    throw InputError(
        fmt::format("{}: there is no such file; nothing was submitted in {}; limber farm submit "
                    "SCENE -o {}",
                    file.string(), work.string(), work.string()));
  FarmSpec spec = spec_from(read_json(file), file);
  spec.options.plan.out = spec.options.film.folder = work;
  if (spec.options.bench) spec.options.bench->out = work;
  return spec;
}

// Files in farm/ may be damaged: what is none of ours is not there.
std::string text_in(const Json& json, const char* key) {
  return json.is_object() && json.contains(key) && json.at(key).is_string() ? json.at(key).get<std::string>()
                                                                            : "";
}
std::vector<std::string> frame_hashes_in(const Json& plan) {
  std::vector<std::string> hashes;
  if (plan.contains("frame_hashes") && plan.at("frame_hashes").is_array())
    for (const Json& hash : plan.at("frame_hashes"))
      hashes.push_back(hash.is_string() ? hash.get<std::string>() : "");
  return hashes;
}

void require_camera(const scenes::Scene& scene, const std::string& camera) {
  std::vector<std::string> names;
  for (const scenes::CameraSpec& one : scene.cameras) names.push_back(one.name);
  if (std::find(names.begin(), names.end(), camera) == names.end())
    throw InputError(fmt::format("--camera {}: the scene has no such camera; there are: {}", camera,
                                 fmt::join(names, ", ")));
}

}  // namespace

std::string name_of(Stage stage) { return stage_names[std::size_t(stage)]; }

Stage stage_named(const std::string& name) {
  const auto found = std::find(stage_names.begin(), stage_names.end(), name);
  if (found == stage_names.end())
    throw InputError(fmt::format("{} is no stage; they are {}", name, fmt::join(stage_names, ", ")));
  return Stage(found - stage_names.begin());
}

std::string hash_of_scenes(const FarmOptions& options) {
  if (!options.bench) return content_hash(read_file(options.plan.scene.scene));
  std::string all;
  for (const std::string& scene : options.bench->scenes) all += content_hash(read_file(scene));
  return content_hash(all);
}

namespace {

void set_workers(FarmOptions& options) {
  if (options.workers == 0)
    options.workers = options.engine == "local" ? std::max(1, thread_count() / options.threads) : 8;
}

FarmSpec spec_of_bench(FarmOptions options) {
  BenchOptions& bench = *options.bench;
  FarmSpec spec;
  for (std::string& scene : bench.scenes)
    scene = fs::absolute(scenes::find_scene(scene)).lexically_normal().string();
  for (fs::path& folder : bench.data) folder = fs::absolute(folder).lexically_normal();
  if (!bench.store.empty()) bench.store = fs::absolute(bench.store).lexically_normal();
  bench.out = options.plan.out = options.film.folder = fs::absolute(bench.out).lexically_normal();
  options.until = Stage::table;
  set_workers(options);
  spec.program = program_hash();
  const BenchRuns possible(bench);
  for (const std::string& given : bench.scenes) {
    PlanOptions plan;
    plan.scene = {given, bench.sets, bench.data};
    if (bench.presets.empty()) settings_of(read_scene(plan), plan);
    for (const std::string& preset : bench.presets) plan.preset = preset, settings_of(read_scene(plan), plan);
    const scenes::Scene scene = read_scene(plan);
    for (const scenes::BodySpec& body : scene.bodies) identity_of(scene, body, bench.data);
    if (std::count(spec.bodies.begin(), spec.bodies.end(), scene.name) > 0)
      throw InputError(
          fmt::format("{}: is another scene with the name \"{}\"; rename one", given, scene.name));
    spec.bodies.push_back(scene.name);
  }
  spec.scene_hash = hash_of_scenes(options);
  spec.options = std::move(options);
  spec.key = content_hash(text_of(result_of(spec)));
  return spec;
}

}  // namespace

FarmSpec spec_of(FarmOptions options) {
  if (options.bench) return spec_of_bench(std::move(options));
  FarmSpec spec;
  PlanOptions& plan = options.plan;
  // Workers begin in folders of their own.
  plan.scene.scene = fs::absolute(scenes::find_scene(plan.scene.scene)).lexically_normal().string();
  for (fs::path& folder : plan.scene.data) folder = fs::absolute(folder).lexically_normal();
  if (!plan.scene.store.empty()) plan.scene.store = fs::absolute(plan.scene.store).lexically_normal();
  plan.out = fs::absolute(plan.out).lexically_normal();
  options.film.folder = plan.out, options.film.resume = true;

  const scenes::Scene scene = read_scene(plan);
  for (const scenes::BodySpec& body : scene.bodies) {
    identity_of(scene, body, plan.scene.data);  // finds its model
    spec.bodies.push_back(body.name);
  }
  if (options.until >= Stage::film) render::require_film_possible(scene.film.frames_per_second, "film.mp4");
  require_letters(scene.film);
  require_camera(scene, options.film.camera);
  if (!options.film.size.empty()) parse_size(options.film.size);
  if (options.chunks > 0 && options.frames_per_task != FarmOptions{}.frames_per_task)
    throw InputError("--chunks and --frames-per-task both say how the frames are parted; leave one out");
  set_workers(options);

  spec.first_seed = std::uint64_t(plan.seed.value_or(scene.planner.seed));
  spec.scene_hash = hash_of_scenes(options);
  spec.program = program_hash();
  spec.options = std::move(options);
  spec.key = content_hash(text_of(result_of(spec)));
  return spec;
}

FarmFolder::FarmFolder(fs::path work, FarmSpec spec) : work_(std::move(work)), spec_(std::move(spec)) {}

FarmFolder::FarmFolder(const fs::path& work_folder)
    : FarmFolder(fs::absolute(work_folder).lexically_normal(),
                 read_spec(fs::absolute(work_folder).lexically_normal())) {}

bool FarmFolder::is_there(const fs::path& work_folder) {
  return fs::exists(work_folder / "farm" / "farm.json");
}

FarmFolder FarmFolder::imagined(const FarmSpec& spec) {
  FarmFolder farm(spec.options.plan.out, spec);
  if (is_there(farm.work_)) try {
      farm.forgets_ = read_spec(farm.work_).key != spec.key;
    } catch (const InputError&) {
      farm.forgets_ = true;
    }
  return farm;
}

FarmFolder FarmFolder::begin(const FarmSpec& spec) {
  FarmFolder farm = imagined(spec);
  std::error_code none;
  fs::remove(farm.folder() / "cancelled");
  fs::remove_all(farm.folder() / "failed", none);
  if (farm.forgets_)
    for (const char* part : {"done", "searches"}) fs::remove_all(farm.folder() / part, none);
  farm.forgets_ = false;
  for (const char* part : {"done", "failed", "leases", "searches", "log"}) make_folder(farm.folder() / part);
  for (const auto& [unit, lease] : Leases::look_once(farm.leases()))  // the next who take them are the first
    for (int taken = 1; lease.lost && taken <= lease.taken; ++taken)
      fs::remove(farm.leases() / fmt::format("{}.{}", unit, taken), none);
  write_json(farm.folder() / "farm.json", json_of(spec));
  return farm;
}

std::vector<Stage> FarmFolder::stages() const {
  if (spec_.options.bench) return {Stage::bodies, Stage::runs, Stage::table};
  std::vector<Stage> stages;
  for (int s = 0; s <= int(spec_.options.until); ++s) stages.push_back(Stage(s));
  return stages;
}

std::vector<Unit> FarmFolder::units(Stage stage) const {
  std::vector<Unit> units;
  const auto add = [&](const std::string& name) -> Unit& {
    return units.emplace_back(Unit{.stage = stage, .name = name, .body = {}, .frames = {}, .runs = {}});
  };
  if (stage == Stage::bodies && spec_.options.bench) {
    for (std::size_t s = 0; s < spec_.bodies.size(); ++s) add("bodies-" + spec_.bodies[s]).scene = s;
  } else if (stage == Stage::runs) {
    const std::size_t count = spec_.options.bench ? BenchRuns(*spec_.options.bench).count() : 0;
    const auto at_once = std::size_t(spec_.options.runs_per_task);
    for (std::size_t first = 0; first < count; first += at_once) {
      const std::size_t behind = std::min(first + at_once, count);
      Unit& unit =
          add(at_once == 1 ? fmt::format("run-{}", first + 1) : fmt::format("runs-{}-{}", first + 1, behind));
      for (std::size_t run = first; run < behind; ++run) unit.runs.push_back(run);
    }
  } else if (stage == Stage::bodies) {
    for (const std::string& body : spec_.bodies) add("body-" + body).body = body;
    add("beside");
  } else if (stage == Stage::search) {
    for (int k = 0; k < spec_.options.plan.portfolio; ++k) {
      const std::uint64_t seed = spec_.first_seed + std::uint64_t(k);
      add(fmt::format("search-{}", seed)).seed = seed;
    }
  } else if (stage == Stage::frames) {
    const int count = int(frames().hashes.size());
    const int parts = spec_.options.chunks > 0
                          ? std::min(spec_.options.chunks, count)
                          : (count + spec_.options.frames_per_task - 1) / spec_.options.frames_per_task;
    std::vector<int> all(std::size_t(count), 0);
    for (int f = 0; f < count; ++f) all[std::size_t(f)] = f;
    for (int part = 1; part <= parts; ++part) {
      std::vector<int> of_part = chunk_of(all, fmt::format("{}/{}", part, parts));
      add(fmt::format("frames-{}-{}", of_part.front(), of_part.back())).frames = of_part;
    }
  } else {
    add(name_of(stage));
  }
  return units;
}

fs::path FarmFolder::done_file(const Unit& unit) const { return folder() / "done" / (unit.name + ".json"); }
fs::path FarmFolder::failed_file(const Unit& unit) const {
  return folder() / "failed" / (unit.name + ".json");
}
fs::path FarmFolder::search_file(const Unit& unit) const {
  return folder() / "searches" / (unit.name + ".npz");
}

Json FarmFolder::told_of(const Unit& unit) const {
  if (forgets_) return Json::object();
  try {
    Json told = read_json(done_file(unit));
    return told.is_object() ? told : Json::object();
  } catch (const InputError&) {
    return Json::object();
  }
}

const FarmFolder::Frames& FarmFolder::frames() const {
  std::error_code none;
  const fs::file_time_type written = fs::last_write_time(done_file(plan_unit()), none);
  if (none || written != frames_.first) {
    const Json plan = told_of(plan_unit());
    frames_ = {written, {work_ / text_in(plan, "frames_folder"), frame_hashes_in(plan)}};
  }
  return frames_.second;
}

bool FarmFolder::is_done(const Unit& unit) const {
  if (forgets_) return false;
  if (unit.stage == Stage::frames) {  // the pictures themselves tell, by the hashes in them
    const std::vector<std::string>& hashes = frames().hashes;
    const FrameFiles files{frames().folder};
    for (const int frame : unit.frames) {
      if (std::size_t(frame) >= hashes.size()) return false;
      const auto shows = [&](const std::string& pass) {
        return render::frame_hash(files.of(frame, pass)) == hashes[std::size_t(frame)];
      };
      const auto& passes = spec_.options.film.passes;
      if (!shows("") || !std::all_of(passes.begin(), passes.end(), shows)) return false;
    }
    return true;
  }
  if (!fs::exists(done_file(unit))) return false;
  switch (unit.stage) {
    case Stage::runs: {
      const Json records = told_of(unit).value("records", Json::array());
      return records.size() == unit.runs.size() &&
             std::all_of(records.begin(), records.end(), [&](const Json& record) {
               return record.is_string() &&
                      fs::exists(work_ / "runs" / (record.get<std::string>() + ".json"));
             });
    }
    case Stage::table:
      return fs::exists(work_ / "bench.html");
    case Stage::bodies:
      return unit.body.empty() || fs::exists(work_ / "bodies" / unit.body / "report.json");
    case Stage::plan:
      return fs::exists(work_ / "plan.npz");
    case Stage::film:
      return fs::is_regular_file(work_ / text_in(told_of(unit), "film"));
    case Stage::report:
      return fs::exists(work_ / "report.html");
    default:
      return true;
  }
}

std::optional<Json> FarmFolder::failure_of(const Unit& unit) const {
  if (!fs::exists(failed_file(unit))) return std::nullopt;
  Json said;
  try {
    said = read_json(failed_file(unit));
  } catch (const InputError&) {
  }
  const auto word = [&](const char* key, const char* otherwise) {
    const std::string text = text_in(said, key);
    return text.empty() ? otherwise : text;
  };
  const bool has_code =
      said.is_object() && said.contains("exit_code") && said.at("exit_code").is_number_integer();
  return Json{{"reason", word("reason", "defect")},
              {"message", word("message", "its file in farm/failed is damaged")},
              {"exit_code", has_code ? said.at("exit_code").get<int>() : 1}};
}

void FarmFolder::mark_done(const Unit& unit, const Json& told) const {
  write_json(done_file(unit), told);
  std::error_code none;
  fs::remove(failed_file(unit), none);
}

void FarmFolder::mark_failed(const Unit& unit, const std::string& reason, const std::string& message,
                             int exit_code) const {
  write_json(failed_file(unit), {{"reason", reason}, {"message", message}, {"exit_code", exit_code}});
}

void FarmFolder::forget(const Unit& unit) const {
  std::error_code none;
  fs::remove(done_file(unit), none);
}

void FarmFolder::cancel() const { write_file(folder() / "cancelled", "limber farm submit goes on\n"); }
bool FarmFolder::is_cancelled() const { return fs::exists(folder() / "cancelled"); }

Json FarmFolder::jobs() const {
  Json said;
  try {
    said = read_json(folder() / "jobs.json");
  } catch (const InputError&) {
  }
  Json jobs{{"jobs", Json::array()}, {"rounds", 0}};
  if (!said.is_object()) return jobs;
  if (said.contains("rounds") && said.at("rounds").is_number_integer()) jobs["rounds"] = said.at("rounds");
  // They become words of commands.
  const auto is_id = [](const Json& id) {
    return id.is_string() && !id.get<std::string>().empty() &&
           id.get<std::string>().find_first_not_of("0123456789") == std::string::npos;
  };
  if (said.contains("jobs") && said.at("jobs").is_array())
    for (const Json& id : said.at("jobs"))
      if (is_id(id)) jobs["jobs"].push_back(id);
  return jobs;
}

void FarmFolder::write_jobs(const Json& jobs) const { write_json(folder() / "jobs.json", jobs); }

std::optional<Best> best_search(const FarmFolder& farm) {
  std::optional<Best> best;
  for (const Unit& unit : farm.units(Stage::search)) {
    const Json told = farm.told_of(unit);
    if (!told.contains("solved") || told.at("solved") != true || !told.contains("iterations") ||
        !told.at("iterations").is_number_integer())
      continue;
    const Best one{told.at("iterations").get<std::int64_t>(), unit.seed};
    if (!best || one.iterations < best->iterations) best = one;
  }
  return best;
}

}  // namespace limber::detail
