// A model's own colors from its file to films and exports, and what verify makes of a folder in which they
// are not the model's.
#include <gmock/gmock.h>

#include "core/appearance_file.h"
#include "core/hash.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "meshing/import.h"
#include "render/png_file.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

using testing::Contains;
using testing::HasSubstr;

// A painted crate falls onto a bench of vertex colors; a box is as ever.
constexpr const char* falling = R"(name = "painted"
[world]
bounds_m = [[0, 0, 0], [2, 2, 2]]
gravity_m_s2 = [0, 0, -9.81]
[[bodies]]
name = "crate"
role = "robot"
model = { file = "crate.obj", scale = 0.5 }
cage = { tets = 60, shells = 1 }
material = { youngs_modulus_pa = 5e4, density_kg_m3 = 100, damping_ratio = 0.4 }
pose = { position_m = [0.75, 0.75, 0.7] }
[[bodies]]
name = "bench"
role = "obstacle"
kind = "rigid"
model = { file = "bench.ply" }
cage = { tets = 60, shells = 1 }
pose = { position_m = [0.5, 0.5, 0.2] }
[[bodies]]
name = "box"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [0.2, 0.2, 0.2], triangle_m = 0.2 } }
cage = { cells = [1, 1, 1] }
pose = { position_m = [1.8, 1.8, 0.5] }
[film]
size_px = [160, 120]
frames_per_second = 10
)";

// Each face of the unit cube has its own part of an image of three by two: a seam at every edge.
Eigen::Vector2d uv_on_face(const Vec3& p, int axis, int side) {
  return {(axis + 0.1 + 0.8 * p[(axis + 1) % 3]) / 3, (side + 0.1 + 0.8 * p[(axis + 2) % 3]) / 2};
}

class Painted_slow : public Program {
 protected:
  void SetUp() override {
    std::string obj = "mtllib crate.mtl\nusemtl crate\n", faces;
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
        faces += "f";
        for (const Vec3& p : square) {
          const Eigen::Vector2d uv = uv_on_face(p, axis, side);
          obj += fmt::format("v {} {} {}\nvt {:.17g} {:.17g}\n", p.x(), p.y(), p.z(), uv.x(), uv.y());
          faces += fmt::format(" {0}/{0}", ++corners);
        }
        faces += "\n";
      }
    write("crate.obj", obj + faces);
    write("crate.mtl", "newmtl crate\nKd 1 1 1\nmap_Kd crate.png\n");
    write("crate.png", render::png_bytes(image(0)));
    std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 6\n"
        "property list uchar int vertex_indices\nend_header\n";
    for (int v = 0; v < 8; ++v)
      ply += fmt::format("{} {} {} {} {} 90\n", v & 1, v >> 1 & 1, 0.2 * (v >> 2), v & 1 ? 250 : 20,
                         v & 2 ? 200 : 60);
    write("bench.ply", ply + "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n");
  }
  static render::Image8 image(int shift) {
    render::Image8 made{48, 32, {}};
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 48; ++x)
        made.rgb.insert(made.rgb.end(), {std::uint8_t(80 + 80 * (x / 16)), std::uint8_t(y < 16 ? 60 : 220),
                                         std::uint8_t((x / 4 + y / 4 + shift) % 2 ? 40 : 200)});
    return made;
  }
  void write(const std::string& name, const std::string& bytes) const { write_file(folder / name, bytes); }
  void simulate(const std::string& name = "out", const std::string& text = falling) const {
    const Result result =
        limber_program({"simulate", scene(text), "-o", out(name), "--duration", "0.5", "-q"});
    ASSERT_EQ(result.code, exit_done) << result.err;
  }
  Result render(std::vector<std::string> more, const std::string& name = "out") const {
    more.insert(more.begin(), {"render", out(name)});
    return limber_program(more);
  }
  fs::path in(const std::string& path) const { return fs::path(out()) / path; }
  Json report(const std::string& body) const { return read_json(in("bodies") / body / "report.json"); }
};

