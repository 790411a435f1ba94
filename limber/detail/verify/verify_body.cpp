#include "limber/detail/verify/verify_body.h"

#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "meshing/cage.h"
#include "meshing/contact_check.h"
#include "meshing/shell_check.h"
#include "meshing/surface_tree.h"
#include "render/image_file.h"

namespace limber::detail {

namespace {

constexpr double rounding = 1e-9;           // of the size, or of a figure
constexpr double rounding_of_sums = 1e-15;  // of the coordinates of places that are added up

// The first figure of `facts` that the report has otherwise, "" where there is none.
std::string first_wrong(const Json& facts, const Json& report) {
  if (facts.is_object()) {
    for (const auto& [key, value] : facts.items()) {
      if (!report.is_object() || !report.contains(key)) return key;
      if (const std::string within = first_wrong(value, report.at(key)); !within.empty())
        return within == "." ? key : key + "." + within;
    }
    return "";
  }
  if (facts.is_array()) {
    if (!report.is_array() || report.size() != facts.size()) return ".";
    for (std::size_t i = 0; i < facts.size(); ++i)
      if (!first_wrong(facts[i], report[i]).empty()) return ".";
    return "";
  }
  if (!facts.is_number_float()) return facts == report ? "" : ".";
  if (!report.is_number()) return ".";
  const double here = facts.get<double>(), there = report.get<double>();
  return std::abs(here - there) <= rounding * std::abs(here) ? "" : ".";
}

bool in_a_tet(const TetMesh& cage, const Vec3& p) {
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
    const auto corner = [&](int k) { return Vec3(cage.positions.row(cage.tets(t, k))); };
    if (meshing::tet_holds(corner(0), corner(1), corner(2), corner(3), p)) return true;
  }
  return false;
}

void check_cage(const std::string& name, const PreparedBody& body, const PrepareSettings& settings,
                const meshing::Certificate& c, Promises& table) {
  // Those of the other two modes do not promise to enclose anything.
  const bool encloses = settings.tets == 0 || settings.mode == "lattice" || settings.mode == "fast";
  const auto row = [&](const char* what, bool kept, const std::string& value) {
    encloses ? table.row(name + what, kept, value) : table.measured(name + what, value);
  };
  row(": no vertex outside the cage", c.vertices_outside == 0,
      fmt::format("{} of {}", c.vertices_outside, c.vertices));
  row(": no triangle crosses its boundary", c.triangles_crossing == 0,
      fmt::format("{} of {}", c.triangles_crossing, c.triangles));
  row(": boundary of the cage is a manifold", c.nonmanifold_edges + c.nonmanifold_vertices == 0,
      fmt::format("{} edges and {} vertices are not", c.nonmanifold_edges, c.nonmanifold_vertices));
  const BodyReport::Certificate& written = body.report.certificate.value();
  table.row(name + ": certificate is of these meshes",
            written.surface_hash == hex(c.surface_hash) && written.cage_hash == hex(c.cage_hash) &&
                written.holds == c.holds(),
            fmt::format("dihedrals {:.1f} … {:.1f} degrees", c.min_dihedral_deg, c.max_dihedral_deg));
}

void check_shells(const std::string& name, const PreparedBody& body, const PrepareSettings& settings,
                  const std::vector<ConvexShell>& shells, const fs::path& folder, Promises& table) {
  if (!settings.has_shells()) {
    const bool none_named = std::all_of(body.shell_from_tet.begin(), body.shell_from_tet.end(),
                                        [](int shell) { return shell == 0; });
    const bool none_here = !fs::exists(folder / "shells.obj");
    table.row(name + ": no tet of the cage is of a shell, for there are none", none_named && none_here,
              none_here ? "" : "shells.obj is there, and nothing that limber wrote");
    return;
  }
  const meshing::ShellCheck c = meshing::check_shells(shells, body.surface);
  table.row(name + ": shells are convex", c.not_convex == 0 && !shells.empty(),
            fmt::format("{} of {} are not", c.not_convex, shells.size()));
  const BodyReport::Shells& said = body.report.shells.value();
  table.row(
      name + ": shells cover the surface",
      c.vertices_uncovered <= said.vertices_uncovered && c.triangles_uncovered <= said.triangles_uncovered,
      fmt::format("{} vertices and {} triangles not, {} by the report", c.vertices_uncovered,
                  c.triangles_uncovered, said.triangles_uncovered));
  const auto is = [&](double told, double value) { return std::abs(told - value) <= rounding * value; };
  // Of inflated shells the report tells of those before.
  if (settings.inflate == 0)
    table.row(name + ": shells stand off the surface by what is said",
              is(said.mean_overshoot, c.mean_overshoot) && is(said.max_overshoot, c.max_overshoot),
              fmt::format("mean {:.3f} %, largest {:.3f} % of the diagonal", 100 * c.mean_overshoot,
                          100 * c.max_overshoot));
  if (!settings.has_cage()) return;
  bool labelled = body.shell_from_tet.size() == std::size_t(body.cage.tets.rows());
  if (settings.tets == 0)  // in cells
    labelled = labelled && std::count(body.shell_from_tet.begin(), body.shell_from_tet.end(), 0) ==
                               std::ptrdiff_t(body.shell_from_tet.size());
  else if (settings.mode != "paper")
    labelled = labelled && body.shell_from_tet == meshing::label_tets(body.cage, shells);
  for (const int shell : body.shell_from_tet) labelled = labelled && shell >= 0 && shell < int(shells.size());
  table.row(name + ": each tet of the cage is of its shell", labelled, "");
}

void check_binding(const std::string& name, const PreparedBody& body, Promises& table) {
  const ffd::Binding& binding = body.binding;
  // As far as places so far from the origin can be told apart.
  const Box box = bounding_box(body.surface.positions);
  const double slack =
      rounding * box.diagonal() +
      rounding_of_sums * std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff());
  std::int64_t outside = 0, wrong = 0;
  double most = 0;
  for (Eigen::Index v = 0; v < body.surface.positions.rows(); ++v) {
    const Vec3 p = body.surface.positions.row(v);
    Vec3 there = Vec3::Zero();
    for (int k = 0; k < 4; ++k)
      there += binding.weights(v, k) *
               Vec3(body.cage.positions.row(body.cage.tets(binding.tet_from_vertex[v], k)));
    const bool inside = binding.weights.row(v).minCoeff() >= -rounding;
    const double off = (there - p).norm();
    if (inside && off <= slack) continue;
    // What is in no tet hangs on the nearest, as far as a weight of −1 allows.
    if (const bool clamped = binding.weights.row(v).minCoeff() < -1 + 1e-6;
        !inside && (clamped || off <= slack) && !in_a_tet(body.cage, p))
      ++outside;
    else
      ++wrong, most = std::max(most, off);
  }
  table.row(name + ": binding brings back the surface at rest, each vertex in its tet", wrong == 0,
            wrong == 0 ? fmt::format("{} vertices outside the cage", outside)
                       : fmt::format("{} of {} vertices not, off by up to {:.2g} m", wrong,
                                     body.surface.positions.rows(), most));
  const ffd::Binding again = ffd::bind(body.surface, body.cage);
  table.row(name + ": bound again: the same binding",
            again.tet_from_vertex == binding.tet_from_vertex && again.weights == binding.weights &&
                again.outside == binding.outside &&
                again.farthest_outside_vertex == binding.farthest_outside_vertex &&
                again.max_outside_distance_m == binding.max_outside_distance_m,
            "");
}

