#include "limber/detail/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/version.h"
#include "fem/observe.h"
#include "limber/detail/film/render.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/plan/tree_plot.h"
#include "limber/detail/report/page.h"
#include "limber/detail/report/report_motion.h"
#include "limber/detail/verify/verify.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "render/camera.h"
#include "render/plot.h"

namespace limber::detail {

// The files beside this one, made part of the library by cmake/limber_embed.cmake.
extern const char* const report_viewer;
extern const char* const report_script;

namespace {

// A film beyond this makes a page that no longer opens at once.
constexpr std::uintmax_t largest_film_bytes = 8'000'000;

Json json_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Json json_of(const Box& box) { return {json_of(box.lower), json_of(box.upper)}; }

struct Findings {
  const PlanFolder& planned;
  const std::vector<PreparedBody>& bodies;
  const fem::World& world;
  const FemSystem& system;
  const MotionFigures& figures;
  const Promises& promises;
  const fs::path& folder;

  const plan::Plan& plan() const { return planned.plan; }
  const scenes::Scene& scene() const { return planned.scene; }
  const std::vector<State>& frames() const { return plan().trajectory.frames; }
};

void begin(const Findings& f, Page& page) {
  page.begin(f.scene().name, f.scene().name + ": limber report", f.scene().description);
}

void summary(const Findings& f, Page& page) {
  const plan::Statistics& s = f.plan().statistics;
  double volume = 0;
  for (const double v : f.figures.largest_volume_change) volume = std::max(volume, v);
  const bool all_kept = f.promises.all_kept();
  page.add("<dl class=\"card figures\">\n");
  const auto figure = [&](const char* what, const std::string& value, const std::string& more,
                          const char* kind = "") {
    page.add("<div><dt>{}</dt><b class=\"{}\">{}</b><span>{}</span></div>\n", what, kind, value,
             escaped(more));
  };
  if (f.plan().simulation)
    figure("Simulation", f.plan().simulation->ending == plan::Simulation::whole ? "whole" : "cut short",
           plan::explain(f.plan()));
  else
    figure("Plan", f.plan().solved() ? "solved" : "not solved",
           fmt::format("ends {:.3g} m from the goal", f.plan().best_distance_m),
           f.plan().solved() ? "kept" : "broken");
  figure("Promises", all_kept ? "all kept" : "not all kept",
         fmt::format("{} checked", f.promises.rows().size()), all_kept ? "kept" : "broken");
  figure("Motion",
         fmt::format("{:.2f} s",
                     double(f.plan().trajectory.end.step - f.plan().tree.states.steps()[0]) * f.world.dt_s),
         fmt::format("{} frames, step {:.3g} ms", f.frames().size(), 1e3 * f.world.dt_s));
  if (!f.plan().simulation)
    figure("Search", s.cpu_s > 0 ? fmt::format("{:.2f} CPU s", s.cpu_s) : "done",
           fmt::format("{} iterations, {} nodes", s.iterations, plan::nodes_of(f.plan())));
  figure("Volume change", fmt::format("{:.2f} %", 100 * volume), "at most, of any body");
  figure("Penetration",
         fmt::format("{:.2f} %", 100 * f.figures.deepest_penetration_m / f.figures.robot_size_m),
         fmt::format("of the robot's size; {}", f.figures.penetration_between));
  page.add("</dl>\n");
}

void stage(Page& page) {
  page.add(
      "<div class=\"card\" id=\"stage\">\n<canvas id=\"view\" aria-label=\"the motion in three "
      "dimensions\"></canvas>\n"
      "<div id=\"no-view\"></div>\n<div class=\"controls\">\n"
      "<button id=\"play\" type=\"button\" aria-pressed=\"false\">Play</button>\n"
      "<input id=\"scrub\" type=\"range\" min=\"0\" step=\"any\" value=\"0\" aria-label=\"time\">\n<span "
      "id=\"time\"></span>\n"
      "<label>speed <select id=\"speed\"><option value=\"0.25\">¼</option><option value=\"0.5\">½</option>"
      "<option value=\"1\" selected>1</option><option value=\"2\">2</option></select></label>\n"
      "<label><input type=\"checkbox\" data-show=\"cage\"> cages</label>\n"
      "<label><input type=\"checkbox\" data-show=\"stage\" checked> bounds, goal, "
      "path</label>\n</div></div>\n"
      "<p class=\"note\">Drag turns, shift-drag moves, the wheel zooms, a double click brings the first view "
      "back; space "
      "plays, arrow keys step. Click in a plot to go there.</p>\n");
}

// At most eight, those that reach highest, each in a color of its own: bodies' colors may be alike.
std::vector<render::Curve> highest(std::vector<std::pair<double, render::Curve>> all) {
  const Vec3 colors[] = {{0.80, 0.20, 0.15}, {0.16, 0.50, 0.73}, {0.90, 0.49, 0.13}, {0.25, 0.60, 0.30},
                         {0.55, 0.35, 0.70}, {0.45, 0.35, 0.25}, {0.85, 0.45, 0.65}, {0.40, 0.40, 0.45}};
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<render::Curve> curves;
  for (const Vec3& color : colors) {
    if (curves.size() == all.size()) break;
    curves.push_back(std::move(all[curves.size()].second));
    curves.back().color_srgb = color;
  }
  return curves;
}

std::pair<double, render::Curve> curve_of(const Findings& f, const std::string& name, const auto& value) {
  render::Curve curve{name, {}, {}, {}};
  for (const FrameFigures& frame : f.figures.frames)
    curve.x.push_back(frame.time_s), curve.y.push_back(value(frame));
  const double most = *std::max_element(curve.y.begin(), curve.y.end());
  return {most, std::move(curve)};
}

std::vector<render::Curve> curves_of_pairs(const Findings& f) {
  std::vector<std::pair<double, render::Curve>> all;
  for (const TouchingPair& pair : touching_pairs(f.world, f.figures))
    all.push_back(curve_of(
        f, pair.name, [&](const FrameFigures& frame) { return pair_force_n(frame, pair.body, pair.other); }));
  return highest(std::move(all));
}

std::vector<render::Curve> curves_of_ligaments(const Findings& f) {
  std::vector<std::pair<double, render::Curve>> all;
  for (std::size_t l = 0; l < f.world.ligaments.size(); ++l)
    all.push_back(curve_of(f, f.world.ligaments[l].name,
                           [&](const FrameFigures& frame) { return frame.ligament_tension_n[l]; }));
  return highest(std::move(all));
}

void plots(const Findings& f, Page& page) {
  const auto curves_of = [&](const auto& value, bool moving_only) {
    std::vector<render::Curve> curves;
    for (std::size_t b = 0; b < f.bodies.size(); ++b) {
      if (moving_only && !f.world.bodies[b].moving) continue;
      render::Curve curve{f.world.bodies[b].name, f.scene().bodies[b].color_srgb, {}, {}};
      for (const FrameFigures& frame : f.figures.frames)
        curve.x.push_back(frame.time_s), curve.y.push_back(value(frame.bodies[b]));
      curves.push_back(std::move(curve));
    }
    return curves;
  };
  const auto plot = [&](const char* title, const char* unit, const std::vector<render::Curve>& curves,
                        std::vector<double> limits = {}) {
    page.add("<figure class=\"card\">{}</figure>\n",
             inlined(render::plot_svg(curves, {.title = title,
                                               .x_label = "time (s)",
                                               .y_label = unit,
                                               .width_px = 640,
                                               .height_px = 400,
                                               .limits = std::move(limits)})));
  };
  render::Curve elastic{"elastic", {0.16, 0.50, 0.73}, {}, {}},
      kinetic{"kinetic", {0.90, 0.49, 0.13}, {}, {}};
  for (const FrameFigures& frame : f.figures.frames) {
    double e = 0, k = 0;
    for (const BodyFigures& body : frame.bodies) e += body.elastic_energy_j, k += body.kinetic_energy_j;
    elastic.x.push_back(frame.time_s), elastic.y.push_back(e);
    kinetic.x.push_back(frame.time_s), kinetic.y.push_back(k);
  }
  page.add("<h2>What happens on the way</h2>\n<div class=\"plots\" data-time>\n");
  plot("Change of volume", "V/V₀ − 1 (%)",
       curves_of([](const BodyFigures& b) { return 100 * b.volume_change; }, true), {-10, 10});
  plot("Energy of all bodies", "energy (J)", {elastic, kinetic});
  plot("Contact", "sum of forces on a body (N)",
       curves_of([](const BodyFigures& b) { return b.contact_force_n; }, false));
  std::vector<double> limits_n;
  for (const fem::Body& body : f.world.bodies)
    if (std::isfinite(body.max_contact_load_n)) limits_n.push_back(body.max_contact_load_n);
  if (!limits_n.empty())
    plot("What presses a body", "sum of magnitudes (N)",
         curves_of([](const BodyFigures& b) { return b.contact_load_n; }, false), limits_n);
  auto away = curves_of([](const BodyFigures& b) { return 1000 * b.away_m; }, false);
  for (std::size_t b = away.size(); b-- > 0;)
    if (!(f.world.bodies[b].material.fascia_hz > 0)) away.erase(away.begin() + std::ptrdiff_t(b));
  if (!away.empty()) plot("How far organs in fascia are from their places", "centre of mass (mm)", away);
  if (const auto pulls = curves_of_ligaments(f); !pulls.empty()) plot("Ligaments", "tension (N)", pulls);
  if (const auto pairs = curves_of_pairs(f); !pairs.empty())
    plot("Contact, pair by pair", "sum of forces of a pair (N)", pairs);
  plot("Largest strain of a tet", "Green's strain",
       curves_of([](const BodyFigures& b) { return b.largest_strain; }, true));
  const double percent = 100 / f.figures.robot_surface_size_m;
  render::Curve two{"two surfaces", {0.80, 0.20, 0.15}, {}, {}}, own{"in itself", {0.16, 0.50, 0.73}, {}, {}},
      gap{"nearest", {0.16, 0.50, 0.73}, {}, {}}, at_contact{"where they press", {0.90, 0.49, 0.13}, {}, {}};
  for (const FrameFigures& frame : f.figures.frames) {
    two.x.push_back(frame.time_s), two.y.push_back(percent * frame.seen.overlap_m);
    own.x.push_back(frame.time_s), own.y.push_back(percent * frame.seen.self_overlap_m);
    double least = 0, pressed = 0;
    for (const SeenFrame::Gap& g : frame.seen.gaps)
      if (g.other >= 0) least = std::max(least, g.min_m), pressed = std::max(pressed, g.at_contact_m);
    gap.x.push_back(frame.time_s), gap.y.push_back(percent * least);
    at_contact.x.push_back(frame.time_s), at_contact.y.push_back(percent * pressed);
  }
  const SeenLimits limits;
  plot("Overlap that is seen", "% of the robot's size", {two, own}, {100 * limits.overlap});
  plot("Gap between bodies that press", "% of the robot's size", {gap, at_contact}, {100 * limits.worst_gap});
  plot("Stretch of a tet, largest", "singular value",
       curves_of([](const BodyFigures& b) { return b.largest_stretch; }, true), {limits.largest_stretch});
  plot("Stretch of a tet, least", "singular value",
       curves_of([](const BodyFigures& b) { return b.min_stretch; }, true), {limits.min_stretch});
  page.add("</div>\n");
}

FilmInPage film(const Findings& f, Page& page) {
  const fs::path path = f.folder / "film.mp4";
  const std::string of_plan =
      read_manifest(f.folder).value("render", Json::object()).value("trajectory_hash", std::string());
  if (!fs::exists(path)) return FilmInPage::none;
  if (of_plan != hex(plan::hash_of(f.plan().trajectory))) {
    log::warn("{}: is not known to show this plan, and is left out; make it with limber render {}",
              path.string(), f.folder.string());
    return FilmInPage::of_another_plan;
  }
  if (fs::file_size(path) > largest_film_bytes) {
    log::info("{}: has more than {} MB, and is left out", path.string(), largest_film_bytes / 1'000'000);
    return FilmInPage::too_large;
  }
  page.add(
      "<h2>Film</h2>\n<div class=\"card\"><video controls preload=\"metadata\" "
      "src=\"data:video/mp4;base64,{}\"></video></div>\n",
      base64(read_file(path)));
  return FilmInPage::embedded;
}

void promises(const Findings& f, Page& page) {
  const auto found = [](const std::string& value) {  // a promise that is kept may have nothing to tell
    return value.empty() ? "–" : escaped(value);
  };
  page.add(
      "<h2>Promises</h2>\n<div class=\"card wide\"><table "
      "id=\"promises\">\n<tr><th></th><th>promise</th><th>found</th></tr>\n");
  for (const Promise& p : f.promises.rows())
    page.add("<tr><td class=\"{0}\">{1} {0}</td><td>{2}</td><td>{3}</td></tr>\n", p.kept ? "kept" : "broken",
             p.kept ? "✓" : "✗", escaped(p.name), found(p.value));
  for (const Finding& m : f.promises.measured())
    page.add("<tr><td>found</td><td>{}</td><td>{}</td></tr>\n", escaped(m.what), found(m.value));
  page.add(
      "</table></div>\n<p class=\"note\">Checked anew for this page, as by <code>limber "
      "verify</code>; what is found is no promise.</p>\n");
}

void tree(const Findings& f, Page& page) {
  if (f.plan().left_out) {
    page.add(
        "<h2>How the tree grew</h2>\n<p class=\"note\">Of the {} nodes plan.npz keeps the {} of the path "
        "alone (<code>--keep-tree path</code>): how they grew is not told.</p>\n<figure class=\"card "
        "tree\">{}</figure>\n<p class=\"note\">{}</p>\n",
        plan::nodes_of(f.plan()), f.plan().tree.size(), inlined(tree_svg(f.scene(), f.world, f.plan())),
        escaped(f.planned.summary.value("explanation", std::string())));
    return;
  }
  const plan::Tree& t = f.plan().tree;
  render::Curve nodes{"nodes", {0.16, 0.50, 0.73}, {}, {}},
      nearest{"nearest so far", {0.80, 0.20, 0.15}, {}, {}};
  double best = 1e300;
  for (int n = 0; n < t.size(); ++n) {
    const State state = t.states[std::size_t(n)];
    best = std::min(best, (f.system.robot_center(state) - f.system.goal_shift(state) -
                           f.plan().settings.goal.center_of_mass_m)
                              .norm());
    const double iteration = double(t.iterations[std::size_t(n)] + 1);
    nodes.x.push_back(iteration), nodes.y.push_back(n + 1);
    nearest.x.push_back(iteration), nearest.y.push_back(best);
  }
  page.add("<h2>How the tree grew</h2>\n<div class=\"plots\">\n");
  const auto plot = [&](const char* title, const char* unit, const render::Curve& curve,
                        std::vector<double> limits) {
    page.add("<figure class=\"card\">{}</figure>\n",
             inlined(render::plot_svg({curve}, {.title = title,
                                                .x_label = "iterations",
                                                .y_label = unit,
                                                .width_px = 640,
                                                .height_px = 400,
                                                .limits = std::move(limits)})));
  };
  plot("Nodes", "nodes", nodes, {});
  plot("Distance from the goal", "metres; dashed: its radius", nearest, {f.plan().settings.goal.radius_m});
  page.add(
      "</div>\n<figure class=\"card tree\" style=\"margin-top:1rem\">{}</figure>\n<p class=\"note\">{}</p>\n",
      inlined(tree_svg(f.scene(), f.world, f.plan())),
      escaped(f.planned.summary.value("explanation", std::string())));
}

std::string short_of(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  return value.is_number_float() ? fmt::format("{:.4g}", value.get<double>()) : text_of(value);
}

// What numbers of a summary are called, and those within it one level down.
std::vector<std::vector<std::string>> rows_of(const Json& object, const std::string& before = "") {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [key, value] : object.items()) {
    if (value.is_object()) {
      const auto inner = rows_of(value, before + key + ".");
      rows.insert(rows.end(), inner.begin(), inner.end());
    } else if (key != "explanation" && !value.is_array()) {
      rows.push_back({before + key, short_of(value)});
    }
  }
  return rows;
}

void tables(const Findings& f, Page& page) {
  page.add("<h2>Bodies</h2>\n");
  std::vector<std::vector<std::string>> rows, times;
  const auto seconds = [](double s) { return fmt::format("{:.3f}", s); };
  for (std::size_t b = 0; b < f.bodies.size(); ++b) {
    const fem::Body& body = f.world.bodies[b];
    const PreparedBody& prepared = f.bodies[b];
    rows.push_back({body.name,
                    body.kind == fem::BodyKind::deformable ? "deformable"
                    : body.pushed()                        ? "rigid"
                    : body.moving                          ? "moves by keyframes"
                                                           : "stands still",
                    std::to_string(prepared.surface.positions.rows()),
                    std::to_string(prepared.surface.triangles.rows()),
                    std::to_string(prepared.cage.tets.rows()), fmt::format("{:.4g}", body.mass_kg),
                    fmt::format("{:.4g}", body.material.youngs_modulus_pa),
                    fmt::format("{:.2f}", 100 * f.figures.largest_volume_change[b])});
    double sum = 0;
    for (const auto& [stage, s] : prepared.report.cpu_seconds) sum += s;
    if (sum > 0) times.push_back({"prepare " + body.name, seconds(sum)});
  }
  page.table({"body", "kind", "vertices", "triangles", "tets", "mass, kg", "Young's modulus, Pa",
              "volume change at most, %"},
             rows);
  page.add("<h2>Timings</h2>\n");
  const plan::Statistics& s = f.plan().statistics;
  const bool searched = !f.plan().simulation;
  const bool known = searched && s.wall_s > 0;  // where timings.json is there
  if (known) times.push_back({"search", seconds(s.cpu_s)});
  const Json& dynamics = f.planned.summary.value("dynamics", Json::object());
  for (const char* part : {"elastic", "contact", "controls", "integration"})
    if (const auto key = std::string(part) + "_cpu_s"; dynamics.contains(key))
      times.push_back({std::string("of the dynamics, searching and replaying: ") + part,
                       seconds(dynamics.at(key).get<double>())});
  if (const auto film = fields_or_nothing<RenderedFilm>(read_manifest(f.folder).value("render", Json())))
    times.push_back({"render, last run", seconds(film->cpu_s)});
  page.table({"stage", "CPU s"}, times);
  if (known)
    page.add(
        "<p class=\"note\">Wall time of the search: {:.3f} s. {} rollouts computed for {} iterations.</p>\n",
        s.wall_s, s.rollouts, s.iterations);
  page.add(
      "<h2>All figures of the {}</h2>\n<details class=\"card\"><summary>as <code>limber info</code> prints "
      "them</summary>\n",
      searched ? "plan" : "simulation");
  page.table({"figure", "value"}, rows_of(f.planned.summary));
  page.add("</details>\n");
}

void scene_text(const Findings& f, Page& page) {
  std::string sets;
  for (const std::string& set : f.scene().sets) sets += "# --set " + set + "\n";
  page.add("<h2>Scene</h2>\n<details class=\"card\"><summary>{}</summary>\n<pre>{}{}</pre></details>\n",
           f.plan().simulation ? "the scene file, as it was simulated" : "the scene file, as it was planned",
           escaped(sets), escaped(f.scene().text));
  if (const std::string& script = f.scene().script.text; !script.empty())
    page.add("<details class=\"card\"><summary>{}</summary>\n<pre>{}</pre></details>\n",
             escaped(f.scene().script.name_for_messages), escaped(script));
}

Json motion_meta(const Findings& f, Json bodies) {
  const scenes::Scene& scene = f.scene();
  Box everything;
  std::vector<Json> path, shifts;
  for (const State& state : f.frames()) {
    path.push_back(json_of(Vec3(f.system.robot_center(state))));
    shifts.push_back(json_of(Vec3(f.system.goal_shift(state))));
    for (std::size_t b = 0; b < f.bodies.size(); ++b)
      if (f.world.bodies[b].moving)
        everything.include(bounding_box(fem::body_positions(f.world, state, int(b))));
  }
  for (const PreparedBody& body : f.bodies) everything.include(bounding_box(body.surface.positions));
  Box shown = everything;
  const std::vector<int>& subjects = scene.cameras[0].subjects;
  if (!subjects.empty()) {
    shown = bounding_box(f.bodies[std::size_t(subjects[0])].surface.positions);
    for (const int subject : subjects) {
      shown.include(bounding_box(f.bodies[std::size_t(subject)].surface.positions));
      for (const State& state : f.frames())
        shown.include(bounding_box(fem::body_positions(f.world, state, subject)));
    }
  } else if (scene.film.bounds_lines) {
    shown.include(scene.bounds_m);
  }
  render::Camera camera = render::frame_automatically(shown, scene.cameras[0].direction, 16.0 / 9,
                                                      scene.cameras[0].fov_deg, scene.cameras[0].fill);
  if (!scene.cameras[0].keyframes.empty())
    camera.eye = scene.cameras[0].keyframes[0].eye_m, camera.target = scene.cameras[0].keyframes[0].target_m;
  Json goal;
  if (!f.plan().simulation) {
    goal = {{"center", json_of(f.plan().settings.goal.center_of_mass_m)},
            {"radius", f.plan().settings.goal.radius_m}};
    if (scene.goal.box_m) goal["box"] = json_of(*scene.goal.box_m);
    if (scene.goal.moves_with >= 0) goal["shifts"] = shifts;
  }
  return {{"frames", f.frames().size()},
          {"frames_per_second", f.plan().trajectory.frames_per_second},
          {"bounds", json_of(scene.bounds_m)},
          {"stage", json_of(everything)},
          {"ground", scene.bounds_m.lower.z()},
          {"camera",
           {{"eye", json_of(camera.eye)}, {"target", json_of(camera.target)}, {"fov_deg", camera.fov_deg}}},
          {"goal", goal},
          {"path", path},
          {"bodies", std::move(bodies)}};
}

void end(const Findings& f, Page& page) {
  std::vector<Vec3> colors;
  for (const scenes::BodySpec& body : f.scene().bodies) colors.push_back(body.color_srgb);
  PackedMotion packed = pack_motion(f.world, f.bodies, colors, f.frames());
  std::string meta = motion_meta(f, std::move(packed.bodies)).dump();
  // Within a script of HTML nothing may look like its end.
  for (std::size_t at = 0; (at = meta.find('<', at)) != meta.npos;) meta.replace(at, 1, "\\u003c");
  page.add("<p class=\"note\">Made by limber {}; trajectory {}.</p>\n</main>\n", version,
           hex(plan::hash_of(f.plan().trajectory)));
  page.add("<script type=\"application/json\" id=\"motion-meta\">{}</script>\n", meta);
  page.add("<script type=\"text/plain\" id=\"motion-bytes\">{}</script>\n<script>\n", base64(packed.bytes));
  page.add_text(report_viewer);
  page.add_text(report_script);
  page.add("</script>\n</body>\n</html>\n");
}

}  // namespace

