// What a 1920×1080 frame costs in CPU time, PNG included: one light with shadow, ground, 2×2 samples, one
// body beside a box. The label is the hash of the picture's bytes; a faster run with another hash shows
// another picture (or another CPU model).
//   build/bench/render_bench [MODEL.off …]        one thread; made spheres when no model is named
#include <benchmark/benchmark.h>

#include <fstream>
#include <numbers>

#include "core/error.h"
#include "core/hash.h"
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

void frame(benchmark::State& bench, SurfaceMesh body) {
  set_up(body);
  const SurfaceMesh box = box_mesh({0.62, -0.3, 0}, {1.12, 0.3, 0.7});
  Look look;
  look.ground_height_m = 0;
  look.stage.include(Vec3(-1, -1, 0)), look.stage.include(Vec3(1.4, 1, 1.4));
  Renderer renderer(look);
  const int mesh = renderer.add_mesh(body.triangles, body.positions, {"body", Vec3(0xc0, 0x39, 0x2b) / 255});
  renderer.add_mesh(box.triangles, box.positions, {"box", Vec3(0x29, 0x80, 0xb9) / 255});
  renderer.add_lines(edges_of(look.stage), {});
  const Camera camera = frame_automatically(look.stage, {-0.35, -1, 0.45}, 16.0 / 9);
  std::string png;
  for (auto _ : bench) {
    renderer.set_positions(mesh, body.positions, vertex_normals(body.positions, body.triangles));
    png = png_bytes(tone_mapped(renderer.draw(camera)));
  }
  bench.counters["triangles"] = double(body.triangles.rows());
  bench.counters["png_kB"] = double(png.size()) / 1000;
  bench.SetLabel(hex(hash_of(png)));
}

}  // namespace
}  // namespace limber::render

int main(int argc, char** argv) {
  using namespace limber;
  benchmark::Initialize(&argc, argv);
  const auto add = [](const std::string& name, const SurfaceMesh& mesh) {
    benchmark::RegisterBenchmark(name.c_str(), render::frame, mesh)->Unit(benchmark::kMillisecond);
  };
  for (int i = 1; i < argc; ++i) add(fs::path(argv[i]).filename(), render::read_off(argv[i]));
  if (argc == 1)
    for (const int rings : {93, 297})
      add("sphere of " + std::to_string(rings) + " rings", render::sphere_mesh({0, 0, 0}, 1, rings));
  benchmark::RunSpecifiedBenchmarks();
}
