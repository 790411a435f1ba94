#include "limber/detail/farm/farm_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <thread>

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

constexpr const char* remedy =
    "submit anew what was submitted: limber farm submit SCENE, limber farm bench SCENE… or limber farm "
    "prepare "
    "MODEL…, with -o DIR";

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

// By the names of the command's options.
Json json_of(const PrepareOptions& o) {
  return {{"shells", o.shells},
          {"concavity", o.concavity},
          {"inflate", o.inflate},
          {"threshold", o.threshold},
          {"exact", o.exact},
          {"shell_corners", o.corners},
          {"tets", o.tets},
          {"mode", o.mode},
          {"scale", o.scale},
          {"y_up", o.y_up},
          {"preview", o.preview},
          {"export", o.exports},
          {"density", o.density_kg_m3},
          {"only", o.only},
          {"label", o.label},
          {"label_gap", o.label_gap},
          {"label_smoothing", o.label_rounds},
          {"least_island", o.min_island}};
}

void read_prepare(const Json& json, PrepareOptions& o) {
  json.at("shells").get_to(o.shells), json.at("concavity").get_to(o.concavity);
  json.at("inflate").get_to(o.inflate), json.at("threshold").get_to(o.threshold);
  json.at("exact").get_to(o.exact), json.at("shell_corners").get_to(o.corners);
  json.at("tets").get_to(o.tets), json.at("mode").get_to(o.mode);
  json.at("scale").get_to(o.scale), json.at("y_up").get_to(o.y_up);
  json.at("preview").get_to(o.preview), json.at("export").get_to(o.exports);
  json.at("density").get_to(o.density_kg_m3), json.at("only").get_to(o.only);
  json.at("label").get_to(o.label), json.at("label_gap").get_to(o.label_gap);
  json.at("label_smoothing").get_to(o.label_rounds), json.at("least_island").get_to(o.min_island);
}

Json result_of_batch(const FarmSpec& spec) {
  const BatchOptions& batch = *spec.options.batch;
  std::vector<std::string> files, names;
  for (const ListedModel& model : batch.listed)
    files.push_back(model.file.string()), names.push_back(model.name);
  return {{"models", files},
          {"names", names},
          {"scene_hash", spec.scene_hash},
          {"prepare", json_of(batch.each)},
          {"time_limit", batch.time_limit_s},
          {"memory_limit", batch.memory_mb},
          {"retry_failed", batch.retry_failed},
          {"program", spec.program}};
}

// What the result depends on, by the names of the command's options.
Json result_of(const FarmSpec& spec) {
  if (spec.options.batch) return result_of_batch(spec);
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

}  // namespace

