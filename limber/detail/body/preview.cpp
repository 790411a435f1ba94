#include "limber/detail/body/preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/error.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "meshing/quality.h"
#include "render/annotate.h"
#include "render/png_file.h"
#include "render/renderer.h"

namespace limber::detail {

namespace {

struct Size {
  int width_px, height_px;
};
constexpr Size large{1600, 1000}, small{320, 240};
const Vec3 toward_eye(0.55, -1, 0.42);
const Vec3 model_srgb(0.80, 0.72, 0.62), line_srgb(0.10, 0.25, 0.45);

render::RenderSettings look_for(const Box& box, bool ground, const Size& size) {
  render::RenderSettings look;
  look.width = size.width_px, look.height = size.height_px;
  look.stage = box;
  look.toward_key = {-0.25, -0.9, 1.25};
  if (size.width_px == small.width_px)  // many on one page: what is plain is few bytes
    look.background_top_srgb = look.background_bottom_srgb = {0.95, 0.96, 0.97};
  else if (ground)
    look.ground_height_m = box.lower.z();
  return look;
}

render::Camera camera_for(const Box& box, const Size& size) {
  return render::frame_automatically(box, toward_eye, double(size.width_px) / size.height_px, 26, 1);
}

// By the smallest dihedral of a tet.
struct Grade {
  double from_deg;
  const char* text;
  Vec3 color_srgb;
};
const std::array<Grade, 5> grades{{{0, "below 5", {0.73, 0.09, 0.13}},
                                   {5, "5 to 15", {0.95, 0.50, 0.27}},
                                   {15, "15 to 30", {0.99, 0.83, 0.45}},
                                   {30, "30 to 45", {0.55, 0.75, 0.86}},
                                   {45, "from 45 degrees", {0.22, 0.42, 0.70}}}};

int grade_of(double smallest_deg) {
  int grade = 0;
  while (grade + 1 < int(grades.size()) && smallest_deg >= grades[std::size_t(grade + 1)].from_deg) ++grade;
  return grade;
}

std::vector<render::LegendKey> legend() {
  std::vector<render::LegendKey> keys;
  for (const Grade& g : grades) keys.push_back({g.text, g.color_srgb});
  return keys;
}

std::array<Vec3, 4> corners(const TetMesh& mesh, Eigen::Index t) {
  std::array<Vec3, 4> p;
  for (int k = 0; k < 4; ++k) p[std::size_t(k)] = mesh.positions.row(mesh.tets(t, k));
  return p;
}

// Lifted a little towards the eye, so that lines on a face are not half hidden in it.
Points lines_between(const std::set<std::pair<int, int>>& edges, const Points& points, const Vec3& eye) {
  Points ends(2 * Eigen::Index(edges.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [a, b] : edges)
    for (const int v : {a, b}) {
      const Vec3 p = points.row(v);
      ends.row(row++) = p + 0.0005 * (eye - p);
    }
  return ends;
}

std::string file_name_of(const PreparedBody& body) { return fs::path(body.report.model).filename().string(); }

std::string tets_caption(const PreparedBody& body) {
  const BodyReport::Cage& cage = body.report.cage.value();
  return fmt::format("mode {}: {} tets, {} nodes, dihedrals {:.1f} to {:.1f} degrees", cage.mode, cage.tets,
                     cage.nodes, cage.min_dihedral_deg, cage.max_dihedral_deg);
}

std::string fit_caption(const PreparedBody& body) {
  const BodyReport::Cage& cage = body.report.cage.value();
  const BodyReport::Certificate& c = body.report.certificate.value();
  const double ratio = cage.volume_ratio;
  return fmt::format("{}glued {:.1f} %; certificate {}: {} vertices outside, {} triangles cross",
                     ratio > 0 ? fmt::format("volume {:.3f} times the model's, ", ratio) : "",
                     100 * cage.glued_share, c.holds ? "holds" : "does NOT hold", c.vertices_outside,
                     c.triangles_crossing);
}

// Apart, away from `middle`.
render::Image8 draw_shells(const std::vector<ConvexShell>& shells, const Vec3& middle, const Size& size) {
  constexpr double apart = 0.45;  // of a shell's distance from the middle
  std::vector<Points> moved;
  Box box;
  for (const ConvexShell& shell : shells) {
    const Vec3 away = apart * (bounding_box(shell.vertices).center() - middle);
    moved.push_back(shell.vertices.rowwise() + away.transpose());
    box.include(bounding_box(moved.back()));
  }
  render::Renderer renderer(look_for(box, true, size));
  for (std::size_t s = 0; s < shells.size(); ++s)
    renderer.add_mesh(
        shells[s].triangles, moved[s],
        {.name = "shell", .color_srgb = shell_color(s), .roughness = 0.6, .crease_angle_deg = 8});
  return renderer.draw_shown(camera_for(box, size));
}

render::Image8 picture_of_shells(const PreparedBody& body, const std::vector<ConvexShell>& shells) {
  const BodyReport::Shells& figures = body.report.shells.value();
  return render::with_caption(
      draw_shells(shells, bounding_box(body.surface.positions).center(), large),
      {fmt::format("{}: {} convex shells, drawn apart", file_name_of(body), shells.size()),
       fmt::format(
           "overshoot mean {:.3f} %, largest {:.3f} % of the diagonal; {} of {} triangles not covered",
           100 * figures.mean_overshoot, 100 * figures.max_overshoot, figures.triangles_uncovered,
           body.surface.triangles.rows())});
}

// The cage's edges over the surface; those of faces turned away are faint.
render::Image8 draw_cage(const SurfaceMesh& surface, const TetMesh& cage, const Size& size) {
  const Box box = bounding_box(cage.positions);
  const render::Camera camera = camera_for(box, size);
  render::Renderer renderer(look_for(box, true, size));
  renderer.add_mesh(surface.triangles, surface.positions, {.name = "surface", .color_srgb = model_srgb});
  const Triangles faces = boundary_triangles(cage.tets);
  std::set<std::pair<int, int>> front, all;
  for (const auto face : faces.rowwise()) {
    const Vec3 a = cage.positions.row(face[0]), b = cage.positions.row(face[1]),
               c = cage.positions.row(face[2]);
    const bool seen = (b - a).cross(c - a).dot(camera.eye - a) > 0;
    for (int k = 0; k < 3; ++k) {
      const std::pair<int, int> edge = std::minmax({int(face[k]), int(face[(k + 1) % 3])});
      all.insert(edge);
      if (seen) front.insert(edge);
    }
  }
  for (const auto& edge : front) all.erase(edge);
  renderer.add_lines(
      lines_between(all, cage.positions, camera.eye),
      {.color_srgb = line_srgb, .width_px = std::max(0.6, size.width_px / 1600.0), .opacity = 0.22});
  renderer.add_lines(
      lines_between(front, cage.positions, camera.eye),
      {.color_srgb = line_srgb, .width_px = std::max(0.8, 1.8 * size.width_px / 1600), .opacity = 0.9});
  return renderer.draw_shown(camera);
}

render::Image8 picture_of_cage(const PreparedBody& body) {
  return render::with_caption(draw_cage(body.surface, body.cage, large),
                              {fmt::format("{}: the cage over the surface of {} triangles",
                                           file_name_of(body), body.surface.triangles.rows()),
                               tets_caption(body), fit_caption(body)});
}

// Whole tets: the half whose middles lie farther back, along y.
render::Image8 picture_of_cut(const PreparedBody& body) {
  const TetMesh& cage = body.cage;
  const Box box = bounding_box(cage.positions);
  const render::Camera camera = camera_for(box, large);
  std::map<std::array<int, 3>, std::pair<std::array<int, 3>, int>>
      open;  // by sorted corners: the face, its grade
  std::vector<double> middles;
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
    const auto [a, b, c, d] = corners(cage, t);
    middles.push_back(0.25 * (a + b + c + d).y());
  }
  std::vector<double> sorted = middles;
  std::sort(sorted.begin(), sorted.end());
  const double cut = sorted[sorted.size() / 2];
  constexpr int face_of[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};  // seen from outside
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
    const auto [a, b, c, d] = corners(cage, t);
    if (middles[std::size_t(t)] < cut) continue;
    const int grade = grade_of(meshing::dihedral_range(a, b, c, d).min_deg);
    for (const auto& f : face_of) {
      const std::array<int, 3> face{cage.tets(t, f[0]), cage.tets(t, f[1]), cage.tets(t, f[2])};
      std::array<int, 3> key = face;
      std::sort(key.begin(), key.end());
      if (!open.emplace(key, std::pair(face, grade)).second) open.erase(key);  // a second tet hides it
    }
  }
  std::array<std::vector<std::array<int, 3>>, grades.size()> faces;
  std::set<std::pair<int, int>> edges;
  for (const auto& [key, shown] : open) {
    faces[std::size_t(shown.second)].push_back(shown.first);
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax(key[std::size_t(k)], key[std::size_t((k + 1) % 3)]));
  }
  render::Renderer renderer(look_for(box, true, large));
  for (std::size_t g = 0; g < faces.size(); ++g) {
    if (faces[g].empty()) continue;
    const Triangles triangles =
        Eigen::Map<const Triangles>(faces[g].front().data(), Eigen::Index(faces[g].size()), 3);
    renderer.add_mesh(
        triangles, cage.positions,
        {.name = "tets", .color_srgb = grades[g].color_srgb, .roughness = 0.8, .crease_angle_deg = 1});
  }
  renderer.add_lines(lines_between(edges, cage.positions, camera.eye),
                     {.color_srgb = {0.12, 0.12, 0.15}, .width_px = 1.3, .opacity = 0.8});
  return render::with_caption(
      renderer.draw_shown(camera),
      {fmt::format("{}: tets behind a cut, coloured by their smallest dihedral", file_name_of(body)),
       tets_caption(body), fit_caption(body)},
      legend());
}

