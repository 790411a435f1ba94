// What a 1920×1080 frame costs, stage by stage, in CPU time: a body of 35, 350 and 1,400 thousand triangles
// made from one model, moved anew each frame, with shadow and occlusion by a coarse level of about 3,000
// vertices, ground, 2×2 or 4 samples, PNG in memory. The hash is of the last PNG: a faster run with another
// hash shows another picture (or is another CPU model).
//   build/bench/render_bench [armadillo.off] [--frames 10] [--repeat 1000] [--out DIR]
// Without a model, a made one. --repeat: frames for the growth of memory, of 320×180 pixels. --out: the
// pictures.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <map>
#include <numbers>
#include <string_view>

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "render/occlusion.h"
#include "render/png_file.h"
#include "render/renderer.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

SurfaceMesh read_off(const std::string& path) {
  std::ifstream file(path);
  std::string word;
  int vertices = 0, triangles = 0, edges = 0, sides = 0;
  file >> word >> vertices >> triangles >> edges;
  if (!file || word != "OFF") throw InputError(path + ": is not an OFF file");
  SurfaceMesh mesh{Points(vertices, 3), Triangles(triangles, 3)};
  for (int v = 0; v < vertices; ++v)
    file >> mesh.positions(v, 0) >> mesh.positions(v, 1) >> mesh.positions(v, 2);
  for (int t = 0; t < triangles; ++t)
    if (!(file >> sides >> mesh.triangles(t, 0) >> mesh.triangles(t, 1) >> mesh.triangles(t, 2)) ||
        sides != 3)
      throw InputError(path + ": has other faces than triangles, or is cut short");
  return mesh;
}

// Height 1, standing on the ground; y up becomes z up.
void set_up(SurfaceMesh& mesh) {
  Points turned(mesh.positions.rows(), 3);
  turned << mesh.positions.col(0), -mesh.positions.col(2), mesh.positions.col(1);
  const Box box = bounding_box(turned);
  const Vec3 foot(box.center().x(), box.center().y(), box.lower.z());
  mesh.positions = (turned.rowwise() - foot.transpose()) / box.size().maxCoeff();
}

// Vertices of one grid cell become one, in their middle.
SurfaceMesh clustered(const SurfaceMesh& fine, double cell_m) {
  std::map<std::array<int, 3>, int> number;
  std::vector<int> cluster;
  std::vector<Eigen::Vector4d> sums;
  for (int v = 0; v < fine.positions.rows(); ++v) {
    const Eigen::Vector3i cell = (fine.positions.row(v).transpose() / cell_m).array().floor().cast<int>();
    const int c = number.try_emplace({cell.x(), cell.y(), cell.z()}, int(number.size())).first->second;
    if (c == int(sums.size())) sums.push_back(Eigen::Vector4d::Zero());
    sums[std::size_t(c)] += Vec3(fine.positions.row(v)).homogeneous();
    cluster.push_back(c);
  }
  SurfaceMesh coarse{Points(Eigen::Index(sums.size()), 3), Triangles(fine.triangles.rows(), 3)};
  for (std::size_t c = 0; c < sums.size(); ++c)
    coarse.positions.row(Eigen::Index(c)) = sums[c].hnormalized().transpose();
  int kept = 0;
  for (int t = 0; t < fine.triangles.rows(); ++t) {
    const auto corner = [&](int i) { return cluster[std::size_t(fine.triangles(t, i))]; };
    if (corner(0) != corner(1) && corner(1) != corner(2) && corner(2) != corner(0))
      coarse.triangles.row(kept++) << corner(0), corner(1), corner(2);
  }
  coarse.triangles.conservativeResize(kept, 3);
  return coarse;
}

SurfaceMesh coarsened(const SurfaceMesh& fine, int triangles) {
  double low = 1e-4, high = 0.3;  // cell sizes that give more, and fewer
  for (int i = 0; i < 14; ++i) {
    const double middle = std::sqrt(low * high);
    (clustered(fine, middle).triangles.rows() > triangles ? low : high) = middle;
  }
  return clustered(fine, high);
}

