// A label of a scan, from its voxels to a body.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/cli/program.h"
#include "tests/imaging/made_maps.h"

namespace limber::detail {
namespace {

// Two balls of 8 mm that touch, and two voxels on their own.
std::string two_balls(const fs::path& file) {
  const Eigen::Matrix3d axes = Vec3(-0.001, 0.001, 0.0012).asDiagonal();
  imaging::LabelMap map = imaging::made_map({44, 24, 20}, axes, Vec3(0.04, -0.01, 0.1), [](const Vec3& p) {
    if ((p - Vec3(0.0264, 0.0012, 0.1112)).norm() < 0.008) return 1;
    if ((p - Vec3(0.0104, 0.0012, 0.1112)).norm() < 0.008) return 2;
    return p.y() < -0.0095 && p.z() < 0.1005 && p.x() > 0.0385 ? 1 : 0;
  });
  map.labels = {0, 5, 17};
  imaging::write_nifti(file, map);
  return file.string();
}

TEST_F(Program_slow, ALabelOfAScanIsPreparedWhereItIs) {
  const std::string scan = two_balls(folder / "scan.nii.gz");
  const Json listed = limber_program({"info", scan, "--json"}).json();
  ASSERT_EQ(listed.at("labels").size(), 2u);
  EXPECT_EQ(listed.at("labels")[1].at("label"), 17);

  const std::vector<std::string> words{"prepare", scan,     "--label", "5",     "-o",
                                       out(),     "--tets", "100",     "--json"};
  const Result made = limber_program(words);
  ASSERT_EQ(made.code, exit_done) << made.err;
  const Json report = made.json(), &surface = report.at("surface");
  const double ball_m3 = 4 * std::numbers::pi / 3 * 0.008 * 0.008 * 0.008;
  EXPECT_NEAR(surface.at("volume_m3").get<double>(), ball_m3, 0.02 * ball_m3);
  EXPECT_NEAR(surface.at("lower_m")[0].get<double>(), 0.0184, 0.0005);
  EXPECT_NEAR(surface.at("upper_m")[2].get<double>(), 0.1192, 0.0006);
  EXPECT_NE(report.at("mended").dump().find("left out 1 pieces"), std::string::npos) << report.at("mended");
  EXPECT_TRUE(report.at("certificate").at("holds"));
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);
  // It is of that label and its settings.
  EXPECT_NE(limber_program(words).err.find("up to date"), std::string::npos);
  std::vector<std::string> wider = words;
  wider.insert(wider.end(), {"--label-gap", "0.4"});
  EXPECT_EQ(limber_program(wider).err.find("up to date"), std::string::npos);

  const auto refused = [&](std::vector<std::string> more, const char* what) {
    std::vector<std::string> all{"prepare", scan, "-o", out("none")};
    all.insert(all.end(), more.begin(), more.end());
    const Result result = limber_program(all);
    EXPECT_EQ(result.code, exit_bad_input);
    EXPECT_NE(result.err.find(what), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(out("none")));
  };
  refused({}, "choose what is to be prepared with --label");
  refused({"--label", "6"}, "it has 5, 17");
  refused({"--label", "5", "--y-up"}, "leave --y-up out");
  refused({"--label", "17", "--least-island", "1e6"}, "label 17: all of its 1 pieces");
  EXPECT_EQ(limber_program({"prepare", scene(), "--label", "5", "-o", out("none")}).code, exit_bad_input);
}

}  // namespace
}  // namespace limber::detail