// Every corner of the mesh lies on the crate, turned by `crate_from`, and has that place's coordinates.
void expect_coordinates_of_the_crate(const SurfaceMesh& mesh, const Appearance& a,
                                     const std::function<Vec3(const Vec3&)>& crate_from) {
  ASSERT_EQ(a.uv.rows(), 3 * mesh.triangles.rows());
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const auto at = [&](int c) { return crate_from(mesh.positions.row(mesh.triangles(t, c))); };
    const Vec3 outward = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
    Eigen::Index axis = 0;
    outward.cwiseAbs().maxCoeff(&axis);
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector2d uv = a.uv.row(3 * t + c),
                            wanted = uv_on_face(at(c), int(axis), outward[axis] > 0);
      EXPECT_LT((uv - wanted).norm(), 2e-6) << t << ' ' << c << ": " << uv.transpose();
    }
  }
}

TEST_F(Painted_slow, FoldersHoldWhatTheModelsShow) {
  simulate();
  const PreparedBody crate = read_body(in("bodies/crate"));
  EXPECT_GT(crate.surface.triangles.rows(), 100) << "long edges are cut";
  expect_coordinates_of_the_crate(crate.surface, crate.appearance,
                                  [](const Vec3& p) { return Vec3((p - Vec3(0.75, 0.75, 0.7)) / 0.5); });
  ASSERT_EQ(crate.appearance.images.size(), 1u);
  EXPECT_EQ(crate.appearance.images[0].bytes, read_file(folder / "crate.png"));
  EXPECT_EQ(report("crate").at("files").size(), 7u);

  // By the vertices of the file: red from 20 to 250 along x, green from 60 to 200 along y.
  const PreparedBody bench = read_body(in("bodies/bench"));
  ASSERT_EQ(bench.appearance.colors.rows(), 3 * bench.surface.triangles.rows());
  const auto linear = [](double level) { return linear_from_srgb(level / 255); };
  for (Eigen::Index i = 0; i < bench.appearance.colors.rows(); ++i) {
    const Vec3 p = bench.surface.positions.row(bench.surface.triangles(i / 3, i % 3)),
               share = p - Vec3(0.5, 0.5, 0.2);
    EXPECT_NEAR(bench.appearance.colors(i, 0), linear(20) + share.x() * (linear(250) - linear(20)), 1e-6);
    EXPECT_NEAR(bench.appearance.colors(i, 1), linear(60) + share.y() * (linear(200) - linear(60)), 1e-6);
  }
  EXPECT_EQ(report("box").at("files").size(), 5u) << "a body without colors has no file more";
  EXPECT_FALSE(fs::exists(in("bodies/box") / appearance_file));
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);
}

TEST_F(Painted_slow, FramesShowItWhereTheSceneGivesNoColorAndAreTheSameForThreadsAndChunks) {
  simulate();
  ASSERT_EQ(render({"--threads", "1", "--as", "one"}).code, exit_done);
  ASSERT_EQ(render({"--threads", "2", "--as", "two", "--frames", "3-5"}).code, exit_done);
  ASSERT_EQ(render({"--threads", "2", "--as", "two"}).code, exit_done);
  for (const fs::directory_entry& frame : fs::directory_iterator(in("frames-one")))
    EXPECT_EQ(read_file(frame.path()), read_file(in("frames-two") / frame.path().filename())) << frame.path();
  const auto first_frame = [&](const std::string& name, const std::vector<std::string>& sets) {
    std::vector<std::string> words{"--frames", "0", "--as", name};
    for (const std::string& set : sets) words.insert(words.end(), {"--set", set});
    EXPECT_EQ(render(words).code, exit_done);
    return render::read_png(in("frames-" + name) / "0000.png");
  };
  const render::Image8 own = render::read_png(in("frames-one") / "0000.png"),
                       red = first_frame("red", {"bodies.crate.color=#c0392b"}),
                       plain = first_frame("plain", {"bodies.crate.texture=false"}),
                       both =
                           first_frame("both", {"bodies.crate.color=#c0392b", "bodies.crate.texture=true"});
  EXPECT_EQ(red, plain) << "the usual color of a robot";
  EXPECT_EQ(both, own);
  EXPECT_NE(own, plain);
  // Where the plain crate is red, both kinds of squares are seen: those with more blue than red, and those
  // with much less blue than green.
  int blue = 0, green = 0;
  for (std::size_t i = 0; i < own.rgb.size(); i += 3) {
    if (plain.rgb[i] < plain.rgb[i + 1] + 60) continue;
    blue += own.rgb[i + 2] > own.rgb[i];
    green += own.rgb[i + 1] > own.rgb[i + 2] + 40;
  }
  EXPECT_GT(blue, 20);
  EXPECT_GT(green, 20);
}

