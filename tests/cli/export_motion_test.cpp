// A planned motion as other programs read it: here by assimp and by a few lines that know the format; by VTK,
// Khronos' validator, TinyUSDZ, three.js and Blender in tools/check_exports, where they are installed.
#include <assimp/scene.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <assimp/Importer.hpp>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>

#include "core/random.h"
#include "fem/observe.h"
#include "limber/detail/exports/motion_files.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

// Beside the robot, by Phong Deformation, and the soft block, linear: a rigid body that falls, and one that
// stands.
std::string scene_with_rigid_bodies() {
  std::string text = small_scene;
  for (const auto& [role, deformation] : {std::pair("role = \"robot\"\n", "deformation = \"phong\"\n"),
                                          {"role = \"obstacle\"\n", "deformation = \"linear\"\n"}})
    text.insert(text.find(role), deformation);
  const std::string without = "gravity_m_s2 = [0, 0, 0]";
  text.replace(text.find(without), without.size(), "gravity_m_s2 = [0, 0, -1]");
  const std::string goal = "[goal]\n";
  return text.insert(text.find(goal), R"([[bodies]]
name = "2nd-stone"
role = "free"
kind = "rigid"
model = { box = { size_m = [0.3, 0.2, 0.2] } }
cage = { cells = [1, 1, 1] }
material = { density_kg_m3 = 200 }
pose = { position_m = [1.1, 0.3, 1.6], axis = [1, 2, 3], angle_deg = 40 }
[[bodies]]
name = "table"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [0.4, 0.4, 0.9] } }
cage = { cells = [1, 1, 1] }
pose = { position_m = [1.2, 0.5, 0.45] }
)");
}

class ExportMotion : public Program {
 protected:
  void SetUp() override {
    // Far from the goal will do, as long as things move.
    const Result planned =
        limber_program({"plan", scene(scene_with_rigid_bodies()), "-o", out(), "--iterations", "60"});
    ASSERT_TRUE(planned.code == exit_done || planned.code == exit_no_plan) << planned.err;
  }
  Result exported(const std::string& formats, std::vector<std::string> more = {}) const {
    std::vector<std::string> words{"export", out(), "--format", formats, "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return limber_program(words);
  }
  fs::path file(const std::string& name) const { return fs::path(out()) / "export" / name; }
};

// What the files must show, from plan.npz and the bodies.
struct Truth {
  explicit Truth(const fs::path& work_folder)
      : planned(read_plan_folder(work_folder)),
        bodies(read_world_of(planned, work_folder).bodies),
        world(build_world(planned.scene, bodies)) {}
  Points surface(int b, int frame) const {
    const PreparedBody& body = bodies[std::size_t(b)];
    if (!world.bodies[std::size_t(b)].moving) return body.surface.positions;
    const Points nodes = fem::body_positions(world, planned.plan.trajectory.frames[std::size_t(frame)], b);
    Points p;
    if (planned.scene.bodies[std::size_t(b)].deformation == scenes::Deformation::phong)
      ffd::deform_phong(body.binding, body.cage, node_gradients(body.cage), nodes, p);
    else
      ffd::deform(body.binding, body.cage.tets, nodes, p);
    return p;
  }
  PlanFolder planned;
  std::vector<PreparedBody> bodies;
  fem::World world;
};

aiMatrix4x4 local_at(const aiNode& node, const aiAnimation& animation, unsigned key) {
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim& channel = *animation.mChannels[c];
    if (channel.mNodeName != node.mName) continue;
    const auto at = [&](const auto* keys, unsigned count) { return keys[std::min(key, count - 1)].mValue; };
    // Not by aiMatrix4x4(scale, turn, shift), which scales after the turn.
    aiMatrix4x4 shift, scale;
    aiMatrix4x4::Translation(at(channel.mPositionKeys, channel.mNumPositionKeys), shift);
    aiMatrix4x4::Scaling(at(channel.mScalingKeys, channel.mNumScalingKeys), scale);
    return shift * aiMatrix4x4(at(channel.mRotationKeys, channel.mNumRotationKeys).GetMatrix()) * scale;
  }
  return node.mTransformation;
}

