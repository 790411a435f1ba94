// deformed_bench MODEL TETS OUT.png [y-up]: a contact sheet of a model that its cage twists and bends: at
// rest with the cage, deformed with normals carried tet by tet (as bindings usually do: kinks at the tets'
// borders), and deformed with the normals of ffd::deform_normals.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "ffd/binding.h"
#include "meshing/cage.h"
#include "meshing/import.h"
#include "render/film.h"
#include "render/png_file.h"
#include "render/renderer.h"

using namespace limber;

namespace {

constexpr double degree = std::numbers::pi / 180;

// Twisted round the upright axis through the middle, then bent sideways; nothing moves at the foot.
Points twisted(const Points& points, const Box& box) {
  Points moved(points.rows(), 3);
  const double height = box.size().z(), bend = 35 * degree;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    Vec3 p = Vec3(points.row(i)) - Vec3(box.center().x(), box.center().y(), box.lower.z());
    const double share = p.z() / height, eased = share * share * (3 - 2 * share);
    p = Eigen::AngleAxisd(55 * degree * eased, Vec3::UnitZ()) * p;
    const double angle = bend * share,
                 radius = height / bend;  // along a circle that touches the upright axis
    moved.row(i) << radius - (radius - p.x()) * std::cos(angle), p.y(), (radius - p.x()) * std::sin(angle);
  }
  return moved;
}

Points normals_tet_by_tet(const ffd::Binding& binding, const TetMesh& cage, const Points& nodes,
                          const Points& rest) {
  Points normals(rest.rows(), 3);
  for (Eigen::Index v = 0; v < rest.rows(); ++v) {
    Eigen::Matrix3d before, after;
    for (int k = 0; k < 3; ++k) {
      const auto tet = cage.tets.row(binding.tet_from_vertex[v]);
      before.col(k) = cage.positions.row(tet[k]) - cage.positions.row(tet[3]);
      after.col(k) = nodes.row(tet[k]) - nodes.row(tet[3]);
    }
    const Eigen::Matrix3d gradient = after * before.inverse();
    normals.row(v) = (gradient.inverse().transpose() * Vec3(rest.row(v))).normalized();
  }
  return normals;
}

Points edges_of_cage(const TetMesh& cage) {
  const Triangles faces = boundary_triangles(cage.tets);
  Points ends(3 * faces.rows(), 3);  // each edge of two faces is drawn once, from its lower node
  Eigen::Index row = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (const int a = faces(f, k), b = faces(f, (k + 1) % 3); a < b) {
        ends.row(row++) = cage.positions.row(a);
        ends.row(row++) = cage.positions.row(b);
      }
  return ends.topRows(row);
}

void draw(const std::string& model, int tets, const fs::path& out, bool y_up) {
  SurfaceMesh surface =
      meshing::import_model(model, {.y_up = y_up, .count_self_intersections = false}).surface;
  const TetMesh cage = meshing::build_cage(surface, {}, {.tets = tets}).mesh;
  const ffd::Binding binding = ffd::bind(surface, cage);
  const Box box = bounding_box(surface.positions);
  const Points rest = vertex_normals(surface.positions, surface.triangles),
               nodes = twisted(cage.positions, box);
  Points moved, smooth;
  ffd::deform(binding, cage.tets, nodes, moved);
  ffd::deform_normals(binding, cage, nodes, rest, smooth);

  Box chest = bounding_box(moved);  // a close view of the middle
  const Vec3 margin = 0.27 * chest.size();
  chest.lower += margin, chest.upper -= margin;
  const auto picture = [&](const Points& positions, const Points& normals, const Points& lines,
                           const std::optional<Box>& close, const char* name) {
    render::RenderSettings look;
    look.width = 760, look.height = 860, look.supersampling = 3;
    look.stage = bounding_box(positions);
    look.ground_height_m = look.stage.lower.z();
    look.toward_key = {-0.9, 0.6, 0.9};
    render::Renderer renderer(look);
    const int mesh =
        renderer.add_mesh(surface.triangles, positions,
                          {.name = "model", .color_srgb = {0.78, 0.55, 0.42}, .crease_angle_deg = 180});
    renderer.set_positions(mesh, positions, normals);
    if (lines.rows() > 0)
      renderer.add_lines(lines, {.color_srgb = {0.15, 0.3, 0.5}, .width_px = 1.5, .opacity = 0.7});
    const render::Camera camera = render::frame_automatically(close.value_or(look.stage), {-0.5, 1, 0.12},
                                                              double(look.width) / look.height, 30, 1);
    const fs::path file = fmt::format("{}.{}.png", out.string(), name);
    render::write_png(file, renderer.draw_shown(camera));
    return file;
  };
  const std::vector<fs::path> parts{
      picture(surface.positions, rest, edges_of_cage(cage), {}, "rest"),
      picture(moved, smooth, {}, {}, "deformed"),
      picture(moved, normals_tet_by_tet(binding, cage, nodes, rest), {}, chest, "tet_by_tet"),
      picture(moved, smooth, {}, chest, "blended")};
  render::write_png(out, render::contact_sheet(
                             parts,
                             {fmt::format("at rest, cage of {} tets", cage.tets.rows()), "twisted and bent",
                              "normals carried tet by tet", "normals of deform_normals"},
                             {.columns = 4, .tile_width_px = 290}));
  for (const fs::path& part : parts) fs::remove(part);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 4) throw InputError("usage: deformed_bench MODEL TETS OUT.png [y-up]");
  draw(argv[1], std::stoi(argv[2]), argv[3], argc > 4);
} catch (const InputError& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 2;
}
