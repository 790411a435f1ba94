#include "limber/detail/body/body_report.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/version.h"
#include "limber/detail/body/body.h"
#include "meshing/quality.h"
#include "meshing/shell_check.h"
#include "meshing/split_edges.h"

namespace limber::detail {

BodyReport body_report_of(Json json, const std::string& file) {
  constexpr const char* remedy = "limber did not write that";
  BodyReport report = read_fields<BodyReport>(json, file, remedy);
  report.json = std::move(json);
  return report;
}

BodyReport read_body_report(const fs::path& folder) {
  const fs::path file = folder / "report.json";
  return body_report_of(read_json(file), file.string());
}

void take_costs_out(Json& report) {
  report["cpu_seconds"] = report["peak_memory_mb_after"] = Json::object();
  report["peak_memory_mb"] = 0;
}

Json input_of(const Json& identity, const PrepareSettings& settings) {
  // What nobody chooses counts, too: a limber that has other values makes another body.
  const meshing::ContactShapeSettings c;
  const meshing::CageOptions cage;
  const meshing::SplitSettings split;
  return {{"model", identity},
          {"settings", json_of_fields(settings)},
          {"shells", "in float32"},
          {"cage",
           {{"min_dihedral_deg", cage.min_dihedral_deg},
            {"max_dihedral_deg", cage.max_dihedral_deg},
            {"gap", cage.gap}}},
          {"split", {{"share", split.share}, {"most_new_vertices", split.max_new_vertices}}},
          {"contact",
           {{"cells", c.cells},
            {"most_cells", c.max_cells},
            {"most_nodes", c.max_nodes},
            {"field_error", c.field_error},
            {"missed_depth", c.missed_depth},
            {"least_spacing", c.min_spacing},
            {"most_spacing", c.max_spacing},
            {"most_flat_spacing", c.max_flat_spacing},
            {"samples_a_square", c.samples_a_square},
            {"fewest_most_samples", c.fewest_most_samples},
            {"most_samples", c.max_samples},
            {"most_tips", c.max_tips}}}};
}

namespace {

BodyReport::Certificate told_of(const meshing::Certificate& c) {
  return {.holds = c.holds(),
          .vertices = c.vertices,
          .vertices_outside = c.vertices_outside,
          .triangles = c.triangles,
          .triangles_crossing = c.triangles_crossing,
          .nonmanifold_edges = c.nonmanifold_edges,
          .nonmanifold_vertices = c.nonmanifold_vertices,
          .min_dihedral_deg = c.min_dihedral_deg,
          .max_dihedral_deg = c.max_dihedral_deg,
          .surface_hash = hex(c.surface_hash),
          .cage_hash = hex(c.cage_hash)};
}

}  // namespace

Json facts_of_body(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells, const TetMesh& cage,
                   const ffd::Binding& binding, const ContactShape& contact,
                   const meshing::Certificate& certificate) {
  const Box box = bounding_box(surface.positions);
  const meshing::TetQuality quality =
      cage.tets.rows() > 0 ? meshing::measure_quality(cage) : meshing::TetQuality{};
  const meshing::FieldErrors errors =
      contact.samples.area_m2.size() > 0 ? meshing::field_errors(contact) : meshing::FieldErrors{};
  Json facts;
  facts["surface"] = {{"vertices", surface.positions.rows()},
                      {"triangles", surface.triangles.rows()},
                      {"area_m2", area(surface)},
                      {"volume_m3", volume(surface)},
                      {"lower_m", {box.lower.x(), box.lower.y(), box.lower.z()}},
                      {"upper_m", {box.upper.x(), box.upper.y(), box.upper.z()}}};
  if (!shells.empty())
    facts["shells"] = {
        {"count", shells.size()},
        {"in_float32", std::count_if(shells.begin(), shells.end(), meshing::holds_in_float32)}};
  facts["cage"] = {{"tets", cage.tets.rows()},
                   {"nodes", cage.positions.rows()},
                   {"volume_m3", volume(cage)},
                   {"min_dihedral_deg", quality.min_dihedral_deg},
                   {"max_dihedral_deg", quality.max_dihedral_deg},
                   {"median_min_dihedral_deg", quality.median_min_dihedral_deg}};
  facts["certificate"] = json_of_fields(told_of(certificate));
  facts["binding"] = {{"vertices_outside", binding.outside},
                      {"max_outside_distance_m", binding.max_outside_distance_m}};
  facts["contact"] = {{"usable", contact.usable},
                      {"samples", contact.samples.tet_from_sample.size()},
                      {"nodes", contact.field.values.size()},
                      {"cell_m", contact.field.cell_m},
                      {"unit_m", contact.field.unit_m},
                      {"error_p99_m", errors.p99_m},
                      {"error_max_m", errors.max_m},
                      {"memory_mb", double(contact.field.values.size() * sizeof(std::int16_t)) / 1e6}};
  return facts;
}

Json facts_of_appearance(const Appearance& a) {
  if (a.empty()) return {};
  Json images = Json::array();
  for (const ImageFile& image : a.images)
    images.push_back({{"name", image.name}, {"bytes", image.bytes.size()}});
  return {
      {"coordinates", a.uv.rows() > 0},
      {"corner_colors", a.colors.rows() > 0},
      {"materials", a.materials.size()},
      {"plain_triangles", std::count(a.material_from_triangle.begin(), a.material_from_triangle.end(), -1)},
      {"images", images}};
}

Json facts_of_making(const MadeBody& made, const PrepareSettings& settings) {
  const meshing::Decomposition& d = made.decomposition;
  const bool in_cells = settings.tets == 0;
  Json facts;
  if (!d.shells.empty())
    facts["shells"] = {{"stopped_by", d.stopped_by},
                       {"inflation", settings.inflate},
                       {"sum_of_volumes_m3", d.sum_of_hull_volumes},
                       {"mean_overshoot", d.mean_overshoot},
                       {"max_overshoot", d.max_overshoot},
                       {"vertices_uncovered", d.vertices_uncovered},
                       {"triangles_uncovered", d.triangles_uncovered},
                       {"neighbours", d.neighbours}};
  facts["cage"] = {{"mode", in_cells ? "cells" : settings.mode},
                   {"volume_ratio", made.cage.volume_ratio},
                   {"glued_share", made.cage.glued_share}};
  facts["contact"] = {{"cells", made.contact_report.cells},
                      {"characteristic_m", made.contact_report.characteristic_m},
                      {"open_share", made.contact_report.open_share}};
  return facts;
}

void keep_made(Json& told, const PrepareSettings& settings) {
  if (!settings.has_cage()) told.erase("cage"), told.erase("certificate");
  if (!settings.is_whole()) told.erase("binding"), told.erase("contact"), told.erase("appearance");
}

std::vector<std::string> warnings_of(const WholeBody& body) {
  const meshing::Certificate& certificate = body.certificate;
  std::vector<std::string> warnings = body.model.warnings;
  for (const auto* more : {&body.made.cage.notes, &body.made.contact_report.warnings})
    warnings.insert(warnings.end(), more->begin(), more->end());
  if (certificate.vertices_outside > 0)
    warnings.push_back(fmt::format("{} vertices lie outside the cage", certificate.vertices_outside));
  if (certificate.triangles_crossing > 0)
    warnings.push_back(
        fmt::format("{} triangles cross the boundary of the cage", certificate.triangles_crossing));
  return warnings;
}

Json report_of(const WholeBody& body, const BodySource& source, const PrepareSettings& settings) {
  Json report{{"version", version}, {"model", source.model}, {"input", input_of(source.identity, settings)}};
  report.update(meshing::to_json(body.model));
  report["warnings"] = warnings_of(body);
  report.update(facts_of_body(body.model.surface, body.made.decomposition.shells, body.made.cage.mesh,
                              body.binding, body.made.contact, body.certificate));
  if (!body.model.appearance.empty()) report["appearance"] = facts_of_appearance(body.model.appearance);
  const Json making = facts_of_making(body.made, settings);
  for (const auto& [table, figures] : making.items()) report[table].update(figures);
  keep_made(report, settings);
  return report;
}

}  // namespace limber::detail
