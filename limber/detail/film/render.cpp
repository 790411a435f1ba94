#include "limber/detail/film/render.h"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/events.h"
#include "core/hash.h"
#include "core/job.h"
#include "core/json_text.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/temporary_files.h"
#include "core/threads.h"
#include "core/version.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/plan/manifest.h"
#include "render/film.h"
#include "render/png_file.h"

namespace limber::detail {

namespace {

// The frame's own file last: where it is good, its passes are there.
void write(const Picture& picture, const FrameFiles& files, int frame, const std::string& hash) {
  const auto put = [&](const std::string& pass, const auto& any) {
    std::visit(
        [&](const auto& image) {
          render::write_png(
              files.of(frame, pass), image,
              {{hash_of_frame, hash}, {hash_of_pixels, hash_of_shown(hash, render::pixel_hash(image))}});
        },
        any);
  };
  for (const auto& [pass, image] : picture.passes) put(pass, image);
  put("", picture.frame);
}

// The plan's scene, filmed otherwise. What would change the motion is refused.
scenes::Scene filmed_as(const scenes::Scene& planned, const std::vector<std::string>& sets) {
  for (const std::string& set : sets) {
    const std::string key = set.substr(0, set.find('='));
    const auto last = key.substr(key.rfind('.') + 1);
    const bool look =
        key.starts_with("bodies.") &&
        (last == "color" || last == "texture" || last == "opacity" || last == "look" || last == "roughness" ||
         last == "metallic" || (last == "deformation" && all_touched_at_cages(planned)));
    const bool film = key.starts_with("film.") && key != "film.speed" && key != "film.frames_per_second";
    const bool ligament = key.starts_with("ligaments.") && (last == "color" || last == "diameter_m");
    if (!look && !film && !ligament && key != "cameras" && !key.starts_with("camera.") &&
        !key.starts_with("cameras."))
      throw InputError(fmt::format(
          "--set {}: the motion is planned already; what can be set here are film (but speed and "
          "frames_per_second), camera, cameras, and color, texture, opacity, look, roughness and metallic "
          "of bodies (and deformation, where all are touched at their cages), color and diameter_m of "
          "ligaments; "
          "for the rest plan anew with limber plan",
          set));
  }
  std::vector<std::string> all = planned.sets;
  all.insert(all.end(), sets.begin(), sets.end());
  return scenes::read_scene(planned.text, planned.name, all, planned.script);
}

std::string suffix_of(const RenderOptions& options) {
  const std::string name = !options.name.empty()      ? options.name
                           : options.camera == "main" ? ""
                                                      : options.camera;
  for (const char c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-')
      throw InputError(fmt::format("{}: a film's name has letters, digits, _ and - only", name));
  return name.empty() ? "" : "-" + name;
}

}  // namespace

Filming::Filming(const RenderOptions& options)
    : suffix(suffix_of(options)),
      files{options.folder / ("frames" + suffix)},
      output{options.bits, options.passes},
      planned(read_plan_folder(options.folder)) {
  planned.scene = filmed_as(planned.scene, options.sets);
  of_plan = read_world_of(planned, options.folder);
  scenery = read_scenery(planned.scene, options.folder);
  const scenes::FilmSpec& film = planned.scene.film;
  size_px = options.size.empty() ? std::pair(film.width_px, film.height_px) : parse_size(options.size);
  shot.emplace(planned.scene, options.camera, planned.plan, of_plan.world, of_plan.bodies, scenery, size_px,
               output);
}

std::string hash_of_shown(const std::string& frame_hash, const std::string& pixel_hash) {
  return content_hash(frame_hash + " " + pixel_hash);
}

bool Filming::is_good(int frame) const {
  const std::string hash = shot->hash_of(frame);
  return render::frame_hash(files.of(frame)) == hash &&
         std::all_of(output.passes.begin(), output.passes.end(), [&](const std::string& pass) {
           return render::frame_hash(files.of(frame, pass)) == hash;
         });
}

std::vector<fs::path> Filming::paths() const {
  std::vector<fs::path> paths;
  for (int f = 0; f < shot->frames(); ++f) paths.push_back(files.of(f));
  return paths;
}

fs::path Filming::video(const RenderOptions& options) const {
  return options.video.value_or(options.folder / ("film" + suffix + ".mp4"));
}

std::string Filming::film_hash(const fs::path& video) const {
  const scenes::FilmSpec& film = planned.scene.film;
  std::string shown = fmt::format("{} {} {} {} {}", version, film.frames_per_second, film.sheet_columns,
                                  film.sheet_rows, video.extension().string());
  for (int f = 0; f < shot->frames(); ++f) shown += " " + shot->hash_of(f);
  return content_hash(shown);
}

render::Image8 Filming::sheet() const {
  const scenes::FilmSpec& film = planned.scene.film;
  std::vector<fs::path> shown;
  std::vector<std::string> captions;
  for (const int of_motion :
       render::spread_over(shot->frames_of_motion(), film.sheet_columns * film.sheet_rows)) {
    const int f = shot->frames_before() + of_motion;
    shown.push_back(files.of(f));
    captions.push_back(fmt::format("{:.2f} s", shot->time_s(f)));
  }
  return render::contact_sheet(shown, captions, {.columns = film.sheet_columns});
}

RenderedFilm Filming::told(const RenderOptions& options) const {
  return {.frames = shot->frames(),
          .size = {size_px.first, size_px.second},
          .camera = options.camera,
          .sets = options.sets,
          .passes = options.passes,
          .bits = options.bits,
          .time = shot->time_told(),
          .trajectory_hash = hex(plan::hash_of(planned.plan.trajectory)),
          .folder = files.folder,
          .film = {},
          .sheet = {},
          .old_film = {}};
}

std::vector<FailedFrame> paint_frames(const Filming& filming, const std::vector<int>& frames,
                                      Shot::Painter* of_this_thread) {
  const Shot& shot = *filming.shot;
  const FrameFiles& files = filming.files;
  std::vector<FailedFrame> failures;
  std::atomic<std::size_t> next{0}, done{0};
  std::exception_ptr fatal;
  std::mutex mutex;
  Progress progress("render", std::int64_t(frames.size()));
  Job* const job = current_job();
  const auto work = [&](Shot::Painter* given) {
    const WorkingFor working(job);
    try {
      std::optional<Shot::Painter> made;
      Shot::Painter& painter = given ? *given : made.emplace(shot);
      while (stop_signal() == 0) {
        const std::size_t i = next++;
        if (i >= frames.size()) break;
        const auto began = std::chrono::steady_clock::now();
        Json event{{"event", "frame"}, {"frame", frames[i]}};
        try {
          event["hash"] = shot.hash_of(frames[i]);
          write(painter.paint(frames[i]), files, frames[i], event["hash"]);
        } catch (const InputError& error) {
          event = {{"event", "frame_failed"}, {"frame", frames[i]}, {"error", error.what()}};
          const std::lock_guard lock(mutex);
          failures.push_back({frames[i], error.what()});
        }
        const std::lock_guard lock(mutex);
        progress.update(std::int64_t(++done));
        event["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
        event["done"] = done.load(), event["total"] = frames.size();
        events::tell(event);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      fatal = std::current_exception();
      next = frames.size();
    }
  };
  std::vector<std::jthread> workers;
  const int count = std::min(thread_count(), int(frames.size()));
  for (int t = 1; t < count; ++t) workers.emplace_back(work, nullptr);
  work(of_this_thread);
  workers.clear();
  if (fatal) std::rethrow_exception(fatal);
  return failures;
}

namespace {

constexpr const char* hash_of_film = "limber-film-hash";  // in the contact sheet, which is written last

// The film and its sheet are as they were made from just these frames.
bool film_is_there(const Filming& filming, const fs::path& video, const fs::path& sheet) {
  const auto info = render::inspect_png(sheet);
  if (!info || !info->texts.contains(hash_of_frame) || !info->texts.contains(hash_of_film) ||
      !fs::is_regular_file(video))
    return false;
  return info->texts.at(hash_of_frame) == filming.film_hash(video) &&
         info->texts.at(hash_of_film) == content_hash(read_file(video));
}

void make_film_and_sheet(const Filming& filming, const fs::path& video, const fs::path& sheet) {
  render::make_film(filming.paths(), filming.planned.scene.film.frames_per_second, video);
  render::write_png(
      sheet, filming.sheet(),
      {{"limber-hash", filming.film_hash(video)}, {hash_of_film, content_hash(read_file(video))}});
  events::tell({{"event", "film"}, {"file", video.string()}});
}

}  // namespace

RenderedFilm render(const RenderOptions& options) {
  const Filming filming(options);
  const std::string& suffix = filming.suffix;
  const scenes::FilmSpec& film = filming.planned.scene.film;
  const Shot& shot = *filming.shot;
  const FrameFiles& files = filming.files;
  const int frame_count = shot.frames();

  std::int64_t left_out = 0;
  std::vector<int> wanted = chunk_of(parse_frames(options.frames, frame_count, &left_out), options.chunk);
  if (left_out > 0)
    log::warn("frames {}: {} frames beyond the last, {}, are left out", options.frames, left_out,
              frame_count - 1);
  make_folder(files.folder);
  const FolderLock lock(options.folder, FolderLock::shared);
  remove_abandoned(files.folder), remove_abandoned(options.folder);
  const auto is_good = [&](int frame) { return filming.is_good(frame); };
  if (!options.passes.empty()) write_json(files.folder / "passes.json", shot.key_of_passes());

  std::vector<int> missing = wanted;
  if (options.resume) std::erase_if(missing, is_good);
  const fs::path video = filming.video(options);
  const auto comes_or_is_there = [&](int frame) {
    return std::binary_search(wanted.begin(), wanted.end(), frame) || is_good(frame);
  };
  bool will_be_complete = true;
  for (int f = 0; f < frame_count && will_be_complete; ++f) will_be_complete = comes_or_is_there(f);
  if (will_be_complete || options.video) render::require_film_possible(film.frames_per_second, video);
  events::tell({{"event", "frames"}, {"wanted", wanted.size()}, {"kept", wanted.size() - missing.size()}});
  const double cpu_before = cpu_seconds();
  const std::vector<FailedFrame> failures = paint_frames(filming, missing);
  const double cpu_s = cpu_seconds() - cpu_before;
  if (stop_signal() != 0)
    log::warn("{}: {} of {} frames are there and kept; the same command with --resume goes on",
              files.folder.string(), std::count_if(wanted.begin(), wanted.end(), is_good), wanted.size());
  throw_if_stopped();
  for (const FailedFrame& failure : failures) log::warn("frame {}: {}", failure.frame, failure.why);

  RenderedFilm result = filming.told(options);
  result.wanted = std::ssize(wanted);
  result.failed = std::ssize(failures), result.painted = std::ssize(missing) - result.failed;
  result.cpu_s = cpu_s;
  // Several that share the folder may come here at once.
  const FolderLock makes_film(files.folder, FolderLock::alone, FolderLock::waits);
  bool complete = failures.empty();  // an older picture may stand for one that failed
  for (int f = 0; f < frame_count && complete; ++f) complete = is_good(f);
  if (complete) {
    const fs::path sheet = options.folder / ("sheet" + suffix + ".png");
    if (!options.resume || !film_is_there(filming, video, sheet)) make_film_and_sheet(filming, video, sheet);
    // Frames of an earlier, longer motion would only confuse.
    for (int f = frame_count; fs::remove(files.of(f)); ++f) {
    }
    result.film = video, result.sheet = sheet;
  } else {
    for (int f = 0; f < frame_count; ++f) result.others += int(fs::exists(files.of(f)) && !is_good(f));
    if (const fs::path old = options.folder / ("film" + suffix + ".mp4"); fs::exists(old))
      result.old_film = old;
  }
  update_manifest(options.folder, "render" + suffix, json_of_fields(result));
  return result;
}

namespace {

// The same plan under a scene that differs in what it looks like alone.
void film_otherwise(const fs::path& folder, const PlanFolder& planned, const scenes::Scene& scene) {
  const auto [bodies, world] = read_world_of(planned, folder);
  const MotionFigures figures = measure_motion(world, planned.plan.trajectory);
  for (const auto& [name, bytes] : pictures_of(scene, world, planned.plan, figures))
    write_file(folder / name, bytes);
  // Last, so that a run after one that was killed films otherwise again.
  write_plan_folder(folder, planned.plan, scene, bodies, planned.summary);
}

}  // namespace

PlannedFilm plan_and_film(const PlanOptions& options, const FilmOptions& film) {
  const scenes::Scene scene = read_scene(options);
  if (film.frames.empty() && film.chunk.empty())
    render::require_film_possible(scene.film.frames_per_second, film.video.value_or("film.mp4"));
  require_letters(scene.film);
  make_folder(options.out);
  FolderLock lock(options.out, FolderLock::alone);
  PlannedFilm both;
  if (plan_is_up_to_date(options, scene)) {
    const fs::path file = options.out / "plan.npz";
    log::info("{}: up to date", file.string());
    const PlanFolder kept = read_plan_folder(options.out);
    both.plan = {.file = file,
                 .summary_json = text_of(kept.summary, 2),
                 .reached = kept.plan.solved(),
                 .up_to_date = true};
    if (kept.scene.text != scene.text || kept.scene.sets != scene.sets)  // it may be filmed otherwise
      film_otherwise(options.out, kept, scene);
  } else {
    both.plan = plan(options, scene);
  }
  lock.share();
  RenderOptions of_folder{film, options.out};
  of_folder.resume = true;
  both.film = render(of_folder);
  return both;
}

}  // namespace limber::detail
