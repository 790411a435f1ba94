// scan_bench FOLDER [MILLIMETRES] [OUT.nii.gz]: closed models of a folder, in millimetres, as voxels of so
// many (2), and back to surfaces by surface nets: how far those are from the models, in voxels, and how their
// volumes differ. Writes the voxels, and their names beside them as OUT.json, where a file is named.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "core/json.h"
#include "core/progress.h"
#include "imaging/surface_nets.h"
#include "meshing/import.h"
#include "meshing/surface_tree.h"
#include "tests/imaging/voxelize.h"

using namespace limber;

int main(int argc, char** argv) {
  if (argc < 2) return fmt::print(stderr, "scan_bench FOLDER [MILLIMETRES] [OUT.nii.gz]\n"), 2;
  const double edge_m = (argc > 2 ? std::stod(argv[2]) : 2) / 1000;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(argv[1]))
    if (entry.path().extension() == ".obj") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<SurfaceMesh> surfaces;
  std::vector<std::string> names;
  for (const fs::path& file : files) {
    const std::string name = file.stem().string();
    if (name == "skin" || name == "body") continue;  // they are round all others
    surfaces.push_back(
        meshing::import_model(file, {.scale = 0.001, .count_self_intersections = false}).surface);
    names.push_back(name);
  }
  double start = cpu_seconds();
  imaging::LabelMap map = imaging::voxelized(surfaces, Vec3::Constant(edge_m));
  fmt::print("{} x {} x {} voxels of {:g} mm; {:.1f} CPU s to make, ", map.size[0], map.size[1], map.size[2],
             1000 * edge_m, cpu_seconds() - start);
  std::vector<int> rows;
  Json labels = Json::object();
  for (std::size_t n = 0; n < names.size(); ++n) {
    map.names[n + 1] = names[n];
    labels[names[n]] = n + 1;
    if (std::count(map.material.begin(), map.material.end(), n + 1) > 0) rows.push_back(int(n) + 1);
  }
  if (argc > 3) {
    const fs::path out = argv[3];
    imaging::write_nifti(out, map);
    write_json(fs::path(out).replace_extension().replace_extension(".json"), {{"labels", labels}});
  }
  start = cpu_seconds();
  const auto back = imaging::surfaces_of(map, rows);
  fmt::print("{:.1f} for surfaces\n", cpu_seconds() - start);
  fmt::print("{:16} {:>9} {:>9} {:>8}  {:>8} {:>8} {:>8}   of a voxel from the model\n", "", "voxels",
             "triangles", "volume", "median", "95 %", "most");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto n = std::size_t(rows[i]) - 1;
    const meshing::SurfaceTree tree(surfaces[n].positions, surfaces[n].triangles);
    std::vector<double> away;
    for (const auto& row : back[i].surface.positions.rowwise()) {
      const Vec3 p = row.transpose();
      away.push_back((tree.closest_point(p) - p).norm() / edge_m);
    }
    std::sort(away.begin(), away.end());
    if (away.empty()) continue;
    fmt::print("{:16} {:9} {:9} {:+7.2f} %  {:8.3f} {:8.3f} {:8.3f}\n", names[n], back[i].voxels,
               back[i].surface.triangles.rows(),
               100 * (std::abs(volume(back[i].surface)) / std::abs(volume(surfaces[n])) - 1),
               away[away.size() / 2], away[away.size() * 95 / 100], away.back());
  }
}