TEST_F(Painted_slow, StillsShowItBeforeAnyPlan) {
  const auto still = [&](const std::string& texture) {
    const std::string file = out("still.png");
    const Result result = limber_program(
        {"render", scene(falling), "--still", "-o", file, "--set", "bodies.crate.texture=" + texture});
    EXPECT_EQ(result.code, exit_done) << result.err;
    return render::read_png(file);
  };
  const render::Image8 plain = still("false");
  EXPECT_NE(still("true"), plain);
  write("crate.png", "no image");
  EXPECT_EQ(still("true"), plain) << "what cannot be shown is left out";
}

TEST_F(Painted_slow, ExportsBringItBack) {
  simulate();
  ASSERT_EQ(limber_program({"export", out(), "--format", "gltf,usd", "--frames", "0-3"}).code, exit_done);
  const meshing::ImportedModel back =
      meshing::import_model(in("export/motion.glb"), {.count_self_intersections = false});
  // The crate's own triangles among all that is in the file.
  const PreparedBody crate = read_body(in("bodies/crate"));
  const auto ours = [](const Vec3& p) {
    return Vec3((Vec3(p.x(), -p.z(), p.y()) - Vec3(0.75, 0.75, 0.7)) / 0.5);
  };
  SurfaceMesh mesh = back.surface;
  Appearance a = back.appearance;
  std::vector<int> rows, triangles;
  for (int t = 0; t < mesh.triangles.rows(); ++t) {
    const int m = a.material_from_triangle[std::size_t(t)];
    if (m < 0 || a.materials[std::size_t(m)].image < 0) continue;
    triangles.push_back(t);
    for (int c = 0; c < 3; ++c) rows.push_back(3 * t + c);
  }
  EXPECT_EQ(std::ssize(triangles), crate.surface.triangles.rows());
  mesh.triangles = Triangles(mesh.triangles(triangles, Eigen::all));
  a.uv = Uvs(a.uv(rows, Eigen::all));
  expect_coordinates_of_the_crate(mesh, a, ours);
  ASSERT_EQ(a.images.size(), 1u);
  EXPECT_EQ(a.images[0].bytes, read_file(folder / "crate.png"));
  EXPECT_GT(a.colors.rows(), 0) << "those of the bench";

  EXPECT_EQ(read_file(in("export/textures/crate-image-0.png")), read_file(folder / "crate.png"));
  const std::string usd = read_file(in("export/motion.usda"));
  EXPECT_THAT(usd, HasSubstr("texCoord2f[] primvars:st"));
  EXPECT_THAT(usd, HasSubstr("asset inputs:file = @./textures/crate-image-0.png@"));
  // Where the scene gives a color, exports do, too.
  std::string text = falling;
  text.insert(text.find("pose = { position_m = [0.75"), "color = \"#112233\"\n");
  simulate("plain", text);
  ASSERT_EQ(limber_program({"export", out("plain"), "--format", "usd", "--frames", "0"}).code, exit_done);
  EXPECT_FALSE(fs::exists(fs::path(out("plain")) / "export" / "textures"));
}