// The longest edges are halved until there are about so many triangles, at most four times as many a round.
SurfaceMesh refined(SurfaceMesh mesh, int triangles) {
  using Edge = std::pair<int, int>;
  while (mesh.triangles.rows() < triangles) {
    std::vector<std::pair<double, Edge>> edges;
    for (int t = 0; t < mesh.triangles.rows(); ++t)
      for (int i = 0; i < 3; ++i) {
        const auto [a, b] = std::minmax({mesh.triangles(t, i), mesh.triangles(t, (i + 1) % 3)});
        edges.push_back({-(mesh.positions.row(a) - mesh.positions.row(b)).norm(), {a, b}});
      }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    // Each edge that is halved makes one triangle more of the two beside it.
    const std::size_t wanted = std::size_t(triangles - mesh.triangles.rows()) / 2 + 1;
    if (wanted < edges.size()) edges.resize(wanted);
    std::vector<std::pair<Edge, int>> middles;
    Points positions(mesh.positions.rows() + Eigen::Index(edges.size()), 3);
    positions.topRows(mesh.positions.rows()) = mesh.positions;
    for (const auto& [length, edge] : edges) {
      const int v = int(mesh.positions.rows()) + int(middles.size());
      positions.row(v) = 0.5 * (mesh.positions.row(edge.first) + mesh.positions.row(edge.second));
      middles.push_back({edge, v});
    }
    std::sort(middles.begin(), middles.end());
    const auto middle_of = [&](int a, int b) {
      const Edge edge = std::minmax(a, b);
      const auto found = std::lower_bound(middles.begin(), middles.end(), std::pair(edge, 0));
      return found != middles.end() && found->first == edge ? found->second : -1;
    };
    std::vector<std::array<int, 3>> rows;
    for (int t = 0; t < mesh.triangles.rows(); ++t) {
      std::array<int, 3> c{mesh.triangles(t, 0), mesh.triangles(t, 1), mesh.triangles(t, 2)}, m;
      const auto find = [&] {
        for (int i = 0; i < 3; ++i)
          m[std::size_t(i)] = middle_of(c[std::size_t(i)], c[std::size_t((i + 1) % 3)]);
        return 3 - int(std::count(m.begin(), m.end(), -1));
      };
      const int halved = find();
      // Turned so that the first edge is halved and, of two, the second as well.
      while (halved > 0 && halved < 3 && (m[0] < 0 || (halved == 2 && m[1] < 0)))
        std::rotate(c.begin(), c.begin() + 1, c.end()), find();
      if (halved == 0) rows.push_back(c);
      if (halved == 1) rows.insert(rows.end(), {{c[0], m[0], c[2]}, {m[0], c[1], c[2]}});
      if (halved == 2) rows.insert(rows.end(), {{m[0], c[1], m[1]}, {c[0], m[0], m[1]}, {c[0], m[1], c[2]}});
      if (halved == 3)
        rows.insert(rows.end(),
                    {{c[0], m[0], m[2]}, {m[0], c[1], m[1]}, {m[2], m[1], c[2]}, {m[0], m[1], m[2]}});
    }
    mesh.positions = positions;
    mesh.triangles.resize(Eigen::Index(rows.size()), 3);
    for (std::size_t t = 0; t < rows.size(); ++t)
      mesh.triangles.row(Eigen::Index(t)) << rows[t][0], rows[t][1], rows[t][2];
  }
  return mesh;
}

