// What a file holds is what comes in, whatever it is named; a damaged one is an InputError with its place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <functional>

#include "core/error.h"
#include "core/hash.h"
#include "core/job.h"
#include "core/progress.h"
#include "meshing/detail/own_process.h"
#include "meshing/import.h"
#include "tests/meshing/import_meshes.h"

namespace limber::meshing {
namespace {

using testing::Contains;
using testing::HasSubstr;

fs::path format_file(const std::string& name, const std::string& content) {
  const fs::path folder = fs::path(testing::TempDir()) / "limber_formats";
  make_folder(folder);
  write_file(folder / name, content);
  return folder / name;
}
ImportedModel imported(const std::string& name, const std::string& content) {
  return import_model(format_file(name, content), {.count_self_intersections = false});
}
std::string format_complaint(const std::string& name, const std::string& content) {
  try {
    imported(name, content);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no InputError";
}

// ── writers, as other programs write
// ──────────────────────────────────────────────────────────────────────────────

std::string as_obj(const SurfaceMesh& m) {
  std::string out = "# made\no thing\n";
  for (int v = 0; v < m.positions.rows(); ++v)
    out +=
        fmt::format("v {:.17g} {:.17g} {:.17g}\n", m.positions(v, 0), m.positions(v, 1), m.positions(v, 2));
  for (int t = 0; t < m.triangles.rows(); ++t)
    out += fmt::format("f {}/1/1 {}//2 {}\n", m.triangles(t, 0) + 1, m.triangles(t, 1) + 1,
                       m.triangles(t, 2) + 1);
  return out;
}
std::string as_off(const SurfaceMesh& m) {
  std::string out = fmt::format("OFF\n# made\n{} {} 0\n", m.positions.rows(), m.triangles.rows());
  for (int v = 0; v < m.positions.rows(); ++v)
    out += fmt::format("{:.17g} {:.17g} {:.17g}\n", m.positions(v, 0), m.positions(v, 1), m.positions(v, 2));
  for (int t = 0; t < m.triangles.rows(); ++t)
    out += fmt::format("3 {} {} {} 255 0 0\n", m.triangles(t, 0), m.triangles(t, 1), m.triangles(t, 2));
  return out;
}
std::string as_stl_text(const SurfaceMesh& m) {
  std::string out = "solid a thing\n";
  for (int t = 0; t < m.triangles.rows(); ++t) {
    out += "  facet normal 0 0 0\n    outer loop\n";
    for (int c = 0; c < 3; ++c) {
      const auto p = m.positions.row(m.triangles(t, c));
      out += fmt::format("      vertex {:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
    }
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid a thing\n";
}
template <class T>
void append(std::string& out, T value, bool big_endian = false) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  out.append(raw.data(), raw.size());
}
std::string as_stl_binary(const SurfaceMesh& m, const std::string& header = "solid, or so this says") {
  std::string out = header;
  out.resize(80, ' ');
  append(out, std::uint32_t(m.triangles.rows()));
  for (int t = 0; t < m.triangles.rows(); ++t) {
    for (int i = 0; i < 3; ++i) append(out, 0.f);
    for (int c = 0; c < 3; ++c)
      for (int axis = 0; axis < 3; ++axis) append(out, float(m.positions(m.triangles(t, c), axis)));
    append(out, std::uint16_t(0));
  }
  return out;
}
std::string as_ply(const SurfaceMesh& m, const std::string& format) {
  std::string out = fmt::format(
      "ply\nformat {} 1.0\nelement vertex {}\nproperty uchar red\nproperty double x\nproperty double "
      "y\nproperty double z\n"
      "element face {}\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n",
      format, m.positions.rows(), m.triangles.rows());
  const bool big = format == "binary_big_endian";
  for (int v = 0; v < m.positions.rows(); ++v) {
    const auto p = m.positions.row(v);
    if (format == "ascii") {
      out += fmt::format("255 {:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
    } else {
      append(out, std::uint8_t(255));
      for (int axis = 0; axis < 3; ++axis) append(out, p[axis], big);
    }
  }
  for (int t = 0; t < m.triangles.rows(); ++t) {
    const auto f = m.triangles.row(t);
    if (format == "ascii") {
      out += fmt::format("3 {} {} {} 0.5\n", f[0], f[1], f[2]);
    } else {
      append(out, std::uint8_t(3));
      for (int c = 0; c < 3; ++c) append(out, std::int32_t(f[c]), big);
      append(out, 0.5f, big);
    }
  }
  return out;
}

struct Writer {
  std::string name, extension;
  std::function<std::string(const SurfaceMesh&)> write;
  bool exact;  // keeps vertices and doubles; else the triangles, in single precision
};
std::vector<Writer> writers() {
  return {
      {"obj", ".obj", as_obj, true},
      {"off", ".off", as_off, true},
      {"ascii ply", ".ply", [](const SurfaceMesh& m) { return as_ply(m, "ascii"); }, true},
      {"little ply", ".ply", [](const SurfaceMesh& m) { return as_ply(m, "binary_little_endian"); }, true},
      {"big ply", ".ply", [](const SurfaceMesh& m) { return as_ply(m, "binary_big_endian"); }, true},
      {"ascii stl", ".stl", as_stl_text, false},
      {"binary stl", ".stl", [](const SurfaceMesh& m) { return as_stl_binary(m); }, false}};
}

std::string with_windows_ends(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '\n' ? "\r\n" : std::string(1, c);
  return out;
}

TEST(Formats, EachGivesBackTheMesh) {
  const SurfaceMesh mesh = moved(torus(), {1.0 / 3, -2.0 / 7, 1e-3});
  for (const Writer& writer : writers()) {
    SCOPED_TRACE(writer.name);
    const ImportedModel model = imported("mesh" + writer.extension, writer.write(mesh));
    EXPECT_THAT(model.warnings, testing::IsEmpty());
    EXPECT_EQ(model.left.boundary_edges.count, 0);
    if (writer.exact) {
      EXPECT_EQ(hash_of(model.surface), hash_of(mesh));
    }
    EXPECT_EQ(model.surface.positions.rows(), mesh.positions.rows());
    EXPECT_NEAR(volume(model.surface), volume(mesh), 1e-6 * volume(mesh));
  }
}

TEST(Formats, WindowsLineEndsChangeNothing) {
  const SurfaceMesh mesh = sphere(2);
  EXPECT_EQ(hash_of(imported("w.obj", with_windows_ends(as_obj(mesh))).surface), hash_of(mesh));
  EXPECT_EQ(hash_of(imported("w.off", with_windows_ends(as_off(mesh))).surface), hash_of(mesh));
  EXPECT_EQ(hash_of(imported("w.ply", with_windows_ends(as_ply(mesh, "ascii"))).surface), hash_of(mesh));
}

std::string as_utf16(const std::string& text, bool little_endian) {
  std::string out = little_endian ? "\xff\xfe" : "\xfe\xff";
  for (const char c : text) out += little_endian ? std::string{c, '\0'} : std::string{'\0', c};
  return out;
}

// As Windows' editors write text. Without the mark's removal the first line of an OBJ would be lost.
TEST(Formats, ByteOrderMarksAndUtf16ChangeNothing) {
  const SurfaceMesh mesh = sphere(2);
  std::string obj = as_obj(mesh);
  obj = obj.substr(obj.find("v "));
  const std::vector<std::pair<std::string, std::string>> texts{
      {"m.obj", obj}, {"m.off", as_off(mesh)}, {"m.ply", as_ply(mesh, "ascii")}};
  for (const auto& [name, text] : texts) {
    SCOPED_TRACE(name);
    EXPECT_EQ(hash_of(imported(name, "\xef\xbb\xbf" + text).surface), hash_of(mesh));
    EXPECT_EQ(hash_of(imported(name, as_utf16(text, true)).surface), hash_of(mesh));
    EXPECT_EQ(hash_of(imported(name, as_utf16(text, false)).surface), hash_of(mesh));
  }
  EXPECT_EQ(imported("m.stl", as_utf16(as_stl_text(mesh), true)).surface.triangles.rows(),
            mesh.triangles.rows());
}

// OBJ has neither counts nor an end: three traces of a cut between or within lines.
TEST(Formats, TracesOfACutObjAreSaid) {
  const SurfaceMesh mesh = sphere(2);
  const std::string whole = as_obj(mesh);
  const auto without_faces = [&](int n) {
    std::string text = whole;
    for (int i = 0; i < n; ++i) text.erase(text.rfind('\n', text.size() - 2) + 1);
    return text;
  };
  const auto warnings = [](const std::string& text) { return imported("cut.obj", text).warnings; };
  const std::string says_faces =
      fmt::format("# {} vertices, {} faces\n", mesh.positions.rows(), mesh.triangles.rows());
  for (const std::string& comment :
       {says_faces, fmt::format("#\n# Vertices: 66\n# Faces: {}\n", mesh.triangles.rows()),
        fmt::format("#Vertex Count 66\n#Face Count {}\n", mesh.triangles.rows()),
        fmt::format("# {} triangles in all\n", mesh.triangles.rows())}) {
    EXPECT_THAT(warnings(comment + whole), testing::IsEmpty());
    EXPECT_THAT(warnings(comment + without_faces(1)),
                Contains(HasSubstr("but there are 127: it may have been cut")));
  }
  for (const char* comment : {"# when indexed there should be 5000 vertices\n", "# 9000 texture vertices\n",
                              "# Vertex list\n", "# faces\n"})
    EXPECT_THAT(warnings(comment + whole), testing::IsEmpty());
  EXPECT_THAT(warnings(whole.substr(0, whole.find("f ")) + "v 9 9 9\n" + whole.substr(whole.find("f "))),
              Contains(HasSubstr("no face names any of the last 1 of 67 vertices")));
  EXPECT_THAT(warnings(whole.substr(0, whole.size() - 1)), Contains(HasSubstr("may have lost digits")));
  EXPECT_THAT(imported("cut.off", as_off(mesh).substr(0, as_off(mesh).size() - 1)).warnings,
              Contains(HasSubstr("may have lost digits")));
  const std::string ply = as_ply(mesh, "ascii");
  EXPECT_THAT(imported("cut.ply", ply.substr(0, ply.size() - 1)).warnings,
              Contains(HasSubstr("may have lost digits")));
}

// At a million times its size and more from the origin doubles keep a model, floats melt it.
TEST(Formats, SinglePrecisionFarFromTheOriginIsSaid) {
  const SurfaceMesh far = moved(sphere(3), {5e6, -5e6, 5e6});
  for (const Writer& writer : writers()) {
    SCOPED_TRACE(writer.name);
    const ImportedModel model = imported("far" + writer.extension, writer.write(far));
    const bool keeps_doubles = writer.name != "binary stl";
    EXPECT_EQ(model.surface.positions.rows() == far.positions.rows(), keeps_doubles);
    EXPECT_EQ(model.left.boundary_edges.count + model.left.non_manifold_edges.count == 0, keeps_doubles);
    EXPECT_THAT(imported("near" + writer.extension, writer.write(moved(sphere(3), {99, 0, 0}))).warnings,
                testing::IsEmpty());
    if (keeps_doubles)
      EXPECT_THAT(model.warnings, testing::IsEmpty());
    else
      EXPECT_THAT(model.warnings, Contains(HasSubstr("single precision")));
  }
}

TEST(Formats, ALyingExtensionIsSeenThrough) {
  const SurfaceMesh mesh = sphere(2);
  for (const Writer& writer : writers())
    for (const std::string extension : {".stl", ".ply", ".off"}) {
      SCOPED_TRACE(writer.name + " as " + extension);
      if (writer.extension == extension || (writer.name == "obj" && extension != ".stl")) continue;
      const ImportedModel model = imported("lies" + extension, writer.write(mesh));
      EXPECT_EQ(model.surface.triangles.rows(), mesh.triangles.rows());
      EXPECT_THAT(model.warnings, Contains(HasSubstr("but holds")));
    }
}

// Names of vertices before they come, from the end, lines that go on, numbers with a plus.
TEST(Formats, ObjAsItIsWritten) {
  const ImportedModel model =
      imported("quirks.obj",
               "f 1 2 3\nv +0 0 0 1.0\nv 1. 0 0 0.5 0.5 0.5\nv 0 1e0 0 nan nan nan\nl 1 2\np 1\n"
               "v 0 0 1\nf -4 -1 \\\n -3\n");
  EXPECT_EQ(model.surface.positions.rows(), 4);
  EXPECT_EQ(model.surface.triangles.rows(), 2);
  EXPECT_EQ(model.found.misoriented_edges.count, 0);
}

// Every second triangle of a strip is turned; -1 begins the next strip.
TEST(Formats, PlyTriangleStrips) {
  const ImportedModel model = imported(
      "strips.ply",
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n9 0 1 2 3 4 -1 3 5 4\n");
  EXPECT_EQ(model.surface.triangles.rows(), 4);
  EXPECT_EQ(model.found.misoriented_edges.count, 0);
  EXPECT_DOUBLE_EQ(area(model.surface), 2);
}

TEST(Formats, ComplaintsNameTheLine) {
  EXPECT_THAT(format_complaint("a.obj", "v 0 0 0\nv 1 0 x\n"),
              HasSubstr("a.obj:2: z: \"x\" is not a number"));
  EXPECT_THAT(format_complaint("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
              HasSubstr("there are 3 vertices"));
  EXPECT_THAT(format_complaint("c.obj", "v 0 0 0\nf 1 2 0\n"), HasSubstr("c.obj:2: corner \"0\""));
  EXPECT_THAT(format_complaint("d.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
              HasSubstr("d.off:6: a face names vertex 3"));
  EXPECT_THAT(format_complaint("e.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
              HasSubstr("2 faces were announced"));
  EXPECT_THAT(format_complaint("f.off", "4OFF\n3 1 0\n"), HasSubstr("other than three coordinates"));
  EXPECT_THAT(
      format_complaint(
          "g.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"),
      HasSubstr("g.stl:7: the facet ends before its third vertex"));
  EXPECT_THAT(
      format_complaint("h.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
      HasSubstr("no property \"y\""));
  EXPECT_THAT(format_complaint(
                  "i.ply",
                  "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
                  "property float z\nend_header\n0 0 0\n"),
              HasSubstr("vertex 1 of 4000000000"));
  EXPECT_THAT(format_complaint("j.obj", "v 0 0 0\r\n\r\nv 1 0 x\r\n"), HasSubstr("j.obj:3:"));
  const std::string stl = as_stl_binary(cube());
  EXPECT_THAT(format_complaint("k.stl", stl.substr(0, stl.size() - 20)),
              HasSubstr("ends inside triangle 11"));
  EXPECT_THAT(format_complaint("empty.obj", ""), HasSubstr("the file is empty"));
  // What assimp says of a format that it does not know is of another format.
  EXPECT_THAT(format_complaint("noise.xyzzy", std::string(1000, '\7')),
              AllOf(HasSubstr("nothing here reads .xyzzy files"), Not(HasSubstr("assimp"))));
  EXPECT_THAT(format_complaint("noise.3ds", std::string(1000, '\7')), HasSubstr("cannot be read (assimp: "));
  EXPECT_THAT(format_complaint("noise", std::string(1000, '\7')), HasSubstr("cannot be read (assimp: "));
  EXPECT_THAT(format_complaint("names.obj", "o nothing\n"), HasSubstr("holds no faces and no points"));
  EXPECT_THROW(import_model("no/such/file.obj"), InputError);
  EXPECT_THROW(import_model(testing::TempDir()), InputError);
}

// Cut at every place (in steps, for time): a sentence, or a mesh that holds to the laws. And where the file
// said how much it holds, always a sentence.
TEST(Formats, NoPrefixOfAFileIsTakenSilentlyOrCrashes) {
  const SurfaceMesh mesh = sphere(1);
  for (const Writer& writer : writers()) {
    const std::string whole = writer.write(mesh);
    const bool says_its_size = writer.extension == ".off" || writer.extension == ".ply";
    for (std::size_t size = 0; size + 2 < whole.size(); size += size < 400 ? 11 : 37) {
      SCOPED_TRACE(fmt::format("{} cut to {} of {} bytes", writer.name, size, whole.size()));
      try {
        const ImportedModel model = imported("cut" + writer.extension, whole.substr(0, size));
        EXPECT_NO_THROW(validate(model.surface, "cut"));
        if (model.warnings.empty()) {  // only a trailing colour or name is missing
          EXPECT_EQ(model.surface.triangles.rows(), mesh.triangles.rows());
          EXPECT_NEAR(volume(model.surface), volume(mesh), 1e-6);
        }
        // The last number of the file may lose its last digits: then the lost line end is said.
        if (says_its_size) {
          EXPECT_GT(size + 8, whole.size());
        }
      } catch (const InputError& e) {
        EXPECT_THAT(e.what(), HasSubstr("cut" + writer.extension));
      }
    }
  }
}

TEST(Formats, NoChangedByteCrashes) {
  const SurfaceMesh mesh = sphere(1);
  Rng rng(5, 0);
  for (const Writer& writer : writers()) {
    const std::string whole = writer.write(mesh);
    for (int i = 0; i < 60; ++i) {
      std::string changed = whole;
      for (int n = 1 + rng.below(3); n > 0; --n)
        changed[std::size_t(rng.below(int(whole.size())))] = char(rng.below(256));
      try {
        validate(imported("changed" + writer.extension, changed).surface, "changed");
      } catch (const InputError&) {
      }
    }
  }
}

// ── by assimp
// ─────────────────────────────────────────────────────────────────────────────────────────────────────

// A tetrahedron of volume 1/6 in glTF: once scaled by 2 and moved, once mirrored; and a line, which is left
// out.
std::string gltf() {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 3]}],
    "nodes": [{"children": [2], "translation": [10, 0, 0]}, {"mesh": 0, "scale": [-1, 1, 1]},
              {"mesh": 0, "scale": [2, 2, 2]}, {"mesh": 1}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]},
               {"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "mode": 1}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
                  {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
                  {"bufferView": 1, "componentType": 5123, "count": 2, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
    "buffers": [{"byteLength": 72, "uri": "data:application/octet-stream;base64,)"
         "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAQACAAMAAgAAAAMA"
         R"("}]})";
}

TEST(Assimp, AppliesTheTransformsOfTheScene) {
  const ImportedModel model = imported("two.gltf", gltf());
  EXPECT_EQ(model.surface.triangles.rows(), 8);
  EXPECT_EQ(model.left.components, 2);
  EXPECT_EQ(model.found.inward_components.count, 0) << "a mirrored instance must be turned back";
  EXPECT_NEAR(volume(model.surface), 8.0 / 6 + 1.0 / 6, 1e-6);
  const Box box = bounding_box(model.surface.positions);
  EXPECT_LT((box.lower - Vec3(-1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((box.upper - Vec3(12, 2, 2)).norm(), 1e-6);
  EXPECT_THAT(model.warnings, Contains(HasSubstr("lines and points were left out")));
}

TEST(Assimp, SinglePrecisionCountsBeforeTheTransform) {
  std::string far = gltf();
  far.replace(far.find("[10, 0, 0]"), 10, "[1e9, 0, 0]");
  EXPECT_THAT(imported("far.gltf", far).warnings, testing::Not(Contains(HasSubstr("single precision"))));
}

TEST(Assimp, NoPrefixOfAGltfCrashes) {
  const std::string whole = gltf();
  for (std::size_t size = 1; size < whole.size() - 2; size += 97)
    EXPECT_NE(format_complaint("cut.gltf", whole.substr(0, size)), "no InputError");
}

TEST(OwnProcess, ACrashIsAnAnswer) {
  const auto returned = detail::run_in_own_process([] { return std::string(1 << 20, 'x'); }, 60);
  EXPECT_TRUE(returned.finished);
  EXPECT_EQ(returned.bytes, std::string(1 << 20, 'x'));
  const auto threw = detail::run_in_own_process([]() -> std::string { throw InputError("a sentence"); }, 60);
  EXPECT_FALSE(threw.finished);
  EXPECT_EQ(threw.bytes, "a sentence");
  const auto crashed = detail::run_in_own_process(
      []() -> std::string {
        raise(SIGSEGV);
        return {};
      },
      60);
  EXPECT_FALSE(crashed.finished);
  EXPECT_THAT(crashed.bytes, HasSubstr("crashed"));
  const auto hung = detail::run_in_own_process(
      []() -> std::string {
        for (volatile bool on = true; on;) continue;
        return {};
      },
      1);
  EXPECT_FALSE(hung.finished);
  EXPECT_THAT(hung.bytes, HasSubstr("stopped after 1 s"));
}

// Says stop when it is asked the n-th time.
struct StopsAt : Watcher {
  explicit StopsAt(int n) : left(n) {}
  bool stop() override { return --left <= 0; }
  int left;
};

// Whichever question is the first that is answered by stop, the process is ended and not waited for.
TEST(OwnProcess, AStopEndsItAtOnce) {
  const auto cpu_s_of_children = [] {
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    return double(used.ru_utime.tv_sec) + 1e-6 * double(used.ru_utime.tv_usec);
  };
  for (const int asked : {1, 2, 3, 4}) {
    StopsAt watcher(asked);
    Job job({.watcher = &watcher});
    const WorkingFor working(&job);
    const double before = cpu_s_of_children();
    EXPECT_THROW(detail::run_in_own_process(
                     []() -> std::string {
                       for (volatile bool on = true; on;) continue;
                       return {};
                     },
                     3),
                 Interrupted);
    EXPECT_LT(cpu_s_of_children() - before, 1) << asked;
  }
}

}  // namespace
}  // namespace limber::meshing
