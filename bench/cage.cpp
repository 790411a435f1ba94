// cage_bench MODEL… TETS… [fast]: one line a model and budget: what the certificate proves, quality,
// tightness, CPU seconds.
#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/progress.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/import.h"
#include "meshing/quality.h"
#include "meshing/self_intersections.h"

using namespace limber;

int main(int argc, char** argv) try {
  std::vector<std::string> models;
  meshing::CageOptions options;
  std::vector<int> budgets;
  for (const std::string& argument : std::vector<std::string>(argv + 1, argv + argc)) {
    if (argument == "fast")
      options.mode = meshing::CageMode::fast;
    else if (std::isdigit(argument[0]))
      budgets.push_back(std::stoi(argument));
    else
      models.push_back(argument);
  }
  fmt::print(
      "{:<24} {:>9} {:>6} {:>6} {:>7} {:>8} {:>10} {:>6} {:>6} {:>6} {:>6} {:>7} {:>7} {:>6} {:>6} {:>7} "
      "{:>17}\n",
      "model", "triangles", "budget", "tets", "outside", "crossing", "unmanifold", "min °", "max °", "median",
      "V / V", "glued %", "height", "pieces", "CPU s", "proof s", "hash of the cage");
  for (const std::string& path : models) {
    const SurfaceMesh surface = meshing::import_model(path, {.count_self_intersections = false}).surface;
    for (int budget : budgets) {
      options.tets = budget;
      const double start = cpu_seconds();
      const meshing::Cage cage = meshing::build_cage(surface, {}, options);
      const double built = cpu_seconds();
      const meshing::Certificate c = meshing::certify(surface, cage.mesh);
      const double proved = cpu_seconds();
      const meshing::TetQuality q = meshing::measure_quality(cage.mesh);
      fmt::print(
          "{:<24} {:>9} {:>6} {:>6} {:>7} {:>8} {:>10} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.3f} {:>7.2f} {:>7.3f} "
          "{:>6} "
          "{:>6.2f} {:>7.2f}  {:016x}\n",
          fs::path(path).stem().string(), surface.triangles.rows(), budget, q.tets, c.vertices_outside,
          c.triangles_crossing, c.nonmanifold_edges + c.nonmanifold_vertices, q.min_dihedral_deg,
          q.max_dihedral_deg, q.median_min_dihedral_deg, cage.volume_ratio, 100 * cage.glued_share,
          q.min_height_m / (cage.spacing_m * std::sqrt(0.5)), cage.components, built - start, proved - built,
          c.cage_hash);
      for (const std::string& note : cage.notes) fmt::print("  {}\n", note);
    }
  }
} catch (const InputError& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 2;
}
