#include "limber/mesh.h"

#include <cmath>

#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "limber/detail/body/model_content.h"
#include "limber/detail/body/prepare.h"
#include "limber/detail/body/preview.h"
#include "limber/detail/body/work_folder.h"
#include "limber/detail/interface/arrays.h"
#include "limber/detail/interface/body.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

using detail::mesh_of;
using detail::surface_of;
using detail::working_for;

namespace {

void require_mesh(const Mesh& mesh, const std::string& what) { validate(surface_of(mesh), what); }

detail::PrepareSettings settings_of(const PrepareOptions& options) {
  const detail::PrepareSettings settings = detail::settings_of(options);
  detail::require_in_range(settings);
  return settings;
}

Cage cage_of(const TetMesh& mesh, const std::vector<int>& hull_from_tet) {
  return {detail::vertices_of(mesh.positions), detail::rows_of<std::array<int, 4>>(mesh.tets), hull_from_tet};
}

Certificate certificate_of(const meshing::Certificate& c) {
  return {c.holds(),           c.vertices_outside,     c.triangles_crossing,
          c.nonmanifold_edges, c.nonmanifold_vertices, c.inverted_tets,
          c.min_dihedral_deg,  c.max_dihedral_deg};
}

Binding binding_of(const ffd::Binding& b) {
  return {{b.tet_from_vertex.data(), b.tet_from_vertex.data() + b.tet_from_vertex.size()},
          detail::rows_of<std::array<double, 4>>(b.weights),
          b.outside,
          b.max_outside_distance_m};
}

ImportedMesh imported(const meshing::ImportedModel& model) {
  return {mesh_of(model.surface), model.mended, model.warnings};
}

Body body_of(const detail::BodySource& source, const detail::PrepareSettings& settings) {
  auto impl = std::make_shared<Body::Impl>();
  detail::WholeBody whole = detail::make_body(source, settings, [](const char*) {});
  impl->surface = mesh_of(whole.model.surface);
  for (const ConvexShell& shell : whole.made.decomposition.shells) impl->hulls.push_back(mesh_of(shell));
  impl->cage = cage_of(whole.made.cage.mesh, whole.made.cage.shell_from_tet);
  impl->cage.volume_ratio = whole.made.cage.volume_ratio;
  impl->cage.notes = whole.made.cage.notes;
  impl->certificate = certificate_of(whole.certificate);
  impl->binding = binding_of(whole.binding);
  impl->report = detail::report_of(whole, source, settings);
  for (const std::string& warning : detail::warnings_of(whole)) log::warn("{}: {}", source.model, warning);
  impl->bound = whole.binding;
  impl->rest = whole.made.cage.mesh;
  impl->made = {std::move(whole), source, settings};
  return Body(impl);
}

}  // namespace

std::vector<ConvexShell> detail::shells_of(const std::vector<Mesh>& hulls) {
  std::vector<ConvexShell> shells;
  for (const Mesh& hull : hulls)
    shells.push_back({points_of(hull.vertices), matrix_of<Triangles>(hull.faces)});
  return shells;
}

namespace {

void require_finite(const Vertices& nodes) {
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (const double x : nodes[n])
      if (!std::isfinite(x)) throw InputError(fmt::format("node {} has a coordinate that is not finite", n));
}

// No vertex may lie beyond a face by more than rounding.
void require_convex(const ConvexShell& hull, const std::string& what) {
  const Vec3 size = hull.vertices.colwise().maxCoeff() - hull.vertices.colwise().minCoeff();
  const double slack = 1e-5 * size.norm();
  for (Eigen::Index t = 0; t < hull.triangles.rows(); ++t) {
    const auto corner = [&](int k) { return Vec3(hull.vertices.row(hull.triangles(t, k)).transpose()); };
    const Vec3 out = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    if (((hull.vertices * out).array() - out.dot(corner(0))).maxCoeff() > slack)
      throw InputError(fmt::format(
          "{}: is not convex: a vertex lies beyond triangle {}; decompose() makes hulls", what, t));
  }
}

}  // namespace

