// What an import costs and what it makes of files.
//   import_bench scale MODEL…          CPU seconds and peak MB of each stage, the model cut finer until it
//   has
//                                      two million triangles; and the exponent of each from end to end
//   import_bench table PROGRAM FILE…   a row a file: exit code, what PROGRAM found and did, seconds
#include <fcntl.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>

#include "core/error.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/import.h"
#include "meshing/repair.h"
#include "meshing/self_intersections.h"

namespace limber::meshing {
namespace {

// ── scale
// ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Each triangle becomes four, at the middles of its sides.
SurfaceMesh subdivided(const SurfaceMesh& mesh) {
  std::map<std::array<int, 2>, int> middles;
  std::vector<Vec3> added;
  const auto middle = [&](int a, int b) {
    const auto [found, is_new] =
        middles.try_emplace({std::min(a, b), std::max(a, b)}, int(mesh.positions.rows()) + int(added.size()));
    if (is_new) added.push_back(0.5 * (mesh.positions.row(a) + mesh.positions.row(b)));
    return found->second;
  };
  SurfaceMesh finer{Points(), Triangles(4 * mesh.triangles.rows(), 3)};
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const int a = mesh.triangles(t, 0), b = mesh.triangles(t, 1), c = mesh.triangles(t, 2);
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    finer.triangles.middleRows(4 * t, 4) << a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca;
  }
  finer.positions.resize(mesh.positions.rows() + Eigen::Index(added.size()), 3);
  finer.positions.topRows(mesh.positions.rows()) = mesh.positions;
  for (std::size_t i = 0; i < added.size(); ++i)
    finer.positions.row(mesh.positions.rows() + Eigen::Index(i)) = added[i];
  return finer;
}

double peak_mb_since(const std::function<void()>& work) {
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak counts anew from here
  work();
  return peak_memory_mb();
}

struct Stage {
  std::string name;
  double cpu_s, peak_mb;
};

std::vector<Stage> stages_of(const fs::path& file) {
  std::vector<Stage> stages;
  const auto stage = [&](const char* name, const std::function<void()>& work) {
    double seconds = 0;
    const double peak_mb = peak_mb_since([&] {
      const double start = cpu_seconds();
      work();
      seconds = cpu_seconds() - start;
    });
    stages.push_back({name, seconds, peak_mb});
  };
  SurfaceMesh mesh;
  stage("read", [&] {
    const detail::PolygonSoup soup = detail::read_ply(read_file(file), file.filename().string());
    mesh.positions.resize(Eigen::Index(soup.positions.size()), 3);
    for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
      mesh.positions.row(v) = soup.positions[std::size_t(v)];
    mesh.triangles = Eigen::Map<const Triangles>(soup.corners.data(), soup.polygon_count(), 3);
  });
  double tolerance_m = 0;
  stage("weld", [&] {
    tolerance_m = weld_tolerance_m(mesh, ImportOptions().weld_tolerance);
    weld(mesh.positions, tolerance_m);
  });
  stage("defects", [&] { find_defects(mesh, tolerance_m); });
  stage("drop", [&] { drop_collapsed(mesh), drop_duplicates(mesh); });
  stage("orient", [&] { orient(mesh); });
  stage("flat", [&] { remove_flat(mesh, tolerance_m); });
  stage("crossings", [&] { self_intersections(mesh); });
  mesh = {};
  stage("whole", [&] { import_model(file); });
  return stages;
}

void scale(const fs::path& model) {
  SurfaceMesh mesh = import_model(model, {.count_self_intersections = false}).surface;
  const fs::path file = fs::temp_directory_path() / "limber_import_bench.ply";
  std::vector<std::vector<Stage>> rows;
  std::vector<double> triangles;
  while (true) {
    write_ply(file, mesh);
    triangles.push_back(double(mesh.triangles.rows()));
    rows.push_back(stages_of(file));
    if (rows.size() == 1) {
      fmt::print("{}: CPU s (peak MB)\n{:>10}", model.filename().string(), "triangles");
      for (const Stage& s : rows[0]) fmt::print("{:>15}", s.name);
      fmt::print("\n");
    }
    fmt::print("{:>10}", mesh.triangles.rows());
    for (const Stage& s : rows.back()) fmt::print("{:>8.3f} ({:4.0f})", s.cpu_s, s.peak_mb);
    fmt::print("\n");
    std::fflush(stdout);
    if (mesh.triangles.rows() > 2e6) break;
    mesh = subdivided(mesh);
  }
  fs::remove(file);
  fmt::print("{:>10}", "exponent");
  for (std::size_t i = 0; i < rows[0].size(); ++i)
    fmt::print("{:>8.2f} {:6}",
               std::log(rows.back()[i].cpu_s / std::max(1e-4, rows[0][i].cpu_s)) /
                   std::log(triangles.back() / triangles[0]),
               "");
  fmt::print("\n");
}

// ── table
// ─────────────────────────────────────────────────────────────────────────────────────────────────────────

struct Run {
  int exit_code;  // 128 + the signal when one ended it
  Json said;
  double cpu_s, wall_s;
};

Run run(const std::string& program, const std::string& file) {
  const fs::path answer = fs::temp_directory_path() / "limber_import_bench.json";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, answer.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  std::string arguments[] = {program, "info", file, "--json"};
  char* argv[] = {arguments[0].data(), arguments[1].data(), arguments[2].data(), arguments[3].data(),
                  nullptr};
  const auto start = std::chrono::steady_clock::now();
  pid_t child = 0;
  if (posix_spawn(&child, program.c_str(), &actions, nullptr, argv, environ) != 0)
    throw InputError(fmt::format("{}: cannot be started", program));
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  rusage usage;
  wait4(child, &status, 0, &usage);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  Run result{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), Json(),
             seconds(usage.ru_utime) + seconds(usage.ru_stime), wall.count()};
  try {
    result.said = read_json(answer);
  } catch (const InputError& error) {
    result.said["error"] = error.what();
  }
  fs::remove(answer);
  return result;
}