void check_contact(const std::string& name, const PreparedBody& body, Promises& table) {
  if (!body.contact.usable) return;  // which making it again must come to, too
  const meshing::ContactCheck c = meshing::check_contact_shape(body.contact, body.surface, body.cage);
  table.row(name + ": distances for contact are the surface's", c.field_fault.empty(),
            c.field_fault.empty()
                ? fmt::format("{} nodes measured, off by at most {:.2f} cells", c.nodes, c.field_cells)
                : c.field_fault);
  table.row(name + ": samples for contact lie on the surface, and stand for all of it",
            c.sample_fault.empty(),
            c.sample_fault.empty() ? fmt::format("{} samples", body.contact.samples.area_m2.size())
                                   : c.sample_fault);
}

// A key of the report that limber does not write there, "" where there is none.
std::string odd_key(const BodyReport& report, const Json& facts, const Json& making, std::size_t files) {
  const std::set<std::string> known{
      "version",       "model",    "input", "found",       "left",
      "mended",        "warnings", "files", "cpu_seconds", "peak_memory_mb_after",
      "peak_memory_mb"};
  for (const auto& [table, value] : report.json.items()) {
    const bool of_facts = facts.contains(table), of_making = making.contains(table);
    if (!of_facts && !of_making && !known.contains(table)) return table;
    if (!of_facts && !of_making) continue;
    for (const auto& [key, figure] : value.items())
      if (!facts.value(table, Json()).contains(key) && !making.value(table, Json()).contains(key))
        return table + "." + key;
  }
  return report.files.size() == files ? "" : "files";
}