// Four coarse vertices near each fine one, as a binding has four nodes; found by the cells of a grid.
struct Prolongation {
  Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor> rows;
  Eigen::VectorXd operator()(const Eigen::VectorXd& coarse) const {
    Eigen::VectorXd fine(rows.rows());
    for (Eigen::Index v = 0; v < rows.rows(); ++v)
      fine[v] = 0.25 * (coarse[rows(v, 0)] + coarse[rows(v, 1)] + coarse[rows(v, 2)] + coarse[rows(v, 3)]);
    return fine;
  }
};
Prolongation prolongation(const Points& fine, const Points& coarse) {
  constexpr double cell_m = 0.05;
  using Cell = std::array<int, 3>;
  const auto cell_of = [&](const Vec3& p) {
    const Eigen::Vector3i c = (p / cell_m).array().floor().cast<int>();
    return Cell{c.x(), c.y(), c.z()};
  };
  std::map<Cell, std::vector<int>> grid;
  for (int c = 0; c < coarse.rows(); ++c) grid[cell_of(coarse.row(c))].push_back(c);
  Prolongation result{{fine.rows(), 4}};
  std::vector<std::pair<double, int>> near;
  for (int v = 0; v < fine.rows(); ++v) {
    const Cell cell = cell_of(fine.row(v));
    for (int reach = 1; reach == 1 || near.size() < 4; ++reach) {
      near.clear();
      for (int x = -reach; x <= reach; ++x)
        for (int y = -reach; y <= reach; ++y)
          for (int z = -reach; z <= reach; ++z)
            if (const auto found = grid.find({cell[0] + x, cell[1] + y, cell[2] + z}); found != grid.end())
              for (const int c : found->second)
                near.push_back({(coarse.row(c) - fine.row(v)).squaredNorm(), c});
    }
    std::partial_sort(near.begin(), near.begin() + 4, near.end());
    for (int k = 0; k < 4; ++k) result.rows(v, k) = near[std::size_t(k)].second;
  }
  return result;
}

const Vec3 toward_eye(-0.35, -1, 0.45);

// Leans over a little more with each frame.
Eigen::Matrix3d lean(int frame) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
  m(0, 2) = 0.1 * std::sin(0.3 * frame);
  return m;
}

// Of transparent surfaces: the body in the middle of the picture, or so near that it fills the picture.
enum class Transparent { none, whole, close };

// A body, its coarse level and a box beside it. As a transparent surface, it has two organs in it that are
// transparent surfaces, too, and the camera is nearer.
class Stage {
 public:
  Stage(const SurfaceMesh& body, const SurfaceMesh& coarse, const RenderSettings& look,
        Transparent transparent = Transparent::none)
      : body_(body),
        coarse_(coarse),
        box_(box_mesh({0.62, -0.3, 0}, {1.12, 0.3, 0.7})),
        renderer_(look),
        camera_(
            frame_automatically(transparent == Transparent::none ? look.stage : bounding_box(body.positions),
                                toward_eye, double(look.width) / look.height)),
        normals_(vertex_normals(body.positions, body.triangles)),
        coarse_normals_(vertex_normals(coarse.positions, coarse.triangles)),
        prolong_(prolongation(body.positions, coarse.positions)) {
    MeshLook fine_look{"body", Vec3(0xc0, 0x39, 0x2b) / 255}, coarse_look{"coarse"};
    fine_look.casts_shadow = false, fine_look.crease_angle_deg = 180;
    coarse_look.seen = false;
    fine_look.translucency = 0.8, fine_look.scatter_m = 0.05, fine_look.grain = 0.16,
    fine_look.grain_m = 0.03;
    if (transparent == Transparent::close) camera_.eye = 0.55 * camera_.eye + 0.45 * camera_.target;
    if (transparent != Transparent::none) {
      fine_look.opacity = 0.3, fine_look.sheet = true;
      coarse_look.casts_shadow = false;
      for (const double x : {-0.1, 0.08}) {
        const SurfaceMesh organ = sphere_mesh({x, 0, 0.5}, 0.15, 60);
        renderer_.add_mesh(organ.triangles, organ.positions, {"organ", {0.2, 0.3, 0.8}, 0.4, 0, 0.5});
      }
    }
    mesh_ = renderer_.add_mesh(body.triangles, body.positions, fine_look);
    caster_ = renderer_.add_mesh(coarse.triangles, coarse.positions, coarse_look);
    renderer_.add_mesh(box_.triangles, box_.positions, {"box", Vec3(0x29, 0x80, 0xb9) / 255});
    renderer_.add_lines(edges_of(look.stage), {});
  }

