// check_cage SURFACE [--tets FILE] [--shells FILE] [--scale S]: judges what any program made of a model, from
// the files alone, and prints one line of JSON. Shares no code with limber. Every count that says so in
// cage.h and shells.h is exact. SURFACE: .off, .obj, .ply, .stl, its coordinates times S. Tets: .msh (2.2
// ASCII), .mesh, .ele. Shells: .obj. Exit code: 0 all holds, 1 something does not, 2 a file cannot be read.
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/check_cage/cage.h"
#include "tools/check_cage/shells.h"

using namespace check;
using Json = nlohmann::ordered_json;

namespace {

Json json_of(const CageFacts& f) {
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole > 0 ? double(part) / double(whole) : 0;
  };
  return {{"holds", f.holds()},
          {"vertices_outside", f.vertices_outside},
          {"enclosed_share", 1 - share(f.vertices_outside, f.surface_vertices)},
          {"triangles_crossing", f.triangles_crossing},
          {"triangles_meeting", f.triangles_meeting},
          {"tets", f.tets},
          {"tets_not_positive", f.tets_not_positive},
          {"faces_overfull", f.faces_overfull},
          {"boundary_triangles", f.boundary_triangles},
          {"boundary_edges_not_manifold", f.boundary_edges_not_manifold},
          {"boundary_vertices_not_manifold", f.boundary_vertices_not_manifold},
          {"boundary_pairs_crossing", f.boundary_pairs_crossing},
          {"components", f.components},
          {"min_dihedral_deg", f.min_dihedral_deg},
          {"max_dihedral_deg", f.max_dihedral_deg},
          {"median_dihedral_deg", f.median_dihedral_deg},
          {"volume", f.volume},
          {"volume_ratio",
           f.surface_closed && f.surface_volume != 0 ? Json(f.volume / std::abs(f.surface_volume)) : Json()},
          {"tets_at_surface", f.tets_at_surface},
          {"glued_share", share(f.tets_glued, f.tets_at_surface)}};
}

Json json_of(const ShellFacts& f) {
  return {{"holds", f.holds()},
          {"shells", f.shells},
          {"most_vertices", f.max_vertices},
          {"shells_not_convex", f.shells_not_convex},
          {"vertices_uncovered", f.vertices_uncovered},
          {"triangles_uncovered", f.triangles_uncovered},
          {"samples", f.samples},
          {"mean_overshoot", f.mean_overshoot},
          {"percentile_99_overshoot", f.percentile_99_overshoot},
          {"max_overshoot", f.max_overshoot},
          {"sum_of_volumes", f.sum_of_volumes}};
}

double positive(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0) || !std::isfinite(value))
    throw FileError("--scale " + text + ": give a positive number");
  return value;
}

}  // namespace

int main(int argc, char** argv) try {
  std::string surface_file, tet_file, shell_file;
  double scale = 1;
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& a = arguments[i];
    const bool has_value = i + 1 < arguments.size();
    if (a == "--tets" && has_value)
      tet_file = arguments[++i];
    else if (a == "--shells" && has_value)
      shell_file = arguments[++i];
    else if (a == "--scale" && has_value)
      scale = positive(arguments[++i]);
    else if (surface_file.empty() && !a.starts_with("--"))
      surface_file = a;
    else
      throw FileError(a + ": usage: check_cage SURFACE [--tets FILE] [--shells FILE] [--scale S]");
  }
  if (surface_file.empty())
    throw FileError("usage: check_cage SURFACE [--tets FILE] [--shells FILE] [--scale S]");
  const Solid solid(read_surface(surface_file, scale));
  Json out{{"surface",
            {{"vertices", solid.surface().points.size()},
             {"triangles", solid.surface().triangles.size()},
             {"closed", solid.closed()},
             {"area", solid.area()},
             {"volume", solid.volume()}}}};
  bool holds = true;
  if (!tet_file.empty()) {
    const CageFacts facts = judge_cage(solid, read_tets(tet_file));
    out["cage"] = json_of(facts);
    holds = holds && facts.holds();
  }
  if (!shell_file.empty()) {
    const ShellFacts facts = judge_shells(solid, read_shells(shell_file));
    out["shells"] = json_of(facts);
    holds = holds && facts.holds();
  }
  std::printf("%s\n", out.dump().c_str());
  return holds ? 0 : 1;
} catch (const FileError& error) {
  std::fprintf(stderr, "check_cage: %s\n", error.what());
  return 2;
}