void check_images(const std::string& name, const Appearance& appearance, Promises& table) {
  std::string fault;
  for (const ImageFile& image : appearance.images) try {
      render::decoded_image(image.bytes, image.name);
    } catch (const InputError& error) {
      fault = error.what();
    }
  table.row(name + ": its images can be shown", fault.empty(),
            fault.empty() ? fmt::format("{} images", appearance.images.size()) : fault);
}

bool near(double a, double b, double size) { return std::abs(a - b) <= rounding * size; }

template <class A, class B>
bool near(const Eigen::DenseBase<A>& a, const Eigen::DenseBase<B>& b, double size) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         (a.size() == 0 || (a.derived() - b.derived()).cwiseAbs().maxCoeff() <= rounding * size);
}

// But for the rounding of other machines: prepare may use libm.
bool same_shells(const std::vector<ConvexShell>& a, const std::vector<ConvexShell>& b, double size) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](const ConvexShell& one, const ConvexShell& other) {
                      return one.triangles.rows() == other.triangles.rows() &&
                             one.triangles == other.triangles && near(one.vertices, other.vertices, size);
                    });
}

bool same_contact(const ContactShape& a, const ContactShape& b, double size) {
  if (a.usable != b.usable) return false;
  if (!a.usable) return true;
  const DistanceField &f = a.field, &g = b.field;
  const auto next_to = [](int one, int other) { return std::abs(one - other) <= 1; };
  return f.nodes == g.nodes && near(f.lower_m, g.lower_m, size) && near(f.cell_m, g.cell_m, f.cell_m) &&
         near(f.unit_m, g.unit_m, f.unit_m) &&
         std::equal(f.values.begin(), f.values.end(), g.values.begin(), g.values.end(), next_to) &&
         near(a.samples.positions_m, b.samples.positions_m, size) &&
         near(a.samples.area_m2, b.samples.area_m2, size * size);
}

// Decomposing costs more than all else of a body, but of small ones.
constexpr Eigen::Index small_triangles = 20'000;

bool tells_of_bare_parts(const BodyReport::Shells& shells) {
  return shells.vertices_uncovered > 0 || shells.triangles_uncovered > 0;
}

// What a report tells of shells that are not made again: what follows from them and the settings, and what
// only their making tells, as it is told. Throws InputError where it could not be so.
meshing::Decomposition decomposition_by_report(const std::vector<ConvexShell>& shells,
                                               const PrepareSettings& settings, double concavity,
                                               const BodyReport::Shells& said) {
  meshing::Decomposition d;
  d.shells = shells;
  for (const ConvexShell& shell : shells)
    d.sum_of_hull_volumes += volume(SurfaceMesh{shell.vertices, shell.triangles});
  d.mean_overshoot = said.mean_overshoot, d.max_overshoot = said.max_overshoot;
  d.vertices_uncovered = said.vertices_uncovered;
  d.triangles_uncovered = said.triangles_uncovered;
  const int count = int(shells.size());
  if (settings.exact)
    d.stopped_by = "exact";
  else if (concavity > 0 && d.max_overshoot <= concavity)
    d.stopped_by = "concavity";
  else if (concavity > 0 && count == settings.shells && said.stopped_by == "gain")
    d.stopped_by = "gain";  // the first cuts, made before the bound was looked at
  else
    d.stopped_by = count < settings.shells ? "gain" : "count";
  if (!said.neighbours) throw InputError("its neighbours are not told");
  d.neighbours = *said.neighbours;
  for (std::size_t i = 0; i < d.neighbours.size(); ++i)
    if (const auto& [one, other] = d.neighbours[i];
        one < 0 || one >= other || other >= count || (i > 0 && d.neighbours[i - 1] >= d.neighbours[i]))
      throw InputError("its neighbours are none");
  return d;
}