std::vector<std::string> counts(const Json& defects) {
  std::vector<std::string> parts{fmt::format("{} triangles", defects.at("triangles").get<std::int64_t>()),
                                 fmt::format("{} components", defects.at("components").get<std::int64_t>())};
  for (const auto& [kind, defect] : defects.items())
    if (defect.is_object() && defect.at("count") > 0) {
      std::string words = kind;
      std::replace(words.begin(), words.end(), '_', ' ');
      parts.push_back(fmt::format("{} {}", defect.at("count").get<std::int64_t>(), words));
    }
  return parts;
}

// Without the place, which is long.
std::string records(const Json& sentence) {
  const std::string text = sentence.get<std::string>();
  return text.substr(0, text.find(", the first: "));
}

void table(const std::string& program, const std::vector<std::string>& files) {
  fmt::print("| file | exit | found | done | CPU s | wall s |\n|---|---|---|---|---|---|\n");
  for (const std::string& file : files) {
    const Run result = run(program, file);
    std::string found, done;
    if (result.exit_code == 0) {
      found = fmt::format("{}", fmt::join(counts(result.said.at("found")), ", "));
      std::vector<std::string> sentences;
      for (const char* list : {"mended", "warnings"})
        for (const Json& sentence : result.said.at(list)) sentences.push_back(records(sentence));
      done = fmt::format("{}", fmt::join(sentences, "; "));
    } else {
      done = "refused: " + result.said.value("error", "");
    }
    fmt::print("| {} | {} | {} | {} | {:.2f} | {:.2f} |\n", fs::path(file).filename().string(),
               result.exit_code, found, done, result.cpu_s, result.wall_s);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace limber::meshing

int main(int argc, char** argv) try {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() >= 2 && arguments[0] == "scale") {
    for (std::size_t i = 1; i < arguments.size(); ++i) limber::meshing::scale(arguments[i]);
  } else if (arguments.size() >= 3 && arguments[0] == "table") {
    limber::meshing::table(arguments[1], {arguments.begin() + 2, arguments.end()});
  } else {
    fmt::print(stderr, "import_bench scale MODEL… | import_bench table PROGRAM FILE…\n");
    return 2;
  }
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
