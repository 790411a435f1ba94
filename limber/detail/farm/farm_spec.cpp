#include "limber/detail/farm/farm_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/json_fields.h"
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

// What the result depends on, by the names of the command's options.
struct ResultOfScene {
  FarmSpec& spec;
  template <class Fields>
  void fields(Fields& f) {
    PlanOptions& plan = spec.options.plan;
    FilmOptions& film = spec.options.film;
    f("scene", plan.scene.scene), f("scene_hash", spec.scene_hash), f("set", plan.scene.sets);
    f("preset", plan.preset), f("seed", spec.first_seed), f.within("portfolio", plan.portfolio, 1, 1000);
    f("iterations", plan.iterations), f("shortcut", plan.shortcut_rounds), f("cost", plan.cost);
    f.unless_usual("keep_tree", plan.keep_tree, std::string("all"));
    f("size", film.size), f("camera", film.camera), f("passes", film.passes), f("bits", film.bits);
    f("program", spec.program);
  }
};

struct ResultOfBench {
  FarmSpec& spec;
  template <class Fields>
  void fields(Fields& f) {
    BenchOptions& bench = *spec.options.bench;
    std::optional<double> limit_s;
    if (std::isfinite(bench.time_limit_s)) limit_s = bench.time_limit_s;
    f("scenes", bench.scenes), f("scene_hash", spec.scene_hash), f("set", bench.sets);
    f("seeds", bench.seeds), f("presets", bench.presets), f("iterations", bench.iterations);
    f("time_limit", limit_s), f("program", spec.program);
    bench.time_limit_s = limit_s.value_or(std::numeric_limits<double>::infinity());
  }
};

struct ResultOfBatch {
  FarmSpec& spec;
  template <class Fields>
  void fields(Fields& f) {
    BatchOptions& batch = *spec.options.batch;
    std::vector<std::string> files, names;
    for (const ListedModel& model : batch.listed)
      files.push_back(model.file.string()), names.push_back(model.name);
    f("models", files), f("names", names), f("scene_hash", spec.scene_hash), f("prepare", batch.each);
    f("time_limit", batch.time_limit_s), f("memory_limit", batch.memory_mb);
    f("retry_failed", batch.retry_failed), f("program", spec.program);
    batch.listed.clear();
    for (std::size_t m = 0; m < files.size() && files.size() == names.size(); ++m)
      batch.listed.push_back({files[m], names[m]});
  }
};

// Calls `f` with that of the spec's kind.
template <class F>
auto with_result(FarmSpec& spec, const F& f) {
  if (spec.options.bench) return f(ResultOfBench{spec});
  if (spec.options.batch) return f(ResultOfBatch{spec});
  return f(ResultOfScene{spec});
}

struct FarmFile {
  FarmSpec& spec;
  std::string written_by = version;

  template <class Fields>
  void fields(Fields& f) {
    FarmOptions& options = spec.options;
    f("version", written_by), f("key", spec.key);
    with_result(spec, [&](auto result) { f("result", result); });
    SceneSource& scene = options.plan.scene;
    f("data", options.bench ? options.bench->data : scene.data);
    f("store", options.bench   ? options.bench->store
               : options.batch ? options.batch->each.store
                               : scene.store);
    if (options.bench) {
      f.within("runs_per_task", options.runs_per_task, 1, 1000000);
      f("in_flight", options.bench->in_flight);
    }
    if (options.batch) f.within("models_per_task", options.models_per_task, 1, 1000000);
    f("bodies", spec.bodies), f("engine", options.engine);
    f.within("workers", options.workers, 1, 1000), f.within("threads", options.threads, 1, 256);
    f.within("frames_per_task", options.frames_per_task, 1, 1000000);
    f.within("chunks", options.chunks, 0, 1000000), f("sbatch", options.sbatch);
    std::string until = name_of(options.until);
    f("until", until);
    options.until = stage_named(until);
  }
};

Json result_of(FarmSpec spec) {
  return with_result(spec, [](const auto& result) { return json_of_fields(result); });
}

}  // namespace

Json json_of(FarmSpec spec) { return json_of_fields(FarmFile{spec}); }

namespace {

// By what its result depends on: a benchmark has scenes, a batch how to prepare.
struct Kind {
  struct Result {
    std::optional<Json> scenes, prepare;
    template <class Fields>
    void fields(Fields& f) {
      f("scenes", scenes), f("prepare", prepare);
    }
  };
  Result result;
  template <class Fields>
  void fields(Fields& f) {
    f("result", result);
  }
};

FarmSpec spec_from(const Json& json, const fs::path& file) {
  const Kind::Result kind = read_fields<Kind>(json, file.string(), remedy).result;
  FarmSpec spec;
  if (kind.scenes)
    spec.options.bench.emplace();
  else if (kind.prepare)
    spec.options.batch.emplace();
  FarmFile read{spec};
  FieldReader::read(json, read, JsonPlace{file.string(), "", remedy});
  if (spec.options.batch && spec.options.batch->listed.empty())
    throw InputError(
        fmt::format("{}: it has no models, or not as many names of models; {}", file.string(), remedy));
  const Stage until = spec.options.until;
  const bool fits = kind.scenes    ? until == Stage::table
                    : kind.prepare ? until == Stage::page
                                   : until <= Stage::report;
  if (!fits)
    throw InputError(fmt::format("{}: until is {}, which is no last stage of {}; {}", file.string(),
                                 name_of(until),
                                 kind.scenes    ? "a benchmark"
                                 : kind.prepare ? "a batch of models"
                                                : "a scene",
                                 remedy));
  spec.options.film.resume = true;
  spec.options.plan.seed = std::int64_t(spec.first_seed);
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
  spec.options.plan.out = work;
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
  bench.out = options.plan.out = fs::absolute(bench.out).lexically_normal();
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
  batch.each.out = options.plan.out = fs::absolute(batch.each.out).lexically_normal();
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
  options.film.resume = true;

  const scenes::Scene scene = read_scene(plan);
  for (const scenes::BodySpec& body : scene.bodies) {
    identity_of(scene, body, plan.scene.data);  // finds its model
    spec.bodies.push_back(body.name);
  }
  if (options.until >= Stage::film) render::require_film_possible(scene.film.frames_per_second, "film.mp4");
  require_letters(scene.film);
  require_tree_for_film(plan.keep_tree, scene);
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