aiMatrix4x4 world_at(const aiNode* node, const aiAnimation& animation, unsigned key) {
  aiMatrix4x4 m;
  for (; node; node = node->mParent) m = local_at(*node, animation, key) * m;
  return m;
}

// Our z up, of a body at a key, skinned as the format says; glTF has y up.
Points shown_by_gltf(const aiScene& scene, std::size_t b, const std::string& name, int f) {
  const aiMesh& mesh = *scene.mMeshes[b];
  const aiAnimation& animation = *scene.mAnimations[0];
  std::vector<aiVector3D> shown(mesh.mNumVertices);
  if (!mesh.HasBones()) {
    const aiMatrix4x4 world = world_at(scene.mRootNode->FindNode(name.c_str()), animation, unsigned(f));
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) shown[v] = world * mesh.mVertices[v];
  }
  for (unsigned i = 0; i < mesh.mNumBones; ++i) {
    const aiBone& bone = *mesh.mBones[i];
    const aiMatrix4x4 skin =
        world_at(scene.mRootNode->FindNode(bone.mName), animation, unsigned(f)) * bone.mOffsetMatrix;
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const unsigned v = bone.mWeights[w].mVertexId;
      shown[v] += bone.mWeights[w].mWeight * (skin * mesh.mVertices[v]);
    }
  }
  Points points(Eigen::Index(shown.size()), 3);
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    const aiVector3D& p = shown[std::size_t(v)];
    points.row(v) << p.x, -p.z, p.y;
  }
  return points;
}

// Every vertex of every key is where the binding puts it.
TEST_F(ExportMotion, GltfBySkinningIsTheBindingAtEveryFrame) {
  ASSERT_EQ(exported("gltf").code, exit_done);
  const Truth truth(out());
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file("motion.glb").string(), 0);
  ASSERT_TRUE(scene) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumAnimations, 1);
  ASSERT_EQ(scene->mNumMeshes, truth.bodies.size());
  const aiAnimation& animation = *scene->mAnimations[0];
  const int frames = int(truth.planned.plan.trajectory.frames.size());
  ASSERT_GT(frames, 5);
  EXPECT_NEAR(animation.mDuration / animation.mTicksPerSecond, (frames - 1) / 5.0, 1e-6);
  double traveled = 0, bent = 0;
  for (std::size_t b = 0; b < truth.bodies.size(); ++b) {
    const std::string& name = truth.planned.scene.bodies[b].name;
    SCOPED_TRACE(name);
    const aiMesh& mesh = *scene->mMeshes[b];
    const aiNode* node = scene->mRootNode->FindNode(name.c_str());
    ASSERT_TRUE(node);
    EXPECT_EQ(mesh.HasBones(), truth.world.bodies[b].kind == fem::BodyKind::deformable);
    for (int f = 0; f < frames; f += 3) {
      const Points wanted = truth.surface(int(b), f);
      ASSERT_EQ(mesh.mNumVertices, wanted.rows());
      EXPECT_LT((shown_by_gltf(*scene, b, name, f) - wanted).rowwise().norm().maxCoeff(), 5e-6)
          << "frame " << f;
      traveled = std::max(traveled, (wanted - truth.surface(int(b), 0)).rowwise().norm().maxCoeff());
      if (b != 0) continue;
      Points linear;
      ffd::deform(truth.bodies[b].binding, truth.bodies[b].cage.tets,
                  fem::body_positions(truth.world, truth.planned.plan.trajectory.frames[std::size_t(f)], 0),
                  linear);
      bent = std::max(bent, (wanted - linear).rowwise().norm().maxCoeff());
    }
  }
  EXPECT_GT(traveled, 0.3);
  EXPECT_GT(bent, 1e-3) << "the robot is not just turned and stretched";
}

