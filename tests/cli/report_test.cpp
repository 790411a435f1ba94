// The page of `limber report`: what it holds, and that a browser shows it.
#include <sys/wait.h>

#include <cstdlib>
#include <cstring>

#include "fem/observe.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/report/report_motion.h"
#include "limber/detail/world/scene_world.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

int count_of(const std::string& text, const std::string& what) {
  int count = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += what.size()) ++count;
  return count;
}

class Report : public Program {
 protected:
  void plan(const std::string& text = small_scene) {
    const Result planned = limber_program({"plan", scene(text), "-o", out()});
    ASSERT_EQ(planned.code, exit_done) << planned.err;
  }
  std::string page() const { return read_file(fs::path(out()) / "report.html"); }
};

// What a browser does with it, done here: every vertex at every frame within what 16 bits can tell.
TEST_F(Report, PackedMotionUnpacksToTheSurfacesOfAllFrames) {
  plan();
  const PlanFolder planned = read_plan_folder(out());
  std::vector<PreparedBody> bodies = read_world_of(planned, out()).bodies;
  const fem::World world = build_world(planned.scene, bodies);
  bodies[0].deformation = scenes::Deformation::linear;
  bodies[1].deformation = scenes::Deformation::phong;
  bodies[0].binding.weights.row(0) << -0.2, 0.5, 0.4,
      0.3;  // as where weights were clamped: not where surface.ply has it
  const std::vector<State>& frames = planned.plan.trajectory.frames;
  const PackedMotion packed = pack_motion(world, bodies, {Vec3(1, 0.5, 0), Vec3(0, 0, 1)}, frames);
  const auto array = [&]<class T>(const Json& place, T) {
    std::vector<T> values(place.at(1).get<std::size_t>());
    EXPECT_EQ(place.at(0).get<std::size_t>() % 4, 0);
    EXPECT_LE(place.at(0).get<std::size_t>() + values.size() * sizeof(T), packed.bytes.size());
    std::memcpy(values.data(), packed.bytes.data() + place.at(0).get<std::size_t>(),
                values.size() * sizeof(T));
    return values;
  };
  const auto unpacked = [](const std::vector<std::uint16_t>& levels, const Json& low, const Json& step,
                           std::size_t first, Eigen::Index rows) {
    Points points(rows, 3);
    for (Eigen::Index i = 0; i < 3 * rows; ++i)
      points.data()[i] = low.at(std::size_t(i % 3)).get<double>() +
                         step.at(std::size_t(i % 3)).get<double>() * levels.at(first + std::size_t(i));
    return points;
  };
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Json& entry = packed.bodies.at(b);
    const PreparedBody& body = bodies[b];
    SCOPED_TRACE(entry.at("name"));
    const Eigen::Index vertices = body.surface.positions.rows(), nodes = body.cage.positions.rows();
    const Points rest = unpacked(array(entry.at("positions"), std::uint16_t()), entry.at("low"),
                                 entry.at("step"), 0, vertices);
    const auto triangles = array(entry.at("triangles"), std::uint16_t());
    EXPECT_TRUE(std::equal(triangles.begin(), triangles.end(), body.surface.triangles.data()));
    const auto cage = array(entry.at("cage"), float());
    const auto tets = array(entry.at("tets"), std::uint32_t()),
               of = array(entry.at("tet_from_vertex"), std::uint32_t());
    const auto levels = array(entry.at("frames"), std::uint16_t());
    ASSERT_EQ(levels.size(), 3 * std::size_t(nodes) * frames.size());
    double step = 0;
    for (int k = 0; k < 3; ++k)
      step = std::max({step, entry.at("step").at(std::size_t(k)).get<double>(),
                       entry.at("frames_step").at(std::size_t(k)).get<double>()});
    for (std::size_t f = 0; f < frames.size(); f += 4) {
      const Points now = unpacked(levels, entry.at("frames_low"), entry.at("frames_step"),
                                  f * 3 * std::size_t(nodes), nodes);
      const bool phong = b == 1;
      EXPECT_EQ(entry.at("phong"), phong);
      const Points places = fem::body_positions(world, frames[f], int(b));
      Points wanted;
      if (phong)
        ffd::deform_phong(body.binding, body.cage, node_gradients(body.cage), places, wanted);
      else
        ffd::deform(body.binding, body.cage.tets, places, wanted);
      const ffd::Gradients gradients = ffd::node_deformation_gradients(node_gradients(body.cage), now);
      double worst = 0;
      for (Eigen::Index v = 0; v < vertices; ++v) {
        Eigen::Matrix4d corners, ends;
        for (int k = 0; k < 4; ++k) {
          const std::uint32_t node = tets.at(4 * of.at(std::size_t(v)) + std::size_t(k));
          corners.col(k) << cage[3 * node], cage[3 * node + 1], cage[3 * node + 2], 1;
          ends.col(k) << now.row(node).transpose(), 1;
          if (phong)
            ends.col(k).head<3>() +=
                0.5 * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&gradients(node, 0)) *
                (rest.row(v).transpose() - corners.col(k).head<3>());
        }
        const Eigen::Vector4d shown = ends * corners.inverse() * rest.row(v).transpose().homogeneous();
        worst = std::max(worst, (shown.head<3>() - wanted.row(v).transpose()).norm());
      }
      EXPECT_LT(worst, 5 * step) << "frame " << f;
    }
  }
}

