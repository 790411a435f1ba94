#include "limber/detail/farm/farm_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/content_hash.h"
#include "core/error.h"
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

// Files in farm/ may be damaged: what is none of ours is not there.
const std::vector<std::string> no_texts;
Json json_in(const fs::path& file) {
  try {
    return read_json(file);
  } catch (const InputError&) {
    return {};
  }
}

}  // namespace

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
  if (spec_.options.batch) return {Stage::models, Stage::page};
  std::vector<Stage> stages;
  for (int s = 0; s <= int(spec_.options.until); ++s) stages.push_back(Stage(s));
  return stages;
}

std::vector<Unit> FarmFolder::units(Stage stage) const {
  std::vector<Unit> units;
  const auto add = [&](const std::string& name) -> Unit& {
    return units.emplace_back(
        Unit{.stage = stage, .name = name, .body = {}, .frames = {}, .runs = {}, .models = {}});
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
  } else if (stage == Stage::models) {
    // Dealt out like cards: models that take long often stand together.
    const std::size_t count = spec_.options.batch ? spec_.options.batch->listed.size() : 0;
    const auto each = std::size_t(spec_.options.models_per_task), parts = (count + each - 1) / each;
    for (std::size_t part = 0; part < parts; ++part) {
      Unit& unit = add(fmt::format("models-{}", part + 1));
      for (std::size_t model = part; model < count; model += parts) unit.models.push_back(model);
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

UnitDone FarmFolder::told_of(const Unit& unit) const {
  if (forgets_) return {};
  return fields_or_nothing<UnitDone>(json_in(done_file(unit))).value_or(UnitDone{});
}

const FarmFolder::Frames& FarmFolder::frames() const {
  std::error_code none;
  const fs::file_time_type written = fs::last_write_time(done_file(plan_unit()), none);
  if (none || written != frames_.first) {
    const UnitDone plan = told_of(plan_unit());
    frames_ = {written, {work_ / plan.frames_folder.value_or(""), plan.frame_hashes.value_or(no_texts)}};
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
      const std::vector<std::string> records = told_of(unit).records.value_or(no_texts);
      return records.size() == unit.runs.size() &&
             std::all_of(records.begin(), records.end(), [&](const std::string& record) {
               return fs::exists(work_ / "runs" / (record + ".json"));
             });
    }
    case Stage::table:
      return fs::exists(work_ / "bench.html");
    case Stage::page:
      return fs::exists(work_ / "index.html");
    case Stage::bodies:
      return unit.body.empty() || fs::exists(work_ / "bodies" / unit.body / "report.json");
    case Stage::plan:
      return fs::exists(work_ / "plan.npz");
    case Stage::film:
      return fs::is_regular_file(work_ / told_of(unit).film.value_or(""));
    case Stage::report:
      return fs::exists(work_ / "report.html");
    default:
      return true;
  }
}

std::optional<UnitFailed> FarmFolder::failure_of(const Unit& unit) const {
  if (!fs::exists(failed_file(unit))) return std::nullopt;
  const UnitFailed damaged{"defect", "its file in farm/failed is damaged", 1};
  return fields_or_nothing<UnitFailed>(json_in(failed_file(unit))).value_or(damaged);
}

void FarmFolder::mark_done(const Unit& unit, const UnitDone& told) const {
  write_json(done_file(unit), json_of_fields(told));
  std::error_code none;
  fs::remove(failed_file(unit), none);
}

void FarmFolder::mark_failed(const Unit& unit, const UnitFailed& failed) const {
  write_json(failed_file(unit), json_of_fields(failed));
}

void FarmFolder::forget(const Unit& unit) const {
  std::error_code none;
  fs::remove(done_file(unit), none);
}

void FarmFolder::cancel() const { write_file(folder() / "cancelled", "limber farm submit goes on\n"); }
bool FarmFolder::is_cancelled() const { return fs::exists(folder() / "cancelled"); }

SentJobs FarmFolder::jobs() const {
  SentJobs sent = fields_or_nothing<SentJobs>(json_in(folder() / "jobs.json")).value_or(SentJobs{});
  // They become words of commands.
  std::erase_if(sent.jobs, [](const std::string& id) {
    return id.empty() || id.find_first_not_of("0123456789") != std::string::npos;
  });
  return sent;
}

void FarmFolder::write_jobs(const SentJobs& sent) const {
  write_json(folder() / "jobs.json", json_of_fields(sent));
}

std::optional<Best> best_search(const FarmFolder& farm) {
  std::optional<Best> best;
  for (const Unit& unit : farm.units(Stage::search)) {
    const UnitDone told = farm.told_of(unit);
    if (!told.solved.value_or(false) || !told.iterations) continue;
    const Best one{*told.iterations, unit.seed};
    if (!best || one.iterations < best->iterations) best = one;
  }
  return best;
}

}  // namespace limber::detail
