#include "cli/body_report.h"

#include <fmt/format.h>

namespace limber::cli {

namespace {

std::string size_text(const Json& surface) {  // "0.12 × 0.09 × 0.1"
  std::string text;
  for (std::size_t c = 0; c < 3; ++c)
    text += fmt::format("{}{:.3g}", c > 0 ? " × " : "",
                        surface.at("upper_m")[c].get<double>() - surface.at("lower_m")[c].get<double>());
  return text;
}

// Files do not tell their unit, and those of scanners are mostly in millimetres.
std::string doubt_of_unit(const Json& report) {
  constexpr double large_m = 20;
  const Json &surface = report.at("surface"), model = report.at("input").value("model", Json());
  if (!model.is_object() || model.value("scale", 0.0) != 1) return "";
  double longest_m = 0;
  for (std::size_t c = 0; c < 3; ++c)
    longest_m =
        std::max(longest_m, surface.at("upper_m")[c].get<double>() - surface.at("lower_m")[c].get<double>());
  return longest_m > large_m ? " (if the file is in millimetres: --scale 0.001)" : "";
}

}  // namespace

std::string text_of_report(const Json& report) {
  const Json& surface = report.at("surface");
  std::string text =
      fmt::format("{}\n  surface      {} vertices, {} triangles; {} m{}\n",
                  report.at("model").get<std::string>(), surface.at("vertices").get<int>(),
                  surface.at("triangles").get<int>(), size_text(surface), doubt_of_unit(report));
  if (report.contains("shells")) {
    const Json& shells = report.at("shells");
    text += fmt::format(
        "  shells       {} (stopped by {}), overshoot mean {:.3f} %, largest {:.3f} % of the diagonal; {} of "
        "{} triangles not covered\n",
        shells.at("count").get<int>(), shells.at("stopped_by").get<std::string>(),
        100 * shells.at("mean_overshoot").get<double>(), 100 * shells.at("max_overshoot").get<double>(),
        shells.at("triangles_uncovered").get<int>(), surface.at("triangles").get<int>());
  }
  if (report.contains("cage")) {
    const Json &cage = report.at("cage"), &certificate = report.at("certificate");
    text += fmt::format(
        "  cage         {} tets, {} nodes, dihedrals {:.1f} … {:.1f} degrees\n"
        "  certificate  {}: {} vertices outside, {} triangles cross, {} edges and {} vertices not manifold\n",
        cage.at("tets").get<int>(), cage.at("nodes").get<int>(), cage.at("min_dihedral_deg").get<double>(),
        cage.at("max_dihedral_deg").get<double>(),
        certificate.at("holds").get<bool>() ? "holds" : "does NOT hold",
        certificate.at("vertices_outside").get<int>(), certificate.at("triangles_crossing").get<int>(),
        certificate.at("nonmanifold_edges").get<int>(), certificate.at("nonmanifold_vertices").get<int>());
  }
  if (report.contains("contact")) {
    const Json& contact = report.at("contact");
    text +=
        contact.at("usable").get<bool>()
            ? fmt::format(
                  "  contact      {} samples; field of {} cells along the longest edge ({:.1f} MB), off by "
                  "{:.2g} m on 99 % of the surface, {:.2g} m at worst\n",
                  contact.at("samples").get<int>(), contact.at("cells").get<int>(),
                  contact.at("memory_mb").get<double>(), contact.at("error_p99_m").get<double>(),
                  contact.at("error_max_m").get<double>())
            : "  contact      by the cage\n";
  }
  if (report.contains("appearance")) {
    const Json& a = report.at("appearance");
    text +=
        fmt::format("  appearance   {} materials, {} images{}\n", a.at("materials").get<int>(),
                    a.at("images").size(), a.at("corner_colors").get<bool>() ? ", colors of vertices" : "");
  }
  for (const Json& sentence : report.at("mended"))
    text += fmt::format("  mended       {}\n", sentence.get<std::string>());
  for (const Json& sentence : report.at("warnings"))
    text += fmt::format("  warning      {}\n", sentence.get<std::string>());
  double seconds = 0;
  for (const Json& s : report.at("cpu_seconds")) seconds += s.get<double>();
  if (!report.at("cpu_seconds").empty())
    text += fmt::format("  cost         {:.2f} CPU s, {:.0f} MB\n", seconds,
                        report.at("peak_memory_mb").get<double>());
  return text;
}

}  // namespace limber::cli
