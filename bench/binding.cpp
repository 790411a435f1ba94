// binding_bench MODEL… TETS…: one line a model and budget: CPU ms to bind, million vertices a second that
// deform(), deform_phong() and deform_normals() move on one thread, the largest error of a round trip (bind,
// then deform with the cage at rest) over the diagonal, and the floor: the seconds a copy of as many bytes
// takes in the same run.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "ffd/binding.h"
#include "meshing/cage.h"
#include "meshing/import.h"

using namespace limber;

namespace {

// CPU seconds of one call, the best of several rounds of at least 20 ms each.
template <class Work>
double seconds_of(const Work& work) {
  double best = 1e300;
  for (int round = 0; round < 7; ++round) {
    const double start = cpu_seconds();
    int calls = 0;
    double spent = 0;
    do {
      work();
      ++calls;
      spent = cpu_seconds() - start;
    } while (spent < 0.02);
    best = std::min(best, spent / calls);
  }
  return best;
}

// What deform() must move for a vertex: a tet's number and four weights in, a position out.
constexpr double bytes_a_vertex = sizeof(int) + 4 * sizeof(double) + 3 * sizeof(double);

void measure(const std::string& path, const SurfaceMesh& surface, int tets) {
  const TetMesh cage = meshing::build_cage(surface, {}, {.tets = tets}).mesh;
  ffd::Binding binding;
  const double bind_s = seconds_of([&] { binding = ffd::bind(surface, cage); });
  Points moved, normals;
  const double deform_s = seconds_of([&] { ffd::deform(binding, cage.tets, cage.positions, moved); });
  const NodeGradients gradients = node_gradients(cage);
  Points bent;
  const double phong_s =
      seconds_of([&] { ffd::deform_phong(binding, cage, gradients, cage.positions, bent); });
  const Points rest = vertex_normals(surface.positions, surface.triangles);
  const double normals_s =
      seconds_of([&] { ffd::deform_normals(binding, cage, cage.positions, rest, normals); });

  const std::size_t half = std::size_t(bytes_a_vertex * double(surface.positions.rows()) / 2);
  std::vector<char> from(half, 1), to(half);
  const double copy_s = seconds_of([&] {
    std::memcpy(to.data(), from.data(), half);
    asm volatile("" ::"r"(to.data()) : "memory");  // so that no copy is left out
  });

  const double vertices = double(surface.positions.rows());
  const double error =
      (moved - surface.positions).rowwise().norm().maxCoeff() / bounding_box(surface.positions).diagonal();
  fmt::print("{:<24} {:>8.0f} {:>6} {:>8.2f} {:>8.0f} {:>8.0f} {:>8.0f} {:>9.1e} {:>8} {:>8.1f} {:>8.1f}\n",
             fs::path(path).stem().string(), vertices, cage.tets.rows(), 1e3 * bind_s,
             1e-6 * vertices / deform_s, 1e-6 * vertices / phong_s, 1e-6 * vertices / normals_s, error,
             binding.outside, 1e-9 * bytes_a_vertex * vertices / deform_s,
             1e-9 * bytes_a_vertex * vertices / copy_s);
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<std::string> models;
  std::vector<int> budgets;
  for (const std::string& argument : std::vector<std::string>(argv + 1, argv + argc))
    if (std::isdigit(argument[0]))
      budgets.push_back(std::stoi(argument));
    else
      models.push_back(argument);
  fmt::print("{:<24} {:>8} {:>6} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8} {:>8} {:>8}\n", "model", "vertices",
             "tets", "bind ms", "deform", "phong", "normals", "trip", "outside", "GB/s", "copy");
  for (const std::string& path : models) {
    const SurfaceMesh surface = meshing::import_model(path, {.count_self_intersections = false}).surface;
    for (const int tets : budgets) measure(path, surface, tets);
  }
} catch (const InputError& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 2;
}