  std::string png(int frame, std::map<std::string, double>& seconds, StageTimes& stages) {
    double before = cpu_seconds();
    const auto done = [&](const char* what) {
      const double now = cpu_seconds();
      seconds[what] += now - before;
      before = now;
    };
    const Eigen::Matrix3d m = lean(frame), cofactor = m.inverse().transpose();
    moved_.noalias() = body_.positions * m.transpose();
    moved_normals_.noalias() = normals_ * cofactor.transpose();
    moved_normals_.rowwise().normalize();
    const Points coarse = coarse_.positions * m.transpose();
    done("0 move");
    renderer_.set_positions(mesh_, moved_, moved_normals_);
    renderer_.set_positions(caster_, coarse);
    done("1 positions");
    const Occluder occluders[] = {{coarse, coarse_.triangles}, {box_.positions, box_.triangles}};
    const Eigen::VectorXd hidden = sky_occlusion(coarse, coarse_normals_, occluders);
    done("2 occlusion");
    renderer_.set_occlusion(mesh_, prolong_(hidden));
    done("3 prolong");
    const Image8 image = renderer_.draw_shown(camera_, nullptr, &stages);
    done("4 draw");
    std::string bytes = png_bytes(image);
    done("5 png");
    return bytes;
  }

 private:
  const SurfaceMesh &body_, &coarse_;
  SurfaceMesh box_;
  Renderer renderer_;
  Camera camera_;
  Points normals_, coarse_normals_;
  Prolongation prolong_;
  int mesh_, caster_;
  Points moved_, moved_normals_;
};

RenderSettings look_of(int width, int height, bool multisampling) {
  RenderSettings look;
  look.width = width, look.height = height, look.multisampling = multisampling;
  look.ground_height_m = 0;
  look.stage.include(Vec3(-1, -1, 0)), look.stage.include(Vec3(1.4, 1, 1.4));
  return look;
}

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return resident * 4096 / 1e6;
}