struct MadeContact {
  SurfaceMesh surface;
  TetMesh cage;
  ContactShape shape;
  meshing::ContactShapeReport report;
};

// Those made last are kept: a process that verifies many folders of the same bodies makes each once.
std::shared_ptr<const MadeContact> contact_made_again(const SurfaceMesh& surface, const TetMesh& cage) {
  constexpr std::size_t most = 8;
  static std::mutex mutex;
  static std::deque<std::shared_ptr<const MadeContact>> kept;
  const auto same = [](const auto& a, const auto& b) { return a.rows() == b.rows() && a == b; };
  {
    const std::lock_guard lock(mutex);
    for (const auto& made : kept)
      if (same(made->surface.positions, surface.positions) &&
          same(made->surface.triangles, surface.triangles) && same(made->cage.positions, cage.positions) &&
          same(made->cage.tets, cage.tets))
        return made;
  }
  auto made = std::make_shared<MadeContact>(MadeContact{surface, cage, {}, {}});
  made->shape = meshing::make_contact_shape(surface, cage, {}, &made->report);
  const std::lock_guard lock(mutex);
  kept.push_back(made);
  if (kept.size() > most) kept.pop_front();
  return made;
}

// Each made once more from those before it, as the folder has them: what a report tells of their making, null
// where there is no telling.
Json check_making(const std::string& name, const PreparedBody& body, const PrepareSettings& settings,
                  const std::vector<ConvexShell>& shells, const std::optional<TetMesh>& made_cage,
                  bool shells_too, Promises& table) try {
  const double size = bounding_box(body.surface.positions).diagonal();
  MadeBody made;
  if (settings.has_shells()) {
    const BodyReport::Shells& said = body.report.shells.value();
    // Where cutting stopped before, only cutting tells that it did.
    const bool are_as_many_as_asked =
        !settings.exact && int(shells.size()) == settings.shells && said.stopped_by == "count";
    if (shells_too || body.surface.triangles.rows() <= small_triangles || tells_of_bare_parts(said) ||
        !are_as_many_as_asked) {
      throw_if_stopped();
      made.decomposition = make_shells(body.surface, settings);
      table.row(name + ": shells made again from the surface: the same",
                same_shells(shells, made.decomposition.shells, size), "");
    } else {
      made.decomposition =
          decomposition_by_report(shells, settings, concavity_of(body.surface, settings), said);
      table.measured(name + ": shells", "checked, but not made again; --remake does that");
    }
  }

  throw_if_stopped();
  if (!settings.has_cage()) return facts_of_making(made, settings);
  const bool in_cells = settings.tets == 0;
  made.cage = make_cage(body.surface, shells, settings,
                        in_cells ? std::optional(made_cage.value_or(body.cage)) : std::nullopt);
  const TetMesh& cage = made.cage.mesh;
  table.row(name + ": cage made again from surface and shells: the same",
            cage.tets.rows() == body.cage.tets.rows() && cage.tets == body.cage.tets &&
                near(cage.positions, body.cage.positions, size) &&
                made.cage.shell_from_tet == body.shell_from_tet,
            "");

  throw_if_stopped();
  if (!settings.is_whole()) return facts_of_making(made, settings);
  const std::shared_ptr<const MadeContact> contact = contact_made_again(body.surface, body.cage);
  made.contact_report = contact->report;
  table.row(name + ": contact made again from surface and cage: the same",
            same_contact(body.contact, contact->shape, size), "");
  return facts_of_making(made, settings);
} catch (const InputError& error) {
  table.row(name + ": made again from the surface", false, error.what());
  return {};
}