// A model of limber's own has no file: its looks are made with it.
TEST_F(Painted_slow, AMadeBallKeepsItsLooksFromTheSceneToExports) {
  std::string text = falling;
  const std::string crate = R"(model = { file = "crate.obj", scale = 0.5 })",
                    bench = R"(model = { file = "bench.ply" })",
                    ball = R"(model = { made = "beach_ball", height_m = 0.5 })";
  text.replace(text.find(crate), crate.size(), ball);
  text.replace(text.find(bench), bench.size(),
               "model = { box = { size_m = [1, 1, 0.2], triangle_m = 0.5 } }");
  simulate("out", text);
  const PreparedBody prepared = read_body(in("bodies/crate"));
  ASSERT_EQ(prepared.appearance.images.size(), 2u);
  const Result verified = limber_program({"verify", out(), "--scene", scene(text), "--json"});
  EXPECT_EQ(verified.code, exit_done);
  EXPECT_THAT(verified.out, HasSubstr("crate: colors and images are the model's"));
  const auto first_frame = [&](const std::string& name, const std::string& set) {
    EXPECT_EQ(render({"--frames", "0", "--as", name, "--set", set}).code, exit_done);
    return render::read_png(in("frames-" + name) / "0000.png");
  };
  EXPECT_NE(first_frame("own", "bodies.crate.texture=true"),
            first_frame("plain", "bodies.crate.texture=false"));

  ASSERT_EQ(limber_program({"export", out(), "--format", "gltf,usd", "--frames", "0-3"}).code, exit_done);
  const meshing::ImportedModel back =
      meshing::import_model(in("export/motion.glb"), {.count_self_intersections = false});
  ASSERT_EQ(back.appearance.images.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.appearance.images[i].bytes, prepared.appearance.images[i].bytes);
    EXPECT_EQ(read_file(in(fmt::format("export/textures/crate-image-{}.png", i))),
              prepared.appearance.images[i].bytes);
  }
  const int status =
      std::system((std::string(limber_source_dir) + "/tools/check_exports '" + out() + "'").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_TRUE(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 77) << WEXITSTATUS(status);
}

TEST_F(Painted_slow, OtherProgramsReadersAgree) {
  simulate();
  ASSERT_EQ(limber_program({"export", out(), "--format", "gltf,usd,pc2", "--frames", "0-3"}).code, exit_done);
  const std::string glb = read_file(in("export/motion.glb"));
  for (const char* word : {"TEXCOORD_0", "COLOR_0", "baseColorTexture", "image/png"})
    EXPECT_THAT(glb, HasSubstr(word));
  const int status =
      std::system((std::string(limber_source_dir) + "/tools/check_exports '" + out() + "'").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77)
    GTEST_SKIP() << "neither Khronos' validator (tools/install-node-tools) nor Blender is installed";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Painted_slow, BodiesAreMadeAnewWhenAFileOfTheModelChanges) {
  simulate();
  const auto remade = [&] {
    const Json before = report("crate");
    simulate();
    return report("crate") != before;
  };
  EXPECT_FALSE(remade());
  write("crate.png", render::png_bytes(image(1)));
  EXPECT_TRUE(remade());
  EXPECT_EQ(read_file(in("bodies/crate/image-0.png")), read_file(folder / "crate.png"));
  fs::remove(folder / "crate.png");
  EXPECT_TRUE(remade());
  EXPECT_FALSE(fs::exists(in("bodies/crate/image-0.png")));
  EXPECT_THAT(report("crate").at("warnings").dump(), HasSubstr("is not there"));
  EXPECT_FALSE(remade());
}

TEST_F(Painted_slow, AnImageThatCannotBeShownIsASentence) {
  const std::string good = render::png_bytes(image(0));
  render::Raster8 grey{4, 4, 1, std::vector<std::uint8_t>(16, 99)};
  const auto warning_of = [&](const std::string& bytes, const std::string& map = "map_Kd") {
    write("crate.png", bytes);
    write("crate.mtl", "newmtl crate\nKd 1 1 1\n" + map + " crate.png\n");
    simulate();
    EXPECT_FALSE(fs::exists(in("bodies/crate/image-0.png")));
    EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);
    return report("crate").at("warnings").dump();
  };
  EXPECT_THAT(warning_of(good.substr(0, good.size() / 2)), HasSubstr("cut short"));
  EXPECT_THAT(warning_of("\xff\xd8\xff and so on"), HasSubstr("JPEG that cannot be read"));
  EXPECT_THAT(warning_of(render::png_bytes(render::Raster8{16385, 1, 1, std::vector<std::uint8_t>(16385)})),
              HasSubstr("at most 16384 a side"));
  EXPECT_THAT(warning_of(render::png_bytes(grey), "map_Bump"), HasSubstr("heights, not normals"));
}