render::Image8 picture_of_dihedrals(const PreparedBody& body) {
  std::vector<double> angles;
  for (Eigen::Index t = 0; t < body.cage.tets.rows(); ++t)
    for (const double angle : meshing::dihedral_angles(corners(body.cage, t))) angles.push_back(angle);
  constexpr int bars = 36;
  constexpr double bar_deg = 180.0 / bars;
  render::HistogramLook look{.x_label = "dihedral angle, degrees",
                             .y_label = "angles (six a tet)",
                             .low = 0,
                             .high = 180,
                             .bar_srgb = {},
                             .width_px = large.width_px,
                             .height_px = large.height_px - 100};
  for (int b = 0; b < bars; ++b)
    look.bar_srgb.push_back(
        grades[std::size_t(grade_of(std::min(b * bar_deg, 180 - (b + 1) * bar_deg)))].color_srgb);
  const BodyReport::Cage& cage = body.report.cage.value();
  return render::with_caption(
      render::histogram(angles, look),
      {fmt::format("{}: dihedral angles of {} tets", file_name_of(body), body.cage.tets.rows()),
       fmt::format("smallest {:.1f}, largest {:.1f}; median of the tets' smallest {:.1f} degrees",
                   cage.min_dihedral_deg, cage.max_dihedral_deg, cage.median_min_dihedral_deg)});
}

}  // namespace