Json json_of(const FarmSpec& spec) {
  Json json{{"version", version}, {"key", spec.key}, {"result", result_of(spec)}};
  std::vector<std::string> data;
  const SceneOptions& scene = spec.options.plan.scene;
  const std::optional<BenchOptions>& bench = spec.options.bench;
  const std::optional<BatchOptions>& batch = spec.options.batch;
  for (const fs::path& folder : bench ? bench->data : scene.data) data.push_back(folder.string());
  json["data"] = data;
  json["store"] = (bench ? bench->store : batch ? batch->each.store : scene.store).string();
  if (bench) json["runs_per_task"] = spec.options.runs_per_task, json["in_flight"] = bench->in_flight;
  if (batch) json["models_per_task"] = spec.options.models_per_task;
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

namespace {

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

void read_batch_farm(const Json& json, const fs::path& file, FarmSpec& spec) {
  const Json& result = json.at("result");
  require_like(result,
               {{"models", {""}},
                {"names", {""}},
                {"prepare", json_of(PrepareOptions{})},
                {"time_limit", 1.5},
                {"memory_limit", 1.5},
                {"retry_failed", true}},
               Keys::all, file.string() + ": result", remedy);
  require_like(json, {{"models_per_task", -1}}, Keys::all, file.string(), remedy);
  BatchOptions& batch = spec.options.batch.emplace();
  const auto files = result.at("models").get<std::vector<std::string>>(),
             names = result.at("names").get<std::vector<std::string>>();
  if (files.empty() || files.size() != names.size())
    throw InputError(fmt::format("{}: it has {} models and {} names of models; {}", file.string(),
                                 files.size(), names.size(), remedy));
  for (std::size_t m = 0; m < files.size(); ++m) batch.listed.push_back({files[m], names[m]});
  read_prepare(result.at("prepare"), batch.each);
  batch.each.store = json.at("store").get<std::string>();
  result.at("time_limit").get_to(batch.time_limit_s);
  result.at("memory_limit").get_to(batch.memory_mb);
  result.at("retry_failed").get_to(batch.retry_failed);
  json.at("models_per_task").get_to(spec.options.models_per_task);
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
  const bool is_bench = result.contains("scenes"), is_batch = result.contains("prepare");
  is_bench   ? read_bench_farm(json, file, spec)
  : is_batch ? read_batch_farm(json, file, spec)
             : read_scene_farm(json, file, spec);
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
  const Stage until = spec.options.until;
  const bool fits = is_bench   ? until == Stage::table
                    : is_batch ? until == Stage::page
                               : until <= Stage::report;
  if (!fits)
    throw InputError(fmt::format("{}: until is {}, which is no last stage of {}; {}", file.string(),
                                 name_of(until),
                                 is_bench   ? "a benchmark"
                                 : is_batch ? "a batch of models"
                                            : "a scene",
                                 remedy));
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
  within("models_per_task", spec.options.models_per_task, 1, 1000000);
  return spec;
}

}  // namespace

// The work folder may be moved, so its path is not in it.
FarmSpec read_spec(const fs::path& work) {
  const fs::path file = work / "farm" / "farm.json";
  if (!fs::exists(file))
    throw InputError(
        fmt::format("{}: there is no such file; nothing was submitted in {}; limber farm submit "
                    "SCENE -o {} does (or limber farm bench, limber farm prepare)",
                    file.string(), work.string(), work.string()));
  FarmSpec spec = spec_from(read_json(file), file);
  spec.options.plan.out = spec.options.film.folder = work;
  if (spec.options.bench) spec.options.bench->out = work;
  if (spec.options.batch) spec.options.batch->each.out = work;
  return spec;
}

namespace {

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
  if (options.batch) return content_hash("");
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

// Size and time of each, so that who submits anew after an edit has all looked at once more.
std::string stamps_of(const std::vector<ListedModel>& models) {
  std::string all;
  for (const ListedModel& model : models) {
    std::error_code none;
    all += fmt::format("{} {} ", fs::file_size(model.file, none),
                       fs::last_write_time(model.file, none).time_since_epoch().count());
  }
  return content_hash(all);
}

FarmSpec spec_of_batch(FarmOptions options) {
  BatchOptions& batch = *options.batch;
  require_agreeing(batch.each);
  batch.each.out = options.plan.out = options.film.folder = fs::absolute(batch.each.out).lexically_normal();
  fs::path& store = batch.each.store;
  store = store.empty() ? batch.each.out / "store" : fs::absolute(store).lexically_normal();
  if (batch.listed.empty()) batch.listed = list_models(batch.models, {batch.each.out, store});
  for (ListedModel& model : batch.listed) model.file = fs::absolute(model.file).lexically_normal();
  // The same for all workers, whatever their machines have.
  if (batch.memory_mb == 0) batch.memory_mb = memory_share_mb(int(std::thread::hardware_concurrency()));
  options.until = Stage::page;
  set_workers(options);
  FarmSpec spec;
  spec.program = program_hash();
  spec.scene_hash = hash_of_scenes(options);
  spec.options = std::move(options);
  spec.key = content_hash(text_of(result_of(spec)) + stamps_of(spec.options.batch->listed));
  return spec;
}

}  // namespace

FarmSpec spec_of(FarmOptions options) {
  if (options.bench) return spec_of_bench(std::move(options));
  if (options.batch) return spec_of_batch(std::move(options));
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

}  // namespace limber::detail