// Ways to make the folder wrong, by an adversary who makes all hashes and reports fit; verify must name each
// where it has the model. See mutation_test.cpp.
TEST_F(Painted_slow, VerifyNamesWhatIsNotTheModels) {
  simulate();
  const fs::path at = in("bodies/crate");
  const PreparedBody good = read_body(at);
  const auto verified = [&] {
    return limber_program({"verify", out(), "--scene", scene(falling), "--json"});
  };
  const auto write_body = [&](const PreparedBody& body, const std::function<void(Json&)>& change_report) {
    remove_appearance(at);
    write_appearance(at, body.appearance, body.surface);
    Json made = good.report.json;
    made.erase("appearance");
    if (!body.appearance.empty()) made["appearance"] = facts_of_appearance(body.appearance);
    made["files"] = Json::object();
    for (const std::string& name : files_of_body(body.report.input.settings, body.appearance))
      made["files"][name] = hex(hash_of(std::string_view(read_file(at / name))));
    change_report(made);
    write_json(at / "report.json", made);
  };
  struct Mutation {
    std::string what, named;
    std::function<void(Appearance&)> change;
    std::function<void(Json&)> change_report = [](Json&) {};
  };
  const std::string own = "crate: colors and images are the model's";
  const auto report_says = [&](const char* key, const Json& value) {
    return Mutation{std::string("report.json: appearance.") + key, "crate: report.json tells of these files",
                    [](Appearance&) {}, [=](Json& report) { report["appearance"][key] = value; }};
  };
  const std::vector<Mutation> mutations{
      {"a corner's coordinates", own, [](Appearance& a) { a.uv(7, 0) += 1e-3; }},
      {"all coordinates", own, [](Appearance& a) { a.uv.col(1) = 1 - a.uv.col(1).array(); }},
      {"two corners changed for each other", own, [](Appearance& a) { a.uv.row(3).swap(a.uv.row(4)); }},
      {"a plain triangle", own, [](Appearance& a) { a.material_from_triangle[5] = -1; }},
      {"the material's color", own, [](Appearance& a) { a.materials[0].color.x() = 0.9; }},
      {"the material's name", own, [](Appearance& a) { a.materials[0].name = "other"; }},
      {"normals by the image", own, [](Appearance& a) { a.materials[0].normal_image = 0; }},
      {"a material more", own, [](Appearance& a) { a.materials.push_back(a.materials[0]); }},
      {"colors of corners", own, [](Appearance& a) { a.colors.setConstant(a.uv.rows(), 3, 0.5); }},
      {"another image", own, [](Appearance& a) { a.images[0].bytes = render::png_bytes(image(1)); }},
      {"an image's name", own, [](Appearance& a) { a.images[0].name = "other.png"; }},
      {"an image that is cut short", "crate: its images can be shown",
       [](Appearance& a) { a.images[0].bytes.resize(a.images[0].bytes.size() / 2); }},
      {"nothing of it", own, [](Appearance& a) { a = {}; }},
      report_says("coordinates", false),
      report_says("corner_colors", true),
      report_says("materials", 2),
      report_says("plain_triangles", 1),
      report_says("images", Json::array()),
      report_says("beauty", 1),
      {"a file that there is not", "crate: report.json tells of these files", [](Appearance&) {},
       [](Json& report) { report["files"]["image-1.png"] = "0123456789abcdef"; }},
  };
  for (const Mutation& m : mutations) {
    SCOPED_TRACE(m.what);
    PreparedBody body = good;
    m.change(body.appearance);
    write_body(body, m.change_report);
    const Result result = verified();
    ASSERT_EQ(result.code, exit_defect) << result.err;
    std::vector<std::string> broken;
    const Json json = result.json();
    for (const Json& row : json.at("promises"))
      if (!row.at("kept").get<bool>()) broken.push_back(row.at("promise"));
    EXPECT_THAT(broken, Contains(HasSubstr(m.named)));
  }
  write_body(good, [](Json&) {});
  EXPECT_EQ(verified().code, exit_done);

  // Files that are changed alone are no body.
  for (const char* name : {"appearance.npz", "image-0.png"}) {
    const std::string bytes = read_file(at / name);
    write_file(at / name, bytes + "x");
    EXPECT_THAT(verified().err, HasSubstr(name));
    fs::remove(at / name);
    EXPECT_THAT(verified().err, HasSubstr(name));
    write_file(at / name, bytes);
  }
  EXPECT_EQ(verified().code, exit_done);
  // No prefix of the file is one.
  const std::string whole = read_file(at / "appearance.npz");
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 40) {
    write_file(at / "appearance.npz", whole.substr(0, size));
    EXPECT_THROW(read_appearance(at, good.surface), InputError) << size;
  }
}

}  // namespace
}  // namespace limber::detail