// A robot turned inside out, crushed to a point, and torn node by node: gradients that mirror, vanish, and
// anything.
TEST_F(ExportMotion, GltfHoldsAnyDeformation) {
  Truth truth(out());
  std::vector<State>& frames = truth.planned.plan.trajectory.frames;
  const fem::Body& robot = truth.world.bodies[0];
  Rng rng(31, 0);
  for (int n = robot.first_node; n < robot.first_node + robot.node_count(); ++n) {
    const auto at = [&](std::size_t f) { return Vec3f::Map(&frames[f].positions[3 * std::size_t(n)]); };
    at(1).x() *= -1;
    at(2).setConstant(1);
    at(3) += 0.3f * rng.direction().cast<float>();
  }
  const PlannedMotion motion{truth.planned.scene, truth.bodies, truth.world, frames, 5, {0, 1, 2, 3, 4}};
  write_gltf(motion, folder.path());
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile((folder / "motion.glb").string(), 0);
  ASSERT_TRUE(scene) << importer.GetErrorString();
  for (const int f : motion.wanted)
    EXPECT_LT((shown_by_gltf(*scene, 0, "robot", f) - truth.surface(0, f)).rowwise().norm().maxCoeff(), 5e-6)
        << "frame " << f;
}

TEST_F(ExportMotion, PointCacheIsAHeadAndThePointsOfEachFrame) {
  ASSERT_EQ(exported("pc2", {"--frames", "2-10:4"}).code, exit_done);
  const Truth truth(out());
  const std::string cache = read_file(file("pc2/2nd-stone.pc2"));
  const Points first = truth.surface(2, 2), last = truth.surface(2, 10);
  ASSERT_EQ(cache.size(), 32 + 3 * 12 * std::size_t(first.rows()));
  EXPECT_EQ(cache.substr(0, 12), std::string("POINTCACHE2\0", 12));
  const auto number = [&]<class T>(std::size_t at, T) {
    T value;
    std::memcpy(&value, cache.data() + at, sizeof value);
    return value;
  };
  EXPECT_EQ(number(12, 0), 1);
  EXPECT_EQ(number(16, 0), first.rows());
  EXPECT_EQ(number(24, 0.0f), 1.0f);
  EXPECT_EQ(number(28, 0), 3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(number(32 + 4 * std::size_t(k), 0.0f), float(first(0, k)));
    EXPECT_EQ(number(cache.size() - 12 + 4 * std::size_t(k), 0.0f), float(last(last.rows() - 1, k)));
  }
  const std::string robot = read_file(file("pc2/robot.pc2"));
  const Points bent = truth.surface(0, 10);
  ASSERT_EQ(robot.size(), 32 + 3 * 12 * std::size_t(bent.rows()));
  const std::vector<float> expected(bent.data(), bent.data() + bent.size());
  EXPECT_EQ(std::memcmp(robot.data() + 32 + 2 * 12 * bent.rows(), expected.data(), 12 * expected.size() / 3),
            0);
  EXPECT_FALSE(fs::exists(file("pc2/table.pc2"))) << "it stands still";
  EXPECT_TRUE(fs::exists(file("pc2/table.obj")));
  EXPECT_NE(read_file(file("pc2/README.txt")).find("1.25 frames a second"), std::string::npos);
}

TEST_F(ExportMotion, UsdHoldsThePointsOfEachFrame) {
  ASSERT_EQ(exported("usd", {"--frames", "0,9"}).code, exit_done);
  const Truth truth(out());
  const Points wanted = truth.surface(0, 9);
  const std::string usd = read_file(file("motion.usda"));
  const auto samples = usd.find("point3f[] points.timeSamples", usd.find("def Mesh \"robot\""));
  ASSERT_NE(samples, usd.npos);
  std::string points = usd.substr(usd.find(" 9: [", samples) + 4);
  points.resize(points.find(']'));
  for (char& c : points)
    if (std::strchr("[](),", c)) c = ' ';
  std::istringstream numbers(points);
  double worst = 0;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    double number = std::nan("");
    numbers >> number;
    ASSERT_TRUE(numbers) << i;
    worst = std::max(worst, std::abs(number - wanted.data()[i]));
  }
  EXPECT_LT(worst, 1e-6 * truth.world.bounds_m.diagonal());
}

TEST_F(ExportMotion, SameMotionSameBytesAndAnEarlierSeriesGoes) {
  ASSERT_EQ(exported("gltf,pc2,usd,vtu", {"--frames", "0-8:4"}).code, exit_done);
  const auto first = contents(file(""));
  ASSERT_EQ(exported("gltf,pc2,usd,vtu").code, exit_done);
  EXPECT_TRUE(fs::exists(file("vtu/cages/0003.vtu")));
  const Result again = exported("gltf,pc2,usd,vtu", {"--frames", "0-8:4"});
  EXPECT_TRUE(contents(file("")) == first);
  std::uintmax_t bytes = 0;
  const Json formats = again.json().at("formats");
  for (const auto& [format, written] : formats.items()) bytes += written.at("bytes").get<std::uintmax_t>();
  std::uintmax_t there = 0;
  for (const auto& [name, content] : first) there += content.size();
  EXPECT_EQ(bytes, there);
  EXPECT_EQ(formats.at("vtu").at("files"), 2 * 3 + 2);
}