WrittenReport report(const fs::path& folder, const std::optional<fs::path>& file) {
  if (file && !file->parent_path().empty() && !fs::is_directory(file->parent_path()))
    throw InputError(fmt::format("{}: there is no folder {}; make it first", file->string(),
                                 file->parent_path().string()));
  const PlanFolder planned = read_plan_folder(folder);
  const std::vector<PreparedBody> bodies = read_caged_bodies_of(planned, folder);
  const fem::World world = build_world(planned.scene, bodies);  // as who judges finds it
  require_of_world(planned.plan, world, folder);
  const FemSystem system = system_of(planned, world, bodies);
  MotionFigures figures;
  const Verified verified = verify_plan(folder, planned, bodies, world, figures);
  const Findings findings{planned, bodies, world, system, figures, verified.promises, folder};

  WrittenReport written{.file = file.value_or(folder / "report.html"),
                        .all_kept = verified.promises.all_kept()};
  Page page;
  begin(findings, page);
  summary(findings, page);
  stage(page);
  written.film = film(findings, page);
  plots(findings, page);
  promises(findings, page);
  if (!planned.plan.simulation) tree(findings, page);
  tables(findings, page);
  scene_text(findings, page);
  end(findings, page);
  write_file(written.file, page.html());
  written.bytes = page.html().size();
  return written;
}

}  // namespace limber::detail