// Colours that stay apart: hues by the golden ratio, three kinds of strength.
Vec3 shell_color(std::size_t i) {
  constexpr std::array<std::array<double, 2>, 3> strength{{{0.55, 0.90}, {0.75, 0.72}, {0.38, 0.95}}};
  const double hue = 6 * std::fmod(0.08 + 0.618033988749895 * double(i), 1.0);
  const auto [saturation, value] = strength[i % strength.size()];
  Vec3 color;
  for (int c = 0; c < 3; ++c) {  // red is strongest at hue 0, green at 2, blue at 4
    const double apart = std::abs(std::remainder(hue - 2 * c, 6.0));
    color[c] = value * (1 - saturation * std::clamp(apart - 1, 0.0, 1.0));
  }
  return color;
}

bool has_picture(const fs::path& folder) { return render::inspect_png(folder / picture_file).has_value(); }

void write_picture(const fs::path& folder) {
  SurfaceMesh surface = read_ply(folder / "surface.ply");
  const Eigen::RowVector3d middle = bounding_box(surface.positions).center().transpose();
  surface.positions.rowwise() -= middle;
  if (fs::exists(folder / "cage.msh")) {
    TetMesh cage = read_msh(folder / "cage.msh");
    cage.positions.rowwise() -= middle;
    render::write_png(folder / picture_file, draw_cage(surface, cage, small));
  } else {
    std::vector<ConvexShell> shells = read_obj_shells(folder / "shells.obj");
    for (ConvexShell& shell : shells) shell.vertices.rowwise() -= middle;
    render::write_png(folder / picture_file, draw_shells(shells, Vec3::Zero(), small));
  }
}

void write_previews(PreparedBody body, std::vector<ConvexShell> shells, const fs::path& folder) {
  // What is drawn is drawn in float32, which far from the origin is too coarse.
  const Eigen::RowVector3d middle = bounding_box(body.surface.positions).center().transpose();
  body.surface.positions.rowwise() -= middle, body.cage.positions.rowwise() -= middle;
  for (ConvexShell& shell : shells) shell.vertices.rowwise() -= middle;
  Progress progress("preview", std::size(preview_files));
  for (std::size_t i = 0; i < std::size(preview_files); ++i) {
    throw_if_stopped();
    render::write_png(folder / preview_files[i], i == 0   ? picture_of_shells(body, shells)
                                                 : i == 1 ? picture_of_cage(body)
                                                 : i == 2 ? picture_of_cut(body)
                                                          : picture_of_dihedrals(body));
    progress.update(std::int64_t(i) + 1);
  }
}

}  // namespace limber::detail
