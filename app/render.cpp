#include <atomic>
#include <mutex>
#include <thread>

#include "app/commands.h"
#include "app/frame_list.h"
#include "app/manifest.h"
#include "app/plan_folder.h"
#include "app/scene_world.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "core/version.h"
#include "render/film.h"
#include "render/png_file.h"
#include "render/renderer.h"

namespace limber::app {

namespace {

// All that the pictures of a motion are made of; constant, shared by the workers.
struct Motion {
  const scenes::Scene& scene;
  const std::vector<PreparedBody>& bodies;
  const fem::World& world;
  const std::vector<State>& frames;
  render::Look look;
  std::vector<render::CameraKey> cameras;  // over the share of the film
  std::uint64_t look_hash;

  render::Camera camera_of(int frame) const {
    return render::camera_at(cameras, frames.size() < 2 ? 0 : double(frame) / double(frames.size() - 1));
  }
  std::string hash_of_frame(int frame) const {
    const render::Camera camera = camera_of(frame);
    Hasher hasher;
    hasher.value(look_hash)
        .value(limber::hash_of(frames[std::size_t(frame)]))
        .matrix(camera.eye)
        .matrix(camera.target)
        .matrix(camera.up);
    return hex(hasher.value(camera.fov_deg).digest());
  }
};

Box box_of_motion(const Motion& motion) {
  Box box;
  for (const State& state : motion.frames)
    for (std::size_t i = 0; i + 2 < state.positions.size(); i += 3)
      box.include(Vec3(state.positions[i], state.positions[i + 1], state.positions[i + 2]));
  for (const PreparedBody& body : motion.bodies) box.include(bounding_box(body.surface.positions));
  return box;
}

// From over the photographer's left shoulder, so that what faces the camera is lit, and shadows fall to the
// right and away.
Vec3 toward_key_light(const render::Camera& camera) {
  constexpr double to_the_left_deg = 40, height = 1.3;  // height: over the horizontal distance
  const Vec3 view = camera.eye - camera.target;
  const Vec3 level(view.x(), view.y(), 0);
  if (level.norm() < 1e-3 * view.norm()) return Vec3(-0.5, -0.6, 1);  // looking straight down
  return Eigen::AngleAxisd(-to_the_left_deg * EIGEN_PI / 180, Vec3::UnitZ()) * level.normalized() +
         Vec3(0, 0, height);
}

Motion motion_of(const PlanFolder& planned, const std::vector<PreparedBody>& bodies, const fem::World& world,
                 std::pair<int, int> size) {
  const scenes::Scene& scene = planned.scene;
  Motion motion{scene, bodies, world, planned.plan.trajectory.frames, {}, {}, 0};
  Box everything = box_of_motion(motion);
  motion.look.width = size.first, motion.look.height = size.second;
  motion.look.background_top_srgb = motion.look.background_bottom_srgb = scene.film.background_srgb;
  motion.look.ground_height_m = scene.bounds_m.lower.z();
  motion.look.stage = everything;
  if (scene.film.bounds_lines) everything.include(scene.bounds_m);
  if (scene.camera.keyframes.empty()) {
    const double aspect = double(size.first) / size.second;
    motion.cameras.push_back(
        {0, render::frame_automatically(everything, scene.camera.direction, aspect, scene.camera.fov_deg)});
  }
  for (const scenes::Keyframe& key : scene.camera.keyframes)
    motion.cameras.push_back(
        {key.at, {.eye = key.eye_m, .target = key.target_m, .fov_deg = scene.camera.fov_deg}});

  motion.look.toward_key = toward_key_light(motion.cameras.front().camera);

  Hasher hasher;
  hasher.text(version)
      .value(size.first)
      .value(size.second)
      .matrix(scene.film.background_srgb)
      .value(int(scene.film.bounds_lines));
  hasher.matrix(everything.lower).matrix(everything.upper);
  for (std::size_t b = 0; b < bodies.size(); ++b)
    hasher.value(hash_of(bodies[b].surface))
        .value(hash_of(bodies[b].cage))
        .matrix(scene.bodies[b].color_srgb);
  motion.look_hash = hasher.digest();
  return motion;
}

// One worker: a drawing context and the surfaces that it moves.
class FramePainter {
 public:
  explicit FramePainter(const Motion& motion) : motion_(motion), renderer_(motion.look) {
    for (std::size_t b = 0; b < motion.bodies.size(); ++b) {
      const SurfaceMesh& surface = motion.bodies[b].surface;
      const scenes::BodySpec& body = motion.scene.bodies[b];
      meshes_.push_back(renderer_.add_mesh(surface.triangles, surface.positions,
                                           {.name = body.name, .color_srgb = body.color_srgb}));
      rest_normals_.push_back(vertex_normals(surface.positions, surface.triangles));
    }
    if (motion.scene.film.bounds_lines) renderer_.add_lines(render::edges_of(motion.scene.bounds_m), {});
  }

