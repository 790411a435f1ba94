#include "limber/detail/body/export.h"

#include <algorithm>
#include <regex>

#include "core/error.h"
#include "core/export_files.h"
#include "core/lock.h"
#include "core/mesh_files.h"
#include "core/temporary_files.h"
#include "ffd/binding_file.h"
#include "limber/detail/body/write_soft_body.h"
#include "meshing/quality.h"

namespace limber::detail {

namespace {

std::vector<VtuData> cage_data(const PreparedBody& body) {
  std::vector<double> smallest, largest, volumes;
  for (Eigen::Index t = 0; t < body.cage.tets.rows(); ++t) {
    const auto p = [&](int k) { return Vec3(body.cage.positions.row(body.cage.tets(t, k))); };
    const meshing::DihedralRange range = meshing::dihedral_range(p(0), p(1), p(2), p(3));
    smallest.push_back(range.min_deg), largest.push_back(range.max_deg);
    volumes.push_back(signed_volume(p(0), p(1), p(2), p(3)));
  }
  return {{"shell", body.shell_from_tet},
          {"min_dihedral_deg", smallest},
          {"max_dihedral_deg", largest},
          {"volume_m3", volumes}};
}

bool is_same_folder(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored);
}

std::vector<VtuData> binding_data(const ffd::Binding& b) {
  return {{"cage_tet",
           std::vector<int>(b.tet_from_vertex.data(), b.tet_from_vertex.data() + b.tet_from_vertex.size())},
          {"cage_weights", std::vector<double>(b.weights.data(), b.weights.data() + b.weights.size()), 4}};
}

constexpr std::string_view interior = "-interior";

// With a cage none of whose tets has all four nodes on the boundary.
PreparedBody with_interior_nodes(const PreparedBody& body) {
  PreparedBody mended = body;
  for (const int tet : tets_without_interior_vertex(body.cage.tets))
    mended.shell_from_tet.insert(mended.shell_from_tet.end(), 3, body.shell_from_tet[std::size_t(tet)]);
  mended.cage = with_interior_vertices(body.cage);
  return mended;
}

}  // namespace