// What the page's own viewer does with it, run by node.
TEST_F(Report, TheViewerMovesSurfacesAsFilmsDo) {
  std::string text = replaced("role = \"obstacle\"\n", "role = \"obstacle\"\ndeformation = \"phong\"\n");
  plan(text.replace(text.find("seed = 1"), 8, "seed = 3"));  // it presses the block
  ASSERT_EQ(limber_program({"report", out()}).code, exit_done);
  if (std::system("node --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "nodejs is missing";
  const std::string script = std::string(limber_source_dir) + "/tools/readers/viewer.js";
  ASSERT_EQ(std::system(("node '" + script + "' '" + out() + "/report.html' '" + out() + "/points'").c_str()),
            0);
  const std::string points = read_file(fs::path(out()) / "points");
  const PlanFolder planned = read_plan_folder(out());
  const std::vector<PreparedBody> bodies = read_world_of(planned, out()).bodies;
  const fem::World world = build_world(planned.scene, bodies);
  EXPECT_EQ(bodies[1].deformation, scenes::Deformation::phong);
  const double level = world.bounds_m.diagonal() / 65535;
  std::size_t at = 0;
  double worst = 0, bent = 0;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    for (const State& state : planned.plan.trajectory.frames) {
      const Points nodes = fem::body_positions(world, state, int(b));
      Points wanted, linear;
      deform(bodies[b], nodes, wanted);
      ffd::deform(bodies[b].binding, bodies[b].cage.tets, nodes, linear);
      bent = std::max(bent, (wanted - linear).cwiseAbs().maxCoeff());
      ASSERT_LE(at + sizeof(float) * std::size_t(wanted.size()), points.size());
      for (Eigen::Index i = 0; i < wanted.size(); ++i, at += sizeof(float)) {
        float shown = 0;
        std::memcpy(&shown, points.data() + at, sizeof shown);
        worst = std::max(worst, std::abs(double(shown) - wanted.data()[i]));
      }
    }
  EXPECT_EQ(at, points.size());
  EXPECT_LT(worst, 2 * level);
  EXPECT_GT(bent, 20 * level);
}

TEST_F(Report, HoldsEveryPromiseOnceAndTextOfTheUserOnlyAsText) {
  const std::string hostile = "</script><script>alert(1)</script>&\\\"'";
  std::string text = replaced("name = \"small\"\n", "name = \"small\"\ndescription = \"" + hostile + "\"\n");
  text.replace(text.find("seed = 1"), 8, "seed = 6");  // a plan that keeps all
  plan(text);
  const Result made = limber_program({"report", out(), "--json"});
  ASSERT_EQ(made.code, exit_done) << made.err;
  const std::string html = page();
  EXPECT_EQ(made.json().at("bytes"), html.size());
  EXPECT_EQ(made.json().at("film"), "none");
  EXPECT_EQ(html.find("<script>alert"), html.npos);
  EXPECT_EQ(count_of(html, "<script"), 3);
  EXPECT_EQ(count_of(html, "</script>"), 3);
  EXPECT_EQ(html.find("http://"), html.find("http://www.w3.org/2000/svg")) << "nothing is fetched";
  EXPECT_EQ(html.find("https://"), html.npos);
  const Json verified = limber_program({"verify", out(), "--json"}).json();
  for (const Json& promise : verified.at("promises"))
    EXPECT_EQ(count_of(html, "<td>" + promise.at("promise").get<std::string>() + "</td>"), 1);
  EXPECT_EQ(count_of(html, "✓ kept"), int(verified.at("promises").size()));
  EXPECT_EQ(count_of(html, "✗"), 0);
  EXPECT_NE(html.find("max_force_n = 100"), html.npos) << "the scene's text";

  ASSERT_EQ(limber_program({"report", out(), "-o", out("again.html")}).code, exit_done);
  EXPECT_TRUE(read_file(out("again.html")) == html);
}

TEST_F(Report, ShowsTheFilmOfThisPlanAlone) {
  ASSERT_EQ(limber_program({"run", scene(), "-o", out()}).code, exit_done);
  EXPECT_EQ(limber_program({"report", out(), "--json"}).json().at("film"), "embedded");
  EXPECT_EQ(count_of(page(), "data:video/mp4;base64,AAAA"), 1);
  ASSERT_NE(limber_program({"plan", scene(), "-o", out(), "--seed", "2"}).code, exit_bad_input);
  const Result other = limber_program({"report", out(), "--json"});
  EXPECT_EQ(other.json().at("film"), "left out: of another plan");
  EXPECT_NE(other.err.find("limber render"), std::string::npos) << other.err;
  EXPECT_EQ(count_of(page(), "data:video"), 0);
}

TEST_F(Report, WrongInputIsTold) {
  const Result unplanned = limber_program({"report", out()});
  EXPECT_EQ(unplanned.code, exit_bad_input);
  EXPECT_NE(unplanned.err.find("limber plan"), std::string::npos) << unplanned.err;
  plan();
  const Result nowhere =
      limber_program({"report", out(), "-o", out("none/page.html")});  // told before the work
  EXPECT_EQ(nowhere.code, exit_bad_input);
  EXPECT_NE(nowhere.err.find("there is no folder"), std::string::npos) << nowhere.err;
}

TEST_F(Report, ABrowserPlaysIt) {
  ASSERT_EQ(limber_program({"run", scene(), "-o", out()}).code, exit_done);
  ASSERT_EQ(limber_program({"report", out()}).code, exit_done);
  const int status = std::system(
      (std::string(limber_source_dir) + "/tools/check_report '" + out() + "/report.html'").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77)
    GTEST_SKIP() << "chromium or playwright-core (tools/install-node-tools) is missing";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace limber::detail
