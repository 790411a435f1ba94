// The motion that is to be planned is stood in for by its stations: the robot as it is, but at each goal.
// Bodies are not prepared (start.h), so this takes as long as their models take to load, and a picture or two
// a second.
#include "limber/detail/film/storyboard.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "core/error.h"
#include "core/job.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/film/start.h"
#include "render/film.h"
#include "render/png_file.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

constexpr std::size_t max_cameras = 8, max_keys = 16;
constexpr int usual_width = 640;

struct Station {
  std::string name;
  Vec3 center_m = Vec3::Zero();  // of the robot's mass
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
};

bool camera_moves(const scenes::CameraSpec& camera) {
  return camera.keyframes.size() > 1 || camera.turn_deg != 0;
}

// A camera on its way is seen on it, too.
std::vector<Station> stations_of(const scenes::Scene& scene, const Vec3& start_m) {
  std::vector<Station> stations{{"start", start_m}};
  for (std::size_t v = 0; v < scene.via.size(); ++v)
    stations.push_back(
        {scene.via.size() > 1 ? fmt::format("via {}", v + 1) : "via", scene.via[v].goal.center_of_mass_m});
  if (scene.lacks.empty()) {
    Station goal{"goal", scene.goal.center_of_mass_m};
    if (const auto& shape = scene.goal.shape)
      goal.turn = Eigen::AngleAxisd(shape->angle_deg * EIGEN_PI / 180, shape->axis);
    stations.push_back(goal);
  } else {
    stations.push_back({"end", start_m});
  }
  if (stations.size() == 2 && std::any_of(scene.cameras.begin(), scene.cameras.end(), camera_moves)) {
    Station half = stations[0];
    half.name = "half way", half.center_m = 0.5 * (stations[0].center_m + stations[1].center_m);
    stations.insert(stations.begin() + 1, half);
  }
  return stations;
}

// As far apart in time as what goes its own way needs.
std::vector<State> states_at(const std::vector<Station>& stations, const Start& start) {
  double last_s = 0;
  for (const scenes::MotionSpec& motion : start.scene.motions)
    last_s = std::max(last_s, motion.keyframes.back().at_s);
  std::vector<State> states;
  const fem::Body& robot = start.world.bodies[std::size_t(start.world.robot)];
  for (std::size_t s = 0; s < stations.size(); ++s) {
    State state = fem::start_state(start.world);
    const double share = double(s) / double(stations.size() - 1);
    state.step = std::max(std::int64_t(s), std::int64_t(share * last_s / start.world.dt_s));
    for (int n = 0; n < robot.node_count(); ++n) {
      float* const at = &state.positions[3 * std::size_t(robot.first_node + n)];
      const Vec3 place =
          stations[s].turn * (Vec3(at[0], at[1], at[2]) - stations[0].center_m) + stations[s].center_m;
      for (int i = 0; i < 3; ++i) at[i] = float(place[i]);
    }
    states.push_back(std::move(state));
  }
  return states;
}

std::string place_words(const Vec3& place) {
  return fmt::format("({:.3g}, {:.3g}, {:.3g}) m", place.x(), place.y(), place.z());
}

std::vector<std::string> words_of(const scenes::Scene& scene, const std::vector<Station>& stations) {
  std::vector<std::string> lines{
      scene.description.empty() ? scene.name : fmt::format("{}: {}", scene.name, scene.description)};
  const std::string& robot = scene.bodies[std::size_t(scene.robot)].name;
  if (scene.lacks.empty()) {
    double way_m = 0;
    for (std::size_t s = 1; s < stations.size(); ++s)
      way_m += (stations[s].center_m - stations[s - 1].center_m).norm();
    const std::string from = place_words(stations.front().center_m),
                      to = place_words(stations.back().center_m),
                      way = length_words(std::round(1000 * way_m) / 1000);
    std::string by;
    for (const scenes::Via& via : scene.via)
      by += (by.empty() ? "" : ", ") + place_words(via.goal.center_of_mass_m);
    lines.push_back(
        by.empty() ? fmt::format("{} goes from {} to {}, {} straight on", robot, from, to, way)
        : from == to
            ? fmt::format("{} goes from {} to {} and back, {} straight on", robot, from, by, way)
            : fmt::format("{} goes from {} by way of {} to {}, {} straight on", robot, from, by, to, way));
  }
  for (const scenes::MotionSpec& motion : scene.motions)
    if (lines.size() < 5)
      lines.push_back(fmt::format("{} goes its own way until {:g} s",
                                  scene.bodies[std::size_t(motion.body)].name, motion.keyframes.back().at_s));
  for (const scenes::ForceSpec& force : scene.forces)
    if (lines.size() < 5)
      lines.push_back(fmt::format("{} is pushed with {:.3g} N from {:g} to {:g} s",
                                  scene.bodies[std::size_t(force.body)].name, force.force_n.norm(),
                                  force.from_s, force.to_s));
  return lines;
}