// Those that prepare would take; nothing where the report's are none.
std::optional<PrepareSettings> settings_told_of(const PreparedBody& body) {
  const PrepareSettings& s = body.report.input.settings;
  const auto share = [](double x) { return x >= 0 && x <= 1; };
  const std::set<std::string> modes{"lattice", "fast", "paper", "conform"}, parts{"", "shells", "cage"};
  const bool good = s.shells >= (s.mode == "paper" ? 1 : 0) && s.shells <= 1000 && share(s.concavity) &&
                    share(s.threshold) && share(s.inflate) && s.corners >= 8 && s.corners <= 10'000 &&
                    (s.tets == 0 || (s.tets >= 24 && s.tets <= 200'000)) && modes.contains(s.mode) &&
                    parts.contains(s.only);
  return good ? std::optional(s) : std::nullopt;
}

}  // namespace

void check_body(const std::string& name, const PreparedBody& body, const fs::path& folder,
                const std::optional<TetMesh>& made_cage, bool remake, Promises& table) {
  const std::optional<PrepareSettings> told = settings_told_of(body);
  PrepareSettings settings = told.value_or(PrepareSettings{});
  if (!body.report.shells) settings.shells = 0;
  std::vector<ConvexShell> shells;
  if (settings.has_shells()) shells = read_obj_shells(folder / "shells.obj");
  for (const ConvexShell& shell : shells) validate(shell, (folder / "shells.obj").string());
  meshing::Certificate certificate;
  if (settings.has_cage()) {
    certificate = meshing::certify(body.surface, body.cage);
    check_cage(name, body, settings, certificate, table);
  }
  check_shells(name, body, settings, shells, folder, table);
  if (settings.is_whole()) {
    check_binding(name, body, table);
    check_contact(name, body, table);
  } else {
    table.measured(name + ": is a part",
                   fmt::format("made with --only {}, no body to plan with", settings.only));
  }
  table.row(name + ": its settings are some that limber takes", told.has_value(), "");
  Json making = check_making(name, body, settings, shells, made_cage, remake, table);
  Json facts = facts_of_body(body.surface, shells, body.cage, body.binding, body.contact, certificate);
  if (!body.appearance.empty()) {
    facts["appearance"] = facts_of_appearance(body.appearance);
    check_images(name, body.appearance, table);
  }
  keep_made(facts, settings);
  if (!making.is_null()) keep_made(making, settings);
  std::string wrong = first_wrong(facts, body.report.json);
  if (wrong.empty() && !making.is_null()) wrong = first_wrong(making, body.report.json);
  if (wrong.empty() && !making.is_null())
    wrong = odd_key(body.report, facts, making, files_of_body(settings, body.appearance).size());
  table.row(name + ": report.json tells of these files", wrong.empty(),
            wrong.empty() ? "" : wrong + " is another's");
}

void check_origin(const std::string& name, const Origin& origin, bool must_be_here, Promises& table) {
  table.row(name + ": made as the scene says", origin.placed_so, "");
  if (origin.same_surface || must_be_here)
    table.row(name + ": surface is the scene's model", origin.same_surface.value_or(false),
              origin.same_surface ? "" : "its model file is not here, or is another");
  else
    table.measured(name + ": surface",
                   "its model file is not here, or has changed since, so it is not compared");
  if (origin.appearance == Appearing::plain) return;
  if (origin.appearance != Appearing::not_here || must_be_here)
    table.row(name + ": colors and images are the model's", origin.appearance == Appearing::same,
              origin.appearance == Appearing::not_here
                  ? "its model file, or one that it names, is not here, or is another"
                  : "");
  else
    table.measured(name + ": colors and images", "their files are not here, or have changed since");
}

void check_model(const std::string& name, const PreparedBody& body, const fs::path& model, Promises& table) {
  Origin origin;
  std::string why;
  try {
    origin = origin_of_model(body, model);
  } catch (const InputError& error) {
    if (!fs::is_regular_file(model)) throw;
    why = error.what();
  }
  const bool same = origin.placed_so && origin.same_surface.value_or(false);
  if (why.empty())
    why = origin.same_surface ? "read again from " + model.string()
                              : model.string() + " holds something else than the body was made from";
  table.row(name + ": surface is the model's", same, why);
  if (origin.appearance != Appearing::plain)
    table.row(name + ": colors and images are the model's", origin.appearance == Appearing::same, "");
}

void check_goal_cage(GoalCage found, bool must_be_here, Promises& table) {
  if (found == GoalCage::none_asked) return;
  if (found == GoalCage::not_here && !must_be_here)
    table.measured("goal.shape.cage", "its file is not here to be compared with");
  else
    table.row("the goal's shape is goal.shape.cage", found == GoalCage::same,
              found == GoalCage::not_here ? "its file is not here" : "");
}

}  // namespace limber::detail