  render::Image8 paint(int frame) {
    const State& state = motion_.frames[std::size_t(frame)];
    for (std::size_t b = 0; b < motion_.bodies.size(); ++b) {
      const fem::Body& body = motion_.world.bodies[b];
      if (!body.moving) continue;
      const PreparedBody& prepared = motion_.bodies[b];
      const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>> nodes(
          state.positions.data() + 3 * body.first_node, body.node_count(), 3);
      cage_ = nodes.cast<double>();
      surface_.resize(prepared.surface.positions.rows(), 3);
      normals_.resize(surface_.rows(), 3);
      ffd::deform(prepared.binding, prepared.cage.tets, cage_, surface_);
      ffd::deform_normals(prepared.binding, prepared.cage, cage_, rest_normals_[b], normals_);
      renderer_.set_positions(meshes_[b], surface_, normals_);
    }
    return render::tone_mapped(renderer_.draw(motion_.camera_of(frame)));
  }

 private:
  const Motion& motion_;
  render::Renderer renderer_;
  std::vector<int> meshes_;
  std::vector<Points> rest_normals_;
  Points cage_, surface_, normals_;
};

struct Failure {
  int frame;
  std::string why;
};

// Paints the frames on all threads. A frame that fails does not stop the others; a full disk does.
std::vector<Failure> paint_all(const Motion& motion, const std::vector<int>& frames,
                               const std::function<fs::path(int)>& path_of) {
  std::vector<Failure> failures;
  std::atomic<std::size_t> next{0}, done{0};
  std::exception_ptr fatal;
  std::mutex mutex;
  Progress progress("render", std::int64_t(frames.size()));
  const auto work = [&] {
    try {
      FramePainter painter(motion);
      while (stop_signal() == 0) {
        const std::size_t i = next++;
        if (i >= frames.size()) break;
        try {
          render::write_png(path_of(frames[i]), painter.paint(frames[i]),
                            {{"limber-hash", motion.hash_of_frame(frames[i])}});
        } catch (const InputError& error) {
          const std::lock_guard lock(mutex);
          failures.push_back({frames[i], error.what()});
        }
        const std::lock_guard lock(mutex);
        progress.update(std::int64_t(++done));
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      fatal = std::current_exception();
      next = frames.size();
    }
  };
  std::vector<std::jthread> workers;
  const int count = std::min(thread_count(), int(frames.size()));
  for (int t = 1; t < count; ++t) workers.emplace_back(work);
  work();
  workers.clear();
  if (fatal) std::rethrow_exception(fatal);
  return failures;
}

}  // namespace

Outcome render(const RenderOptions& options) {
  const PlanFolder planned = read_plan_folder(options.folder);
  const std::vector<PreparedBody> bodies = read_bodies_of(planned, options.folder);
  const fem::World world = build_world(planned.scene, bodies);
  const scenes::FilmSpec& film = planned.scene.film;
  const auto size =
      options.size.empty() ? std::pair(film.width_px, film.height_px) : parse_size(options.size);
  const Motion motion = motion_of(planned, bodies, world, size);
  const int frame_count = int(motion.frames.size());

  int left_out = 0;
  std::vector<int> wanted = chunk_of(parse_frames(options.frames, frame_count, &left_out), options.chunk);
  if (left_out > 0)
    log::warn("--frames {}: {} frames beyond the last, {}, are left out", options.frames, left_out,
              frame_count - 1);
  const fs::path folder = options.folder / "frames";
  make_folder(folder);
  const auto path_of = [&](int frame) { return folder / fmt::format("{:04}.png", frame); };
  const auto is_good = [&](int frame) {
    return render::frame_hash(path_of(frame)) == motion.hash_of_frame(frame);
  };

  std::vector<int> missing = wanted;
  if (options.resume) std::erase_if(missing, is_good);
  const double cpu_before = cpu_seconds();
  const std::vector<Failure> failures = paint_all(motion, missing, path_of);
  const double cpu_s = cpu_seconds() - cpu_before;
  throw_if_stopped();
  for (const Failure& failure : failures) log::warn("frame {}: {}", failure.frame, failure.why);

  Json result{{"frames", frame_count},
              {"wanted", wanted.size()},
              {"painted", missing.size() - failures.size()},
              {"failed", failures.size()},
              {"size", {size.first, size.second}},
              {"trajectory_hash", hex(plan::hash_of(planned.plan.trajectory))},
              {"cpu_s", cpu_s},
              {"folder", folder.string()}};
  std::string text =
      fmt::format("{} of {} frames in {}: {} painted, {} kept, {} failed; {:.2f} CPU s\n", wanted.size(),
                  frame_count, folder.string(), missing.size() - failures.size(),
                  wanted.size() - missing.size(), failures.size(), cpu_s);

  std::vector<fs::path> paths;
  for (int f = 0; f < frame_count; ++f) paths.push_back(path_of(f));
  bool complete = true;
  for (int f = 0; f < frame_count && complete; ++f) complete = is_good(f);
  if (complete) {
    const fs::path video = options.video.value_or(options.folder / "film.mp4"),
                   sheet = options.folder / "sheet.png";
    std::vector<fs::path> shown;
    std::vector<std::string> captions;
    for (const int f : render::spread_over(frame_count, film.sheet_columns * film.sheet_rows)) {
      shown.push_back(path_of(f));
      captions.push_back(fmt::format("{:.2f} s", double(f) / film.frames_per_second));
    }
    render::write_png(sheet, render::contact_sheet(shown, captions, {.columns = film.sheet_columns}));
    render::make_film(paths, film.frames_per_second, video);
    // Frames of an earlier, longer motion would only confuse.
    for (int f = frame_count; fs::remove(path_of(f)); ++f) {
    }
    result["film"] = video.string(), result["sheet"] = sheet.string();
    text += fmt::format("film {}, contact sheet {}\n", video.string(), sheet.string());
  } else if (failures.empty()) {
    text += "no film yet: not all frames are there\n";
  }
  update_manifest(options.folder, "render", result);
  return {failures.empty() ? exit_done : exit_frames_failed, result, text};
}

Outcome run(const PlanOptions& plan_options, const RenderOptions& render_options) {
  const scenes::Scene scene = read_scene(plan_options);
  Outcome planned;
  if (plan_is_up_to_date(plan_options, scene)) {
    log::info("{}: up to date", (plan_options.out / "plan.npz").string());
    const PlanFolder folder = read_plan_folder(plan_options.out);
    planned = {folder.plan.solved() ? exit_done : exit_no_plan, folder.summary, ""};
  } else {
    planned = plan(plan_options, scene);
  }
  RenderOptions options = render_options;
  options.folder = plan_options.out;
  options.resume = true;
  const Outcome rendered = render(options);
  Outcome both{rendered.exit_code != exit_done ? rendered.exit_code : planned.exit_code,
               {},
               planned.text + rendered.text};
  both.json["plan"] = planned.json, both.json["render"] = rendered.json;
  return both;
}

}  // namespace limber::app