// Of another plan only what limber made there; the same plan again leaves all as it is.
TEST_F(ExportMotion, AnotherPlanRemovesWhatShowsTheOldOne) {
  ASSERT_EQ(exported("gltf,pc2,usd,vtu").code, exit_done);
  ASSERT_EQ(exported("gltf", {"-o", out("elsewhere")}).code, exit_done);
  ASSERT_EQ(limber_program({"report", out()}).code, exit_done);
  const fs::path report = fs::path(out()) / "report.html";
  for (const char* of_the_user : {"notes.txt", "pc2/shot.blend", "vtu/cages/mine.vtu", "vtu/view.pvsm"})
    std::ofstream(file(of_the_user)) << "mine";
  const auto before = contents(file(""));
  const auto planned_again = [&](const char* seed) {
    return limber_program(
        {"plan", scene(scene_with_rigid_bodies()), "-o", out(), "--iterations", "60", "--seed", seed});
  };
  planned_again("1");
  EXPECT_TRUE(contents(file("")) == before);
  EXPECT_TRUE(fs::exists(report));
  const Result other = planned_again("2");
  EXPECT_NE(other.err.find("of another plan are removed"), std::string::npos) << other.err;
  EXPECT_FALSE(fs::exists(report));
  std::vector<std::string> left;
  for (const auto& [name, content] : contents(file(""))) left.push_back(name);
  EXPECT_EQ(left, (std::vector<std::string>{"notes.txt", "pc2/shot.blend", "pc2/table.obj",
                                            "vtu/cages/mine.vtu", "vtu/view.pvsm"}));
  EXPECT_TRUE(fs::exists(fs::path(out("elsewhere")) / "motion.glb"));
}

TEST_F(ExportMotion, WrongInputIsToldAndNothingHalfWritten) {
  EXPECT_EQ(limber_program({"export", out(), "--format", "fbx"}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"export", out()}).code, exit_bad_input);
  const Result unplanned = limber_program({"export", out("none"), "--format", "gltf"});
  EXPECT_EQ(unplanned.code, exit_bad_input);
  EXPECT_NE(unplanned.err.find("limber plan"), std::string::npos) << unplanned.err;
  const Result uneven = exported("pc2,gltf", {"--frames", "0-3,7"});
  EXPECT_EQ(uneven.code, exit_bad_input);
  EXPECT_NE(uneven.err.find("7 follows 3"), std::string::npos) << uneven.err;
  EXPECT_FALSE(fs::exists(file("motion.glb")));
  std::ofstream(folder / "a_file") << "x";
  EXPECT_EQ(exported("usd", {"-o", (folder / "a_file").string()}).code, exit_disk);

  for (const char* format : {"gltf", "usd", "pc2", "vtu"}) {
    SCOPED_TRACE(format);
    rlimit old{};
    getrlimit(RLIMIT_FSIZE, &old);
    const rlimit small{4000, old.rlim_max};
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    const Result full = exported(format, {"-o", out("full")});
    setrlimit(RLIMIT_FSIZE, &old);
    signal(SIGXFSZ, SIG_DFL);
    EXPECT_EQ(full.code, exit_disk) << full.err;
    for (const auto& [name, content] : contents(out("full")))
      EXPECT_TRUE(name.find(".tmp") == name.npos && content.size() < 4000) << name;
  }
}

TEST_F(ExportMotion, OtherProgramsReadersAgree) {
  ASSERT_EQ(exported("gltf,pc2,usd,vtu").code, exit_done);
  const int status =
      std::system((std::string(limber_source_dir) + "/tools/check_exports '" + out() + "'").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77)
    GTEST_SKIP()
        << "none of python3-vtk9, Khronos' validator (tools/install-node-tools), Blender is installed";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace limber::detail
