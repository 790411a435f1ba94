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
    case Stage::page:
      return fs::exists(work_ / "index.html");
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