ImportedMesh load_mesh(const std::filesystem::path& file, const ImportOptions& options,
                       const Context& context) {
  return working_for(context, [&] {
    return imported(meshing::import_model(file, {.scale = options.scale, .y_up = options.y_up}));
  });
}

ImportedMesh clean(const Mesh& mesh, const Context& context) {
  return working_for(context, [&] { return imported(meshing::clean(surface_of(mesh))); });
}

Decomposition decompose(const Mesh& mesh, const DecomposeOptions& options, const Context& context) {
  return working_for(context, [&] {
    const detail::PrepareSettings settings{.shells = options.max_convex_hull,
                                           .concavity = options.concavity,
                                           .threshold = options.threshold,
                                           .inflate = options.inflate,
                                           .exact = options.exact,
                                           .corners = options.max_hull_vertices,
                                           .only = {}};
    detail::require_in_range(settings);
    require_mesh(mesh, "mesh");
    const meshing::Decomposition made = detail::make_shells(surface_of(mesh), settings);
    Decomposition d;
    for (const ConvexShell& shell : made.shells) d.hulls.push_back(mesh_of(shell));
    d.neighbours = made.neighbours;
    d.stopped_by = made.stopped_by;
    d.mean_overshoot = made.mean_overshoot, d.max_overshoot = made.max_overshoot;
    d.vertices_uncovered = made.vertices_uncovered, d.triangles_uncovered = made.triangles_uncovered;
    return d;
  });
}

Cage build_cage(const Mesh& mesh, const std::vector<Mesh>& hulls, const CageOptions& options,
                const Context& context) {
  return working_for(context, [&] {
    const detail::PrepareSettings settings{.tets = options.tets, .mode = options.mode, .only = {}};
    detail::require_in_range(settings);
    require_mesh(mesh, "mesh");
    const std::vector<ConvexShell> shells = detail::shells_of(hulls);
    for (std::size_t h = 0; h < shells.size(); ++h) {
      validate(shells[h], fmt::format("hull {}", h));
      require_convex(shells[h], fmt::format("hull {}", h));
    }
    const meshing::Cage made = detail::make_cage(surface_of(mesh), shells, settings, std::nullopt);
    Cage cage = cage_of(made.mesh, made.shell_from_tet);
    cage.volume_ratio = made.volume_ratio;
    cage.notes = made.notes;
    return cage;
  });
}

Certificate certify(const Mesh& mesh, const Cage& cage, const Context& context) {
  return working_for(context, [&] {
    const SurfaceMesh surface = surface_of(mesh);
    const TetMesh tets = detail::tet_mesh_of(cage);
    validate(surface, "mesh");
    validate(tets, "cage");
    return certificate_of(meshing::certify(surface, tets));
  });
}

Binding bind(const Mesh& mesh, const Cage& cage, const Context& context) {
  return working_for(context,
                     [&] { return binding_of(ffd::bind(surface_of(mesh), detail::tet_mesh_of(cage))); });
}

Vertices deform(const Binding& binding, const Tetrahedra& tets, const Vertices& nodes) {
  require_finite(nodes);
  if (binding.weights.size() != binding.tet_from_vertex.size())
    throw InputError(fmt::format("binding: {} rows of weights and {} tets; there must be as many",
                                 binding.weights.size(), binding.tet_from_vertex.size()));
  Vertices moved(binding.weights.size());
  for (std::size_t v = 0; v < moved.size(); ++v) {
    const int t = binding.tet_from_vertex[v];
    if (t < 0 || std::size_t(t) >= tets.size())
      throw InputError(
          fmt::format("binding: vertex {} is bound to tet {}, and there are {}", v, t, tets.size()));
    for (std::size_t c = 0; c < 4; ++c) {
      const int n = tets[std::size_t(t)][c];
      if (n < 0 || std::size_t(n) >= nodes.size())
        throw InputError(fmt::format("tet {} has the node {}, and there are {}", t, n, nodes.size()));
      for (std::size_t axis = 0; axis < 3; ++axis)
        moved[v][axis] += binding.weights[v][c] * nodes[std::size_t(n)][axis];
    }
  }
  return moved;
}

