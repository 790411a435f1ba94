// Colors and coordinates of images stay where they were on the surface, whatever is mended and cut.
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>

#include "core/error.h"
#include "meshing/import.h"
#include "meshing/split_edges.h"

namespace limber::meshing {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const std::string png = "\x89PNG\r\n\x1a\n and so on", jpeg = "\xff\xd8\xff and so on";

class Looks : public testing::Test {
 protected:
  Looks() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder = fs::path(testing::TempDir()) / "limber_looks" / test->name();
    fs::remove_all(folder);
    make_folder(folder);
  }
  void write(const std::string& name, const std::string& content) const {
    write_file(folder / name, content);
  }
  ImportedModel imported(const std::string& name) const {
    return import_model(folder / name, {.count_self_intersections = false});
  }
  fs::path folder;
};

// Face 2 axis + side of the unit cube shows its own place: its two other coordinates, away from other faces'.
Eigen::Vector2d uv_on_face(const Vec3& p, int axis, int side) {
  return {p[(axis + 1) % 3] + 10 * axis, p[(axis + 2) % 3] + 10 * side};
}
Vec3 color_at(const Vec3& p) { return Vec3(0.25, 0.25, 0.25) + 0.5 * p; }

// The cube in quadrangles with corners of their own, sRGB colors of color_at, some turned inside out, one
// twice; and on an edge between two faces a flat triangle, which shows something else altogether.
std::string spoiled_cube() {
  std::string obj = "mtllib cube.mtl\n", faces;
  int vertices = 0, uvs = 0;
  const auto add = [&](const Vec3& p, const Eigen::Vector2d& uv) {
    const auto srgb = [](double c) {
      return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
    };
    const Vec3 c = color_at(p);
    obj += fmt::format("v {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\nvt {:.17g} {:.17g}\n", p.x(),
                       p.y(), p.z(), srgb(c.x()), srgb(c.y()), srgb(c.z()), uv.x(), uv.y());
    return fmt::format(" {}/{}", ++vertices, ++uvs);
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      std::vector<Vec3> corners;
      for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        Vec3 p;
        p[axis] = side, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
        corners.push_back(p);
      }
      // One with a corner more in its upper edge, against which lies the flat triangle of another face.
      if (axis == 2 && side == 1) corners.insert(corners.begin() + 2, Vec3(1, 0.25, 1));
      if ((side == 0) != (axis == 1)) std::reverse(corners.begin(), corners.end());
      faces += fmt::format("usemtl {}\nf", axis == 0 ? "painted" : "other");
      std::string face;
      for (const Vec3& p : corners) face += add(p, uv_on_face(p, axis, side));
      faces += face + "\n";
      if (axis == 1 && side == 0) faces += "f" + face + "\n";
    }
  std::string flat;
  for (const double y : {1., 0.25, 0.}) flat += add(Vec3(1, y, 1), {77, 77});
  return obj + faces + "f" + flat + "\n";
}

// The law: each corner has what its place on its face has. Colors, where there are some.
void expect_in_place(const SurfaceMesh& mesh, const Appearance& a, double rounding = 1e-12) {
  validate(a, mesh.triangles.rows(), "appearance");
  ASSERT_EQ(a.uv.rows(), 3 * mesh.triangles.rows());
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const auto at = [&](int c) { return Vec3(mesh.positions.row(mesh.triangles(t, c))); };
    const Vec3 outward = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
    Eigen::Index axis = 0;
    outward.cwiseAbs().maxCoeff(&axis);
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector2d uv = a.uv.row(3 * t + c),
                            wanted = uv_on_face(at(c), int(axis), outward[axis] > 0);
      EXPECT_LT((uv - wanted).norm(), rounding)
          << "triangle " << t << " corner " << c << ": " << uv.transpose();
      if (a.colors.rows() == 0) continue;
      EXPECT_LT((Vec3(a.colors.row(3 * t + c)) - color_at(at(c))).norm(), 1e-9) << t;
    }
    EXPECT_EQ(a.materials[std::size_t(a.material_from_triangle[std::size_t(t)])].name,
              axis == 0 ? "painted" : "other");
  }
}

TEST_F(Looks, StayInPlaceWhateverIsMendedAndCut) {
  write("cube.obj", spoiled_cube());
  write("cube.mtl",
        "newmtl painted\nKd 1 1 1\nmap_Kd one.png\nnewmtl other\nKd 1 0 0\nmap_Kd -clamp on two.jpg\n");
  write("one.png", png), write("two.jpg", jpeg);
  const ImportedModel model = imported("cube.obj");
  EXPECT_TRUE(model.left.closed());
  EXPECT_THAT(model.mended, Contains(HasSubstr("merged into a neighbour")));
  EXPECT_THAT(model.mended, Contains(HasSubstr("welded")));
  EXPECT_THAT(model.mended, Contains(HasSubstr("duplicate")));
  EXPECT_THAT(model.mended, Contains(HasSubstr("turned")));
  EXPECT_EQ(model.appearance.colors.rows(), 3 * model.surface.triangles.rows());
  expect_in_place(model.surface, model.appearance);
  ASSERT_EQ(model.appearance.images.size(), 2u);
  EXPECT_EQ(model.appearance.images[0].bytes, png);
  EXPECT_EQ(model.appearance.images[1].bytes, jpeg);

  CornerMap corners;
  const SurfaceMesh cut = split_long_edges(model.surface, 0.2, {}, &corners);
  ASSERT_GT(cut.triangles.rows(), 200);
  expect_in_place(cut, carried(model.appearance, corners));
}