// Each camera's pictures, by a worker of its own.
std::vector<render::Image8> painted(const std::vector<std::unique_ptr<Shot>>& shots) {
  const int moments = shots.front()->frames();
  std::vector<render::Image8> pictures(shots.size() * std::size_t(moments));
  Progress progress("storyboard", std::int64_t(pictures.size()));
  std::atomic<std::size_t> next{0}, done{0};
  std::vector<std::exception_ptr> failures(shots.size());
  Job* const job = current_job();
  const auto work = [&] {
    const WorkingFor working(job);
    for (std::size_t s; (s = next++) < shots.size();) try {
        Shot::Painter painter(*shots[s]);
        for (int m = 0; m < moments; ++m) {
          throw_if_stopped();
          pictures[s * std::size_t(moments) + std::size_t(m)] =
              std::get<render::Image8>(painter.paint(m).frame);
          progress.update(std::int64_t(++done));
        }
      } catch (...) {
        failures[s] = std::current_exception();
      }
  };
  std::vector<std::jthread> workers;
  for (int t = 1; t < std::min(thread_count(), int(shots.size())); ++t) workers.emplace_back(work);
  work();
  workers.clear();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  return pictures;
}

}  // namespace

WrittenStoryboard write_storyboard(const StoryboardOptions& options) {
  const fs::path file = scenes::find_scene(options.scene.scene);
  const scenes::Scene scene = scenes::read_scene_file(file, options.scene.sets);
  const fs::path out = options.out.value_or(scene.name + "-storyboard.png");
  require_picture_possible(out, "a storyboard");
  const scenes::FilmSpec& film = scene.film;
  const int height = std::max(16, int(std::lround(double(usual_width) * film.height_px / film.width_px)));
  const std::pair<int, int> size =
      options.size.empty() ? std::pair(usual_width, height) : parse_size(options.size);
  std::vector<LoadedModel> models;
  for (const scenes::BodySpec& body : scene.bodies) {
    throw_if_stopped();
    models.push_back(load_model(scene, body, options.scene.data));
  }
  Start start = loaded_start(scene, models, options.scene.data);
  scenes::FilmSpec& told = start.scene.film;
  told.path = scene.lacks.empty();
  told.clock = told.transparent = told.cages = told.side_by_side = false;
  told.end = scenes::FilmEnd::path;
  told.caption.clear();
  told.inset.reset();

  const Vec3 start_m = fem::center_of_mass_m(start.world, fem::start_state(start.world), start.world.robot);
  const std::vector<Station> stations = stations_of(scene, start_m);
  plan::Plan plan;
  plan.trajectory.frames = states_at(stations, start);
  Output output;
  output.occlusion = false;
  std::vector<std::unique_ptr<Shot>> shots;
  WrittenStoryboard made{out, {}, {}, {}};
  for (const scenes::CameraSpec& camera : start.scene.cameras) {
    if (shots.size() == max_cameras) break;
    made.cameras.push_back(camera.name);
    shots.push_back(std::make_unique<Shot>(start.scene, camera.name, plan, start.world, start.bodies,
                                           start.scenery, size, output));
  }
  for (const Station& station : stations) made.moments.push_back(station.name);
  std::vector<std::string> captions;
  for (const std::string& camera : made.cameras)
    for (const std::string& moment : made.moments) captions.push_back(fmt::format("{}: {}", camera, moment));
  render::SheetLook look;
  look.columns = int(stations.size()), look.tile_width_px = size.first;
  std::vector<render::LegendKey> keys;
  for (const scenes::BodySpec& body : scene.bodies)
    if (film.labels.empty() && keys.size() < max_keys) keys.push_back({body.name, body.color_srgb});
  const render::Image8 sheet = render::with_caption(render::contact_sheet_of(painted(shots), captions, look),
                                                    words_of(scene, stations), keys);
  render::write_png(out, sheet);
  made.size_px = {sheet.width, sheet.height};
  return made;
}

}  // namespace limber::detail