Body::Body(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
const Mesh& Body::surface() const { return impl_->surface; }
const std::vector<Mesh>& Body::hulls() const { return impl_->hulls; }
const Cage& Body::cage() const { return impl_->cage; }
const Certificate& Body::certificate() const { return impl_->certificate; }
const Binding& Body::binding() const { return impl_->binding; }
std::string Body::report_json() const { return text_of(impl_->report, 2); }

Vertices Body::deform(const Vertices& nodes) const {
  if (nodes.size() != impl_->cage.nodes.size())
    throw InputError(
        fmt::format("{} nodes are given, and the cage has {}", nodes.size(), impl_->cage.nodes.size()));
  require_finite(nodes);
  Points moved;
  if (impl_->phong)
    ffd::deform_phong(impl_->bound, impl_->rest, impl_->gradients, detail::points_of(nodes), moved);
  else
    ffd::deform(impl_->bound, impl_->rest.tets, detail::points_of(nodes), moved);
  return detail::vertices_of(moved);
}

void Body::save(const std::filesystem::path& folder) const {
  make_folder(folder);
  if (!impl_->made && fs::equivalent(folder, impl_->folder)) return;
  const FolderLock lock(folder, FolderLock::alone);
  if (impl_->made) {
    detail::write_body(impl_->made->whole, impl_->made->source, impl_->made->settings, folder);
    return;
  }
  detail::clear_body(folder);
  for (const auto& [name, hash] : impl_->files) write_file(folder / name, read_file(impl_->folder / name));
  write_file(folder / "report.json", read_file(impl_->folder / "report.json"));
}

std::string Body::picture_png(const Context& context) const {
  return working_for(context, [&] {
    const detail::WorkFolder folder{{}};  // a temporary one
    save(folder.path());
    detail::write_picture(folder.path());
    return read_file(folder.path() / detail::picture_file);
  });
}

Body detail::body_of(const detail::PreparedBody& prepared, const std::filesystem::path& folder) {
  auto impl = std::make_shared<Body::Impl>();
  impl->surface = mesh_of(prepared.surface);
  if (prepared.report.shells)
    for (ConvexShell shell : read_obj_shells(folder / "shells.obj")) {
      shell.vertices.rowwise() += prepared.place_m.transpose();
      impl->hulls.push_back(mesh_of(shell));
    }
  impl->cage = cage_of(prepared.cage, prepared.shell_from_tet);
  const detail::BodyReport& report = prepared.report;
  const detail::BodyReport::Cage& told = report.cage.value();
  const detail::BodyReport::Certificate& c = report.certificate.value();
  impl->cage.volume_ratio = told.volume_ratio;
  impl->certificate = {
      c.holds, c.vertices_outside,    c.triangles_crossing, c.nonmanifold_edges, c.nonmanifold_vertices,
      0,       told.min_dihedral_deg, told.max_dihedral_deg};
  impl->binding = binding_of(prepared.binding);
  impl->report = report.json, impl->files = report.files;
  impl->folder = folder;
  impl->bound = prepared.binding;
  impl->rest = prepared.cage;
  impl->gradients = prepared.gradients;
  impl->phong = prepared.deformation == scenes::Deformation::phong;
  return Body(impl);
}

Body Body::load(const std::filesystem::path& folder) {
  return detail::body_of(detail::read_body(folder), folder);
}

Body prepare(const Mesh& mesh, const PrepareOptions& options, const Context& context) {
  return working_for(context, [&] {
    const detail::PrepareSettings settings = settings_of(options);
    const SurfaceMesh surface = surface_of(mesh);
    detail::BodySource source;
    source.model = "mesh";
    source.identity = {{"mesh_hash", hex(hash_of(surface))}};
    source.load = [surface] { return meshing::clean(surface); };
    return body_of(source, settings);
  });
}

Body prepare(const std::filesystem::path& model, const PrepareOptions& options, const ImportOptions& import,
             const Context& context) {
  return working_for(context, [&] {
    const detail::PrepareSettings settings = settings_of(options);
    ModelOptions read;
    static_cast<ImportOptions&>(read) = import;
    read.model = model;
    return body_of(detail::source_of(read, model), settings);
  });
}

}  // namespace limber