// The cube as assimp writes it.
TEST_F(Looks, AreTheSameFromEveryFormatThatHasThem) {
  std::string obj = "mtllib cube.mtl\n", faces;
  int corners = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      std::vector<Vec3> square;
      for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        Vec3 p;
        p[axis] = side, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
        square.push_back(p);
      }
      if (side == 0) std::reverse(square.begin(), square.end());
      faces += fmt::format("usemtl {}\nf", axis == 0 ? "painted" : "other");
      for (const Vec3& p : square) {
        const Eigen::Vector2d uv = uv_on_face(p, axis, side);
        obj += fmt::format("v {} {} {}\nvt {} {}\n", p.x(), p.y(), p.z(), uv.x(), uv.y());
        faces += fmt::format(" {0}/{0}", ++corners);
      }
      faces += "\n";
    }
  write("cube.obj", obj + faces);
  write("cube.mtl", "newmtl painted\nKd 1 1 1\nmap_Kd one.png\nnewmtl other\nKd 1 0 0.2\n");
  write("one.png", png);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile((folder / "cube.obj").string(), 0);
  ASSERT_TRUE(scene) << importer.GetErrorString();
  for (const auto& [format, name] : {std::pair("gltf2", "cube.gltf"),
                                     {"glb2", "cube.glb"},
                                     {"fbxa", "cube.fbx"},  // assimp 5.2.5 cannot read its own binary ones
                                     {"collada", "cube.dae"}}) {
    SCOPED_TRACE(name);
    Assimp::Exporter exporter;
    ASSERT_EQ(exporter.Export(scene, format, (folder / name).string()), aiReturn_SUCCESS)
        << exporter.GetErrorString();
    const ImportedModel model = imported(name);
    EXPECT_TRUE(model.left.closed());
    expect_in_place(model.surface, model.appearance, 1e-5);
    ASSERT_EQ(model.appearance.images.size(), 1u);
    EXPECT_EQ(model.appearance.images[0].bytes, png);
    for (const SurfaceMaterial& m : model.appearance.materials)
      EXPECT_EQ(m.image, m.name == "painted" ? 0 : -1) << m.name;
  }
}

TEST_F(Looks, ColorsOfAPlyAreThoseOfItsVertices) {
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n"
      "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 188 188 188\n"
      "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  write("tet.ply", ply);
  const ImportedModel model = imported("tet.ply");
  const Points wanted{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5029, 0.5029, 0.5029}};  // IEC 61966-2-1 of 188
  ASSERT_EQ(model.appearance.colors.rows(), 12);
  for (Eigen::Index t = 0; t < 4; ++t)
    for (int c = 0; c < 3; ++c)
      EXPECT_LT((model.appearance.colors.row(3 * t + c) - wanted.row(model.surface.triangles(t, c))).norm(),
                1e-4);
  EXPECT_EQ(model.appearance.uv.rows(), 0);

  for (std::size_t at; (at = ply.find("255 0 0")) != ply.npos || (at = ply.find("0 255 0")) != ply.npos ||
                       (at = ply.find("0 0 255")) != ply.npos;)
    ply.replace(at, 7, "188 188 188");
  write("grey.ply", ply);
  EXPECT_TRUE(imported("grey.ply").appearance.empty()) << "one grey for all says nothing";
}

std::string square(const std::string& material_line) {
  return "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n" +
         material_line + "f 1/1 2/2 3/3 4/4\n";
}