void run(const std::string& model, const std::vector<int>& sizes, int frames, int repeat,
         const fs::path& out) {
  SurfaceMesh source = model.empty() ? sphere_mesh({0, 0, 0}, 1, 160) : read_off(model);
  set_up(source);
  const double read_s = cpu_seconds();
  std::map<std::string, double> none;
  StageTimes unused;
  const SurfaceMesh coarse = coarsened(source, 6000);
  {
    const double made_s = cpu_seconds();
    const auto made = std::chrono::steady_clock::now();
    Stage(source, coarse, look_of(1920, 1080, false)).png(0, none, unused);
    fmt::print(
        "first PNG, {} triangles: {:.2f} CPU s with the making of the renderer, {:.2f} s on the clock; "
        "reading the model {:.2f} CPU s before that\n",
        source.triangles.rows(), cpu_seconds() - made_s,
        std::chrono::duration<double>(std::chrono::steady_clock::now() - made).count(), read_s);
  }
  fmt::print("\nms CPU a frame, {} frames, without the first; coarse level: {} triangles\n", frames,
             coarse.triangles.rows());
  SurfaceMesh body = coarsened(source, 35000);
  if (!out.empty()) {
    fs::create_directories(out);
    const Camera camera = frame_automatically(look_of(1920, 1080, false).stage, toward_eye, 16.0 / 9);
    const auto numbers = [](const Vec3& p) { return Json{p.x(), p.y(), p.z()}; };
    write_json(
        out / "camera.json",
        {{"eye", numbers(camera.eye)}, {"target", numbers(camera.target)}, {"fov_deg", camera.fov_deg}});
  }
  for (const int triangles : sizes) {
    body = refined(body, triangles);
    if (!out.empty()) write_obj(out / fmt::format("{}k.obj", triangles / 1000), body);
    for (const char* way :
         {"ssaa", "opengl", "msaa"}) {  // opaque bodies in tiles, by OpenGL, by OpenGL with MSAA
      RenderSettings look = look_of(1920, 1080, way == std::string_view("msaa"));
      look.tiles = way == std::string_view("ssaa");
      Stage stage(body, coarse, look);
      stage.png(0, none, unused);  // shaders are compiled
      std::map<std::string, double> seconds;
      StageTimes stages;
      std::string png;
      const double before = cpu_seconds();
      for (int f = 0; f < frames; ++f) png = stage.png(f, seconds, stages);
      const double total = cpu_seconds() - before, ms = 1000.0 / frames;
      const std::string name = fmt::format("{}k-{}", triangles / 1000, way);
      fmt::print("{:>12}: {:5.0f}  = ", name, total * ms);
      for (const auto& [what, s] : seconds) fmt::print("{} {:.0f}, ", what.substr(2), s * ms);
      fmt::print(
          "in draw: shadow map {:.0f}, ground {:.0f}, opaque {:.0f}, lines {:.0f}, finish {:.0f}; {} kB, "
          "{}\n",
          stages.shadow_map_s * ms, stages.ground_s * ms, stages.opaque_s * ms, stages.lines_s * ms,
          stages.finish_s * ms, png.size() / 1000, hex(hash_of(png)));
      if (!out.empty()) write_file(out / (name + ".png"), png);
    }
  }
  for (const Transparent transparent : {Transparent::whole, Transparent::close})
    for (const char* way : {"tiles", "opengl"}) {
      RenderSettings look = look_of(1920, 1080, false);
      look.tiles = way == std::string_view("tiles");
      Stage stage(source, coarse, look, transparent);
      stage.png(0, none, unused);
      StageTimes stages;
      std::string png;
      const double before = cpu_seconds();
      for (int f = 0; f < frames; ++f) png = stage.png(f, none, stages);
      const std::string name =
          fmt::format("{}-{}", transparent == Transparent::whole ? "transparent" : "transparent-close", way);
      fmt::print(
          "{}, {} triangles over two organs of 14 k: {:.0f}, of which opaque and transparent {:.0f}, {}\n",
          name, source.triangles.rows(), 1000 * (cpu_seconds() - before) / frames,
          1000 * (stages.opaque_s + stages.transparent_s) / frames, hex(hash_of(png)));
      if (!out.empty()) write_file(out / fmt::format("{}.png", name), png);
    }
  if (repeat > 0) {
    Stage stage(source, coarse, look_of(320, 180, false));
    double settled = 0;
    for (int f = 0; f < repeat; ++f) {
      stage.png(f, none, unused);
      if (f == 20) settled = resident_mb();
    }
    fmt::print("\nresident memory: {:.1f} MB after 20 frames of 320×180, {:.1f} MB after {}: {:+.2f} %\n",
               settled, resident_mb(), repeat, 100 * (resident_mb() / settled - 1));
  }
}

}  // namespace
}  // namespace limber::render

int main(int argc, char** argv) try {
  CLI::App app("what a frame costs");
  std::string model, out;
  std::vector<int> triangles{35000, 350000, 1400000};
  int frames = 10, repeat = 0;
  app.add_option("model", model);
  app.add_option("--triangles", triangles, "ascending")->delimiter(',');
  app.add_option("--frames", frames);
  app.add_option("--repeat", repeat);
  app.add_option("--out", out);
  CLI11_PARSE(app, argc, argv);
  limber::render::run(model, triangles, frames, repeat, out);
} catch (const limber::InputError& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 2;
}
