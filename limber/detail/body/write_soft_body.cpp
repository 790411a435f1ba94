#include "limber/detail/body/write_soft_body.h"

#include <fmt/format.h>

namespace limber::detail {

namespace {

// The nearest float32: USD's points are those.
std::string text_of_points(const Points& points) {
  std::string text = "[";
  for (Eigen::Index v = 0; v < points.rows(); ++v)
    fmt::format_to(std::back_inserter(text), "{}({}, {}, {})", v ? ", " : "", float(points(v, 0)),
                   float(points(v, 1)), float(points(v, 2)));
  return text + "]";
}

template <class Rows>
std::string text_of_rows(const Rows& rows) {
  std::string text = "[";
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    text += r ? ", (" : "(";
    for (Eigen::Index c = 0; c < rows.cols(); ++c)
      fmt::format_to(std::back_inserter(text), "{}{}", c ? ", " : "", rows(r, c));
    text += ")";
  }
  return text + "]";
}

std::string text_of_list(const Triangles& triangles) {
  std::string text = "[";
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    fmt::format_to(std::back_inserter(text), "{}{}, {}, {}", t ? ", " : "", triangles(t, 0), triangles(t, 1),
                   triangles(t, 2));
  return text + "]";
}

}  // namespace

void write_usd_body(const fs::path& path, const PreparedBody& body, const BodyMass& whole, double density,
                    UsdNames names) {
  const bool omni = names == UsdNames::omniphysics;
  const char *api = omni ? "OmniPhysics" : "Physics", *prefix = omni ? "omniphysics" : "physics";
  const char* material_api = omni ? "OmniPhysicsBaseMaterialAPI" : "PhysicsMaterialAPI";
  const std::string cage = text_of_points(body.cage.positions), tets = text_of_rows(body.cage.tets);
  const std::string surface = text_of_points(body.surface.positions);
  const auto pose = [&](const std::string& points) {
    return fmt::format(
        "        point3f[] deformablePose:default:{0}:points = {1}\n"
        "        uniform token[] deformablePose:default:{0}:purposes = [\"bindPose\"]\n",
        prefix, points);
  };
  std::string counts = "[3";
  for (Eigen::Index t = 1; t < body.surface.triangles.rows(); ++t) counts += ", 3";
  std::string usda = fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"body\"\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n"
      "    upAxis = \"Z\"\n)\n\n"
      "def Xform \"body\" (\n    prepend apiSchemas = [\"{0}DeformableBodyAPI\", \"MaterialBindingAPI\"]\n)\n"
      "{{\n    float {1}:mass = {2}\n    rel material:binding:physics = </body/material> (\n"
      "        bindMaterialAs = \"weakerThanDescendants\"\n    )\n\n",
      api, prefix, density * whole.of.volume_m3);
  // Faces of a tet whose volume is positive, as all are here, look outwards as a right-handed one's do.
  usda += fmt::format(
      "    def TetMesh \"cage\" (\n        prepend apiSchemas = [\"{0}VolumeDeformableSimAPI\", "
      "\"{0}DeformablePoseAPI:default\", \"PhysicsCollisionAPI\"]\n    )\n    {{\n"
      "        uniform token purpose = \"guide\"\n        point3f[] points = {2}\n"
      "        int4[] tetVertexIndices = {3}\n        int3[] surfaceFaceVertexIndices = {4}\n"
      "        point3f[] {1}:restShapePoints = {2}\n        int4[] {1}:restTetVtxIndices = {3}\n{5}    "
      "}}\n\n",
      api, prefix, cage, tets, text_of_rows(boundary_triangles(body.cage.tets)), pose(cage));
  usda += fmt::format(
      "    def Mesh \"surface\" (\n        prepend apiSchemas = [\"{0}DeformablePoseAPI:default\"]\n    )\n"
      "    {{\n        uniform token subdivisionScheme = \"none\"\n        point3f[] points = {1}\n"
      "        int[] faceVertexCounts = {2}]\n        int[] faceVertexIndices = {3}\n{4}    }}\n\n",
      api, surface, counts, text_of_list(body.surface.triangles), pose(surface));
  usda += fmt::format(
      "    def Material \"material\" (\n        prepend apiSchemas = [\"{0}\", "
      "\"{1}DeformableMaterialAPI\"]\n"
      "    )\n    {{\n        float {2}:density = {3}\n        float {2}:youngsModulus = {4}\n"
      "        float {2}:poissonsRatio = {5}\n    }}\n}}\n",
      material_api, api, prefix, density, soft_youngs_modulus_pa, soft_poissons_ratio);
  write_file(path, usda);
}

void write_sofa_scene(const fs::path& path, const std::string& cage_file, const BodyMass& whole,
                      double density) {
  std::string plugins;
  for (const char* name :
       {"Sofa.Component.IO.Mesh", "Sofa.Component.LinearSolver.Iterative", "Sofa.Component.Mapping.Linear",
        "Sofa.Component.Mass", "Sofa.Component.ODESolver.Backward",
        "Sofa.Component.SolidMechanics.FEM.Elastic", "Sofa.Component.StateContainer",
        "Sofa.Component.Topology.Container.Dynamic", "Sofa.GL.Component.Rendering3D"})
    plugins += fmt::format("  <RequiredPlugin name=\"{}\"/>\n", name);
  write_file(
      path,
      fmt::format(
          "<?xml version=\"1.0\"?>\n<!-- No material is known here: set youngModulus and poissonRatio. "
          "-->\n<Node name=\"root\" dt=\"0.01\" gravity=\"0 0 -9.81\">\n{0}  <DefaultAnimationLoop/>\n"
          "  <Node name=\"body\">\n    <EulerImplicitSolver rayleighMass=\"0.1\" "
          "rayleighStiffness=\"0.1\"/>\n    <CGLinearSolver iterations=\"100\" tolerance=\"1e-9\" "
          "threshold=\"1e-9\"/>\n    <MeshVTKLoader name=\"loader\" filename=\"{4}\"/>\n"
          "    <TetrahedronSetTopologyContainer src=\"@loader\"/>\n    <MechanicalObject/>\n"
          "    <UniformMass totalMass=\"{1}\"/>\n    <TetrahedronFEMForceField youngModulus=\"{2}\" "
          "poissonRatio=\"{3}\" method=\"large\"/>\n    <Node name=\"surface\">\n"
          "      <MeshOBJLoader name=\"loader\" filename=\"surface.obj\"/>\n"
          "      <OglModel src=\"@loader\"/>\n      <BarycentricMapping/>\n    </Node>\n  </Node>\n"
          "</Node>\n",
          plugins, density * whole.of.volume_m3, soft_youngs_modulus_pa, soft_poissons_ratio, cage_file));
}

}  // namespace limber::detail