TEST_F(Looks, WhatCannotBeHadIsASentenceAndPlain) {
  write("square.obj", square("usemtl a\n"));
  const auto with_image = [&](const std::string& path) {
    write("m.mtl", "newmtl a\nKd 1 1 1\nmap_Kd " + path + "\n");
    return imported("square.obj");
  };
  const auto expect_plain = [&](const std::string& path, const std::string& sentence) {
    const ImportedModel model = with_image(path);
    EXPECT_TRUE(model.appearance.empty()) << path;
    EXPECT_THAT(model.warnings, Contains(HasSubstr(sentence))) << path;
  };
  expect_plain("missing.png", "\"missing.png\" is not there");
  expect_plain("../../../../../../etc/passwd", "leads out of the model's folder");
  expect_plain("..", "leads out of the model's folder");
  expect_plain("/dev/zero", "\"/dev/zero\" is not there");
  write("text.png", "no image");
  expect_plain("text.png", "is neither PNG nor JPEG");
  make_folder(folder / "folder.png");
  expect_plain("folder.png", "folder.png");
  fs::create_symlink("/etc/passwd", folder / "link.png");
  expect_plain("link.png", "leads out of the model's folder");
  write_file(folder / "huge.png", png);
  fs::resize_file(folder / "huge.png", (64 << 20) + 1);
  expect_plain("huge.png", "huge.png");

  write("good one.png", png);
  make_folder(folder / "deep");
  write("deep/one.png", png);
  for (const char* path : {"good one.png", "deep\\one.png", "deep/../deep/one.png", "C:\\work\\good one.png",
                           "/home/someone/good one.png", "-s 1 1 1 -clamp on good one.png", "good%20one.png"})
    EXPECT_EQ(with_image(path).appearance.images.size(), 1u) << path;

  fs::remove(folder / "m.mtl");
  const ImportedModel model = imported("square.obj");
  EXPECT_TRUE(model.appearance.empty());
  EXPECT_THAT(model.warnings, Contains(HasSubstr("\"m.mtl\" is not there")));
}

// Triangle i shows an image of its own.
TEST_F(Looks, ImagesAreAsManyAsCanBeShownEachItsOwn) {
  const std::string deep = std::string(40, 'd') + "/" + std::string(40, 'e');
  fs::create_directories(folder / deep);
  std::string obj = "mtllib m.mtl\nvt 0 0\nvt 1 0\nvt 0 1\n", mtl;
  for (int i = 0; i < 70; ++i) {
    const std::string image = fmt::format("{}/{}{}.png", deep, i, std::string(100, 'f'));
    write(image, png + std::to_string(i));
    obj += fmt::format("v {0} 0 0\nv {0}.5 0 0\nv {0} 1 0\nusemtl m{0}\nf -3/1 -2/2 -1/3\n", i);
    mtl += fmt::format("newmtl m{}\nmap_Kd {}\n", i, image);
  }
  write("many.obj", obj), write("m.mtl", mtl);
  const ImportedModel model = imported("many.obj");
  EXPECT_THAT(model.warnings, Contains(HasSubstr("64 images are shown, and 6 more are left out")));
  const Appearance& a = model.appearance;
  ASSERT_EQ(a.images.size(), 64u);
  for (int t = 0; t < 70; ++t) {
    const int m = a.material_from_triangle[std::size_t(t)];
    ASSERT_EQ(m, t < 64 ? t : -1);
    if (m < 0) continue;
    EXPECT_EQ(a.images[std::size_t(a.materials[std::size_t(m)].image)].bytes, png + std::to_string(t));
  }
}

TEST_F(Looks, FacesWithoutCoordinatesArePlain) {
  write("m.mtl", "newmtl a\nKd 1 1 1\nmap_Kd i.png\nnewmtl b\nKd 0 1 0\n");
  write("i.png", png);
  write("square.obj", square("usemtl a\n") + "v 0 0 1\nf 1/9 2/2 5/3\nf 1 5 4\nusemtl b\nf 2 3 5\n");
  const ImportedModel model = imported("square.obj");
  EXPECT_EQ(model.appearance.material_from_triangle, (std::vector<int>{0, 0, -1, -1, 1}));
  EXPECT_THAT(model.warnings, Contains(HasSubstr("1 corners of faces name texture coordinates")));
  EXPECT_THAT(model.warnings, Contains(HasSubstr("2 of 5 triangles should show an image")));
  EXPECT_LT((model.appearance.materials[1].color - Vec3(0, 1, 0)).norm(), 1e-12);
}

// Whatever the files say, what comes in keeps the laws of an Appearance.
TEST_F(Looks, NoCutOrChangedFileCrashes) {
  const std::string obj = spoiled_cube(),
                    mtl = "newmtl painted\nKd 1 1 1\nmap_Kd one.png\nnewmtl other\nKd 1 0 0\nnorm two.jpg\n";
  write("one.png", png), write("two.jpg", jpeg);
  const auto survives = [&](const std::string& of_obj, const std::string& of_mtl) {
    write("cube.obj", of_obj), write("cube.mtl", of_mtl);
    try {
      const ImportedModel model = imported("cube.obj");
      validate(model.appearance, model.appearance.empty() ? 0 : model.surface.triangles.rows(), "cut");
    } catch (const InputError&) {
    }
  };
  for (std::size_t size = 0; size < obj.size(); size += 211) survives(obj.substr(0, size), mtl);
  for (std::size_t size = 0; size < mtl.size(); size += 3) survives(obj, mtl.substr(0, size));
  for (std::size_t at = 20; at < obj.size(); at += 307)
    for (const char* other : {"-", "/", "9", "x", "\n", "usemtl \n"})
      survives(std::string(obj).replace(at, 1, other), mtl);
}

}  // namespace
}  // namespace limber::meshing
