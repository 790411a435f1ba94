#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "core/export_files.h"
#include "core/progress.h"
#include "fem/observe.h"
#include "limber/detail/exports/motion_files.h"

namespace limber::detail {

namespace {

// The meshes of all bodies as one, body after body. Corners: 3 or 4.
struct Merged {
  Points points;
  Cells cells;
  std::vector<int> body;  // of each cell

  void add(const Points& more, const Eigen::Ref<const Cells>& more_cells, int b) {
    const Eigen::Index first = points.rows(), first_cell = cells.rows();
    points.conservativeResize(first + more.rows(), 3);
    points.bottomRows(more.rows()) = more;
    cells.conservativeResize(first_cell + more_cells.rows(), more_cells.cols());
    cells.bottomRows(more_cells.rows()) = more_cells.array() + int(first);
    body.resize(body.size() + std::size_t(more_cells.rows()), b);
  }
};

// (N × 3) m/s; zero for a body that stands still.
Points velocities(const fem::Body& body, const State& state) {
  Points v = Points::Zero(body.node_count(), 3);
  if (body.moving)
    v = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>>(
            state.velocities.data() + 3 * body.first_node, body.node_count(), 3)
            .cast<double>();
  return v;
}

struct Frame {
  Merged cages, surfaces;
  std::vector<float> velocity;                         // of the cages' nodes
  std::vector<float> strain, von_mises, volume_ratio;  // of their tets
  std::vector<float> surface_speed, surface_strain;    // of the surfaces' vertices
};

Frame frame_of(const PlannedMotion& motion, int f) {
  const State& state = motion.frames[std::size_t(f)];
  Frame frame;
  Points surface_velocity;
  for (int b = 0; b < int(motion.bodies.size()); ++b) {
    const fem::Body& body = motion.world.bodies[std::size_t(b)];
    const PreparedBody& prepared = motion.bodies[std::size_t(b)];
    frame.cages.add(fem::body_positions(motion.world, state, b), prepared.cage.tets, b);
    frame.surfaces.add(surface_at(motion, b, f), prepared.surface.triangles, b);

    const Points velocity = velocities(body, state);
    frame.velocity.insert(frame.velocity.end(), velocity.data(), velocity.data() + velocity.size());
    const fem::Strains strains = fem::strains(motion.world, state, b);
    const auto append = [](std::vector<float>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(frame.strain, strains.largest), append(frame.von_mises, strains.von_mises);
    for (const double change : fem::volume_changes(motion.world, state, b))
      frame.volume_ratio.push_back(float(1 + change));

    const ffd::Binding& binding = prepared.binding;
    deform(prepared, velocity, surface_velocity);  // it is linear in the nodes
    for (Eigen::Index v = 0; v < binding.weights.rows(); ++v) {
      frame.surface_speed.push_back(float(surface_velocity.row(v).norm()));
      frame.surface_strain.push_back(float(strains.largest[std::size_t(binding.tet_from_vertex[v])]));
    }
  }
  return frame;
}

std::vector<float> lengths(const std::vector<float>& vectors) {
  std::vector<float> result;
  for (std::size_t i = 0; i + 2 < vectors.size(); i += 3)
    result.push_back(Vec3f(vectors[i], vectors[i + 1], vectors[i + 2]).norm());
  return result;
}

// Files of an earlier series would only confuse.
void remove_others(const fs::path& folder, const std::set<std::string>& ours) {
  std::vector<fs::path> others;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() == ".vtu" && stem.find_first_not_of("0123456789") == stem.npos &&
        !ours.contains(entry.path().filename().string()))
      others.push_back(entry.path());
  }
  for (const fs::path& other : others) fs::remove(other, ignored);
}

}  // namespace

WrittenFiles write_vtu_series(const PlannedMotion& motion, const fs::path& out) {
  const fs::path folder = out / "vtu";
  for (const char* series : {"cages", "surfaces"}) {
    make_folder(folder / series);
    std::error_code ignored;
    fs::remove(folder / fmt::format("{}.pvd", series), ignored);  // a list is there when all that it names is
  }
  WrittenFiles written{folder / "surfaces.pvd", 0, 0};
  std::vector<PvdEntry> cages, surfaces;
  std::set<std::string> names;
  Progress progress("vtu", std::int64_t(motion.wanted.size()));
  for (const int f : motion.wanted) {
    throw_if_stopped();
    const std::string name = fmt::format("{:04}.vtu", f);
    const Frame frame = frame_of(motion, f);
    written.bytes +=
        write_binary_vtu(folder / "cages" / name, frame.cages.points, frame.cages.cells,
                         {{"velocity_m_s", frame.velocity, 3}, {"speed_m_s", lengths(frame.velocity)}},
                         {{"body", frame.cages.body},
                          {"largest_strain", frame.strain},
                          {"von_mises_strain", frame.von_mises},
                          {"volume_ratio", frame.volume_ratio}});
    written.bytes +=
        write_binary_vtu(folder / "surfaces" / name, frame.surfaces.points, frame.surfaces.cells,
                         {{"speed_m_s", frame.surface_speed}, {"largest_strain", frame.surface_strain}},
                         {{"body", frame.surfaces.body}});
    cages.push_back({motion.time_s(f), "cages/" + name});
    surfaces.push_back({motion.time_s(f), "surfaces/" + name});
    names.insert(name);
    progress.update(std::int64_t(names.size()));
  }
  for (const auto& [series, entries] : {std::pair("cages", &cages), std::pair("surfaces", &surfaces)}) {
    remove_others(folder / series, names);
    const fs::path list = folder / fmt::format("{}.pvd", series);
    write_pvd(list, *entries);
    written.bytes += fs::file_size(list);
  }
  written.files = 2 * int(motion.wanted.size()) + 2;
  return written;
}

}  // namespace limber::detail
