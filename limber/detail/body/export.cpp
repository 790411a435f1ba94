#include "limber/detail/body/export.h"

#include <algorithm>
#include <regex>

#include "core/error.h"
#include "core/export_files.h"
#include "core/mesh_files.h"
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

std::vector<VtuData> binding_data(const ffd::Binding& b) {
  return {{"cage_tet",
           std::vector<int>(b.tet_from_vertex.data(), b.tet_from_vertex.data() + b.tet_from_vertex.size())},
          {"cage_weights", std::vector<double>(b.weights.data(), b.weights.data() + b.weights.size()), 4}};
}

}  // namespace

std::vector<std::string> export_body(const PreparedBody& body, const std::vector<std::string>& formats,
                                     double density_kg_m3, const fs::path& folder) {
  std::vector<std::string> written;
  const auto name = [&](const std::string& file) {
    if (std::find(written.begin(), written.end(), file) == written.end()) written.push_back(file);
    return folder / file;
  };
  BodyMass whole;
  std::vector<ConvexShell> shells;
  const auto weigh = [&] {
    if (whole.of.volume_m3 == 0) whole = mass_of(body);
  };
  const auto write_rigid = [&](const char* file, auto write) {
    weigh();
    if (shells.empty()) {
      shells = read_obj_shells(folder / "shells.obj");
      for (const std::string& hull : write_hulls(body, whole, shells, density_kg_m3, folder)) name(hull);
      write_obj(name("surface.obj"), body.surface);
    }
    write(name(file), body, whole, int(shells.size()), density_kg_m3);
  };
  for (const std::string& format : formats) {
    if (format == "vtu") {
      write_vtu(name("cage.vtu"), body.cage.positions, body.cage.tets, {}, cage_data(body));
      write_vtu(name("surface.vtu"), body.surface.positions, body.surface.triangles,
                binding_data(body.binding), {});
    } else if (format == "node") {
      write_node_ele(name("cage.node"), body.cage, body.shell_from_tet);
      name("cage.ele");
    } else if (format == "interp") {
      write_veg(name("cage.veg"), body.cage, body.shell_from_tet);
      ffd::write_interp(name("surface.interp"), body.binding, body.cage.tets);
      write_obj(name("surface.obj"), body.surface);
    } else if (format == "vtk") {
      write_legacy_vtk(name("cage.vtk"), body.cage);
    } else if (format == "vtk-interior") {
      write_legacy_vtk(name("cage-interior.vtk"), with_interior_vertices(body.cage));
    } else if (format == "inp") {
      write_inp(name("cage.inp"), body.cage, body.shell_from_tet);
    } else if (format == "urdf") {
      write_rigid("body.urdf", write_urdf);
    } else if (format == "sdf") {
      write_rigid("body.sdf", write_sdf);
    } else if (format == "usd" || format == "usd-omni") {
      weigh();
      const bool omni = format == "usd-omni";
      write_usd_body(name(omni ? "body-omni.usda" : "body.usda"), body, whole, density_kg_m3,
                     omni ? UsdNames::omniphysics : UsdNames::physics);
    } else if (format == "sofa") {
      weigh();
      write_legacy_vtk(name("cage.vtk"), body.cage);
      write_obj(name("surface.obj"), body.surface);
      write_sofa_scene(name("body.scn"), whole, density_kg_m3);
    } else {
      LIMBER_CHECK(format == "mjcf", format);
      write_rigid("body.xml", write_mjcf);
      write_mjcf_flex(name("flex.xml"), body, whole, density_kg_m3);
    }
  }
  return written;
}

void remove_exports(const fs::path& folder) {
  std::error_code ignored;
  for (const char* file :
       {"cage.vtu", "surface.vtu", "cage.node", "cage.ele", "cage.veg", "surface.interp", "surface.obj",
        "cage.vtk", "cage-interior.vtk", "cage.inp", "mass.json", "body.urdf", "body.sdf", "body.xml",
        "flex.xml", "body.usda", "body-omni.usda", "body.scn"})
    fs::remove(folder / file, ignored);
  static const std::regex hull(R"(hull_[0-9]{3,}\.obj)");
  std::vector<fs::path> hulls;
  for (const auto& entry : fs::directory_iterator(folder / "hulls", ignored))
    if (std::regex_match(entry.path().filename().string(), hull)) hulls.push_back(entry.path());
  for (const fs::path& file : hulls) fs::remove(file, ignored);
  fs::remove(folder / "hulls", ignored);  // where nothing of the user's is in it
}

}  // namespace limber::detail