std::vector<std::string> export_body(const PreparedBody& whole_body, const std::vector<std::string>& formats,
                                     double density_kg_m3, const fs::path& body_folder,
                                     const fs::path& folder) {
  std::vector<std::string> written;
  const auto name = [&](const std::string& file) {
    if (std::find(written.begin(), written.end(), file) == written.end()) written.push_back(file);
    return folder / file;
  };
  BodyMass whole;
  std::vector<ConvexShell> shells;
  std::optional<PreparedBody> mended;
  const auto weigh = [&] {
    if (whole.of.volume_m3 == 0) whole = mass_of(whole_body);
  };
  const auto write_rigid = [&](const char* file, auto write) {
    weigh();
    if (shells.empty()) {
      if (!whole_body.report.shells)
        throw InputError(fmt::format(
            "{}: has no convex shells to collide with, for its scene asks for none; write \"shells = 32\" "
            "under the body's cage and plan again, or limber prepare the model",
            body_folder.string()));
      shells = read_obj_shells(body_folder / "shells.obj");
      whole.hulls = mass_of_each(shells);
      for (const std::string& hull : write_hulls(whole_body, whole, shells, density_kg_m3, folder))
        name(hull);
      write_obj(name("surface.obj"), whole_body.surface);
    }
    write(name(file), whole_body, whole, density_kg_m3);
  };
  for (const std::string& wanted : formats) {
    const bool mend = wanted.ends_with(interior);
    const std::string format = wanted.substr(0, wanted.size() - (mend ? interior.size() : 0));
    if (mend && !mended) mended = with_interior_nodes(whole_body);
    const PreparedBody& body = mend ? *mended : whole_body;
    const auto of_cage = [&](const char* stem, const char* ending) {
      return fmt::format("{}{}{}", stem, mend ? interior : "", ending);
    };
    if (format == "vtu") {
      write_vtu(name(of_cage("cage", ".vtu")), body.cage.positions, body.cage.tets, {}, cage_data(body));
      if (!mend)
        write_vtu(name("surface.vtu"), body.surface.positions, body.surface.triangles,
                  binding_data(body.binding), {});
    } else if (format == "node") {
      write_node_ele(name(of_cage("cage", ".node")), body.cage, body.shell_from_tet);
      name(of_cage("cage", ".ele"));
    } else if (format == "interp") {
      write_veg(name("cage.veg"), body.cage, body.shell_from_tet);
      ffd::write_interp(name("surface.interp"), body.binding, body.cage.tets);
      write_obj(name("surface.obj"), body.surface);
    } else if (format == "vtk") {
      write_legacy_vtk(name(of_cage("cage", ".vtk")), body.cage);
    } else if (format == "inp") {
      write_inp(name(of_cage("cage", ".inp")), body.cage, body.shell_from_tet);
    } else if (format == "msh") {
      const std::string file = of_cage("cage", ".msh");
      // A body's folder has its own already.
      if (mend || !is_same_folder(folder, body_folder)) write_msh(name(file), body.cage, body.shell_from_tet);
    } else if (format == "urdf") {
      write_rigid("body.urdf", write_urdf);
    } else if (format == "sdf") {
      write_rigid("body.sdf", write_sdf);
    } else if (format == "usd" || format == "usd-omni") {
      weigh();
      const bool omni = format == "usd-omni";
      write_usd_body(name(of_cage(omni ? "body-omni" : "body", ".usda")), body, whole, density_kg_m3,
                     omni ? UsdNames::omniphysics : UsdNames::physics);
    } else if (format == "sofa") {
      weigh();
      write_legacy_vtk(name(of_cage("cage", ".vtk")), body.cage);
      write_obj(name("surface.obj"), body.surface);
      write_sofa_scene(name(of_cage("body", ".scn")), of_cage("cage", ".vtk"), whole, density_kg_m3);
    } else {
      LIMBER_CHECK(format == "mjcf", format);
      weigh();
      if (!mend) write_rigid("body.xml", write_mjcf);
      write_mjcf_flex(name(of_cage("flex", ".xml")), body, whole, density_kg_m3);
    }
  }
  return written;
}

void remove_exports(const fs::path& folder) {
  std::error_code ignored;
  for (const char* file : {"surface.vtu", "cage.veg", "surface.interp", "surface.obj", "mass.json",
                           "body.urdf", "body.sdf", "body.xml", "cage-interior.msh"})
    fs::remove(folder / file, ignored);
  for (const fs::path file : {"cage.vtu", "cage.node", "cage.ele", "cage.vtk", "cage.inp", "flex.xml",
                              "body.usda", "body-omni.usda", "body.scn"}) {
    fs::remove(folder / file, ignored);
    fs::remove(folder / (file.stem().string() + std::string(interior) + file.extension().string()), ignored);
  }
  static const std::regex hull(R"(hull_[0-9]{3,}\.obj)");
  std::vector<fs::path> hulls;
  for (const auto& entry : fs::directory_iterator(folder / "hulls", ignored))
    if (std::regex_match(entry.path().filename().string(), hull)) hulls.push_back(entry.path());
  for (const fs::path& file : hulls) fs::remove(file, ignored);
  fs::remove(folder / "hulls", ignored);  // where nothing of the user's is in it
}

ExportedBody export_body_folder(const BodyExportOptions& options) {
  const PreparedBody body = read_body(options.folder);
  const fs::path out = options.out.value_or(options.folder);
  if (fs::exists(out / "report.json") && !is_same_folder(out, options.folder))
    throw InputError(fmt::format("{}: is the folder of another body; name another with -o", out.string()));
  make_folder(out);
  const FolderLock lock(out, FolderLock::alone);
  remove_abandoned(out);
  return {out, export_body(body, options.formats, options.density_kg_m3, options.folder, out)};
}

}  // namespace limber::detail
