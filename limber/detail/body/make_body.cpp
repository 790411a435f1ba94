// A body made of its model, in memory: shells, cage, certificate, binding, contact.
#include "core/error.h"
#include "core/progress.h"
#include "limber/detail/body/body.h"
#include "meshing/split_edges.h"
#include "render/image_file.h"

namespace limber::detail {

namespace {

meshing::CageMode mode_of(const std::string& name) {
  if (name == "fast") return meshing::CageMode::fast;
  if (name == "paper") return meshing::CageMode::paper;
  if (name == "conform") return meshing::CageMode::conform;
  LIMBER_CHECK(name == "lattice", name);
  return meshing::CageMode::lattice;
}

bool is_grey(const render::Image8& image) {
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3)
    if (image.rgb[i] != image.rgb[i + 1] || image.rgb[i] != image.rgb[i + 2]) return false;
  return true;
}

}  // namespace

void look_into_images(Appearance& appearance, std::vector<std::string>& warnings) {
  std::int64_t pixels = 0;
  std::vector<bool> gone(appearance.images.size(), false);
  for (int i = 0; i < int(appearance.images.size()); ++i) {
    const ImageFile& file = appearance.images[std::size_t(i)];
    try {
      const render::Image8 image = render::decoded_image(file.bytes, file.name);
      if (pixels + std::int64_t(image.width) * image.height > render::max_image_pixels)
        throw InputError(fmt::format("\"{}\": the images of the model have more than {} pixels together",
                                     file.name, render::max_image_pixels));
      pixels += std::int64_t(image.width) * image.height;
      bool has_heights = false;
      for (SurfaceMaterial& material : appearance.materials)
        if (material.normal_image == i && is_grey(image)) material.normal_image = -1, has_heights = true;
      if (has_heights)
        warnings.push_back(
            fmt::format("image \"{}\" has heights, not normals: its relief is left out", file.name));
    } catch (const InputError& error) {
      warnings.push_back(fmt::format("image {}; what shows it is plain", error.what()));
      gone[std::size_t(i)] = true;
    }
  }
  appearance.drop_images(gone);
  appearance.drop_unused();
}

void make_model_of_body(meshing::ImportedModel& model, const PrepareSettings& settings) {
  look_into_images(model.appearance, model.warnings);
  // Exact parts, and shells without a cage, are of the model's own triangles: cutting edges makes more of the
  // same solid.
  if (settings.tets > 0 && !settings.exact && settings.has_cage()) {
    const Eigen::Index own_vertices = model.surface.positions.rows();
    CornerMap corners;
    model.surface =
        meshing::split_long_edges(model.surface, meshing::longest_edge(model.surface, settings.tets), {},
                                  model.appearance.empty() ? nullptr : &corners);
    model.appearance = carried(model.appearance, corners);
    if (const Eigen::Index more = model.surface.positions.rows() - own_vertices; more > 0)
      model.mended.push_back(
          fmt::format("cut long edges at {} places, so that its {} triangles bend as the cage does", more,
                      model.surface.triangles.rows()));
  }
  round_to_floats(model.appearance);
}

// What contact keeps is read again within these, metres.
void require_size(const SurfaceMesh& surface, const std::string& model) {
  constexpr double farthest_m = 1e8, least_m = 1e-20;
  const Box box = bounding_box(surface.positions);
  const double far = std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff()),
               size = box.size().maxCoeff();
  if (far > farthest_m || size < least_m)
    throw InputError(fmt::format(
        "{}: reaches {:.3g} m from the origin and is {:.3g} m long; a body is at least {:g} m long "
        "and no point of it farther than {:g} m from the origin; scale or move the model "
        "(--scale, or a scene's model.scale)",
        model, far, size, least_m, farthest_m));
}

double concavity_of(const SurfaceMesh& surface, const PrepareSettings& settings) {
  if (settings.threshold == 0) return settings.concavity;
  const Box box = bounding_box(surface.positions);
  return 0.5 * settings.threshold * (box.upper - box.lower).maxCoeff() / box.diagonal();
}

meshing::Decomposition make_shells(const SurfaceMesh& surface, const PrepareSettings& settings) {
  return meshing::decompose(surface, {.max_shells = settings.shells,
                                      .max_concavity = concavity_of(surface, settings),
                                      .max_vertices = settings.corners,
                                      .inflation = settings.inflate,
                                      .exact = settings.exact});
}

meshing::Cage make_cage(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells,
                        const PrepareSettings& settings, std::optional<TetMesh> made_cage) {
  if (!made_cage)
    return meshing::build_cage(surface, shells, {.mode = mode_of(settings.mode), .tets = settings.tets});
  meshing::Cage cage;
  cage.mesh = std::move(*made_cage);
  cage.shell_from_tet.assign(std::size_t(cage.mesh.tets.rows()), 0);
  return cage;
}

WholeBody make_body(const BodySource& source, const PrepareSettings& settings,
                    const std::function<void(const char*)>& end_stage) {
  Progress progress("prepare", 7);
  progress.update(0, "import");
  WholeBody body;
  body.model = source.load();
  SurfaceMesh& surface = body.model.surface;
  validate(surface, source.model);
  if (settings.is_whole()) require_size(surface, source.model);
  make_model_of_body(body.model, settings);
  end_stage("import");
  throw_if_stopped();

  MadeBody& made = body.made;
  if (settings.has_shells()) {
    progress.update(1, "decompose");
    made.decomposition = make_shells(surface, settings);
    end_stage("decompose");
    throw_if_stopped();
  }

  if (settings.has_cage()) {
    progress.update(2, "cage");
    made.cage = make_cage(surface, made.decomposition.shells, settings, source.made_cage());
    validate(made.cage.mesh, source.model + ": cage");
    end_stage("cage");
    progress.update(3, "certify");
    throw_if_stopped();

    body.certificate = meshing::certify(surface, made.cage.mesh);
    end_stage("certify");
    throw_if_stopped();
  }

  if (settings.is_whole()) {
    progress.update(4, "bind");
    body.binding = ffd::bind(surface, made.cage.mesh);
    end_stage("bind");
    throw_if_stopped();

    progress.update(5, "contact");
    made.contact = meshing::make_contact_shape(surface, made.cage.mesh, {}, &made.contact_report);
    end_stage("contact");
  }
  progress.update(7, "done");
  return body;
}

}  // namespace limber::detail
