// decompose_bench MODEL=SHELLS[,BOUND]…: a line a model. Overshoot in % of the diagonal, volume of all shells
// over the model's, what is not covered, CPU seconds without the import, peak memory of the program so far.
#include <cstdio>

#include "core/error.h"
#include "core/progress.h"
#include "meshing/decompose.h"
#include "meshing/import.h"

int main(int argc, char** argv) {
  using namespace limber;
  std::printf("%-24s %9s %6s %6s %7s %7s %7s %8s %6s %6s %10s %6s %5s\n", "model", "triangles", "shells",
              "corners", "mean %", "99 %", "max %", "volumes", "v out", "t out", "stopped by", "CPU s", "MB");
  for (int i = 1; i < argc; ++i) try {
      const std::string argument = argv[i];
      const std::size_t equals = argument.rfind('=');
      if (equals == std::string::npos)
        throw InputError(argument + ": write MODEL=SHELLS or MODEL=SHELLS,BOUND");
      const fs::path model = argument.substr(0, equals);
      const std::string limits = argument.substr(equals + 1);
      meshing::DecomposeOptions options{.max_shells = std::stoi(limits)};
      if (const std::size_t comma = limits.find(','); comma != std::string::npos)
        options.max_concavity = std::stod(limits.substr(comma + 1));
      const SurfaceMesh surface = meshing::import_model(model, {}).surface;
      const double start = cpu_seconds();
      const meshing::Decomposition result = meshing::decompose(surface, options);
      const double seconds = cpu_seconds() - start;
      Eigen::Index corners = 0;
      for (const ConvexShell& shell : result.shells) corners = std::max(corners, shell.vertices.rows());
      std::printf("%-24s %9ld %6zu %6ld %7.3f %7.3f %7.3f %8.4f %6ld %6ld %10s %6.2f %5.0f\n",
                  model.stem().c_str(), long(surface.triangles.rows()), result.shells.size(), long(corners),
                  100 * result.mean_overshoot, 100 * result.percentile_99_overshoot,
                  100 * result.max_overshoot, result.sum_of_hull_volumes / result.model_volume,
                  long(result.vertices_uncovered), long(result.triangles_uncovered),
                  result.stopped_by.c_str(), seconds, peak_memory_mb());
      std::fflush(stdout);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      return 2;
    }
}
