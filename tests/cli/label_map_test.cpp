// A label of a scan, from its voxels to a body.
#include <gtest/gtest.h>

#include <numbers>

#include "imaging/label_map.h"
#include "limber/detail/body/model_content.h"
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

// The same as NRRD, raw: limber writes none.
std::string as_nrrd(const fs::path& nifti, const fs::path& file) {
  const imaging::LabelMap map = imaging::read_label_map(nifti);
  std::string header = "NRRD0005\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes:";
  for (int a = 0; a < 3; ++a) header += fmt::format(" {}", map.size[a]);
  header += "\nspace directions:";
  for (int a = 0; a < 3; ++a)
    header +=
        fmt::format(" ({},{},{})", 1000 * map.axes_m(0, a), 1000 * map.axes_m(1, a), 1000 * map.axes_m(2, a));
  header += fmt::format("\nspace origin: ({},{},{})\nencoding: raw\n\n", 1000 * map.origin_m[0],
                        1000 * map.origin_m[1], 1000 * map.origin_m[2]);
  std::string voxels;
  for (const auto row : map.material) voxels += char(map.labels[row]);
  write_file(file, header + voxels);
  return file.string();
}

// A body says of which label of which scan it is. Who changes that, or the scan, or puts another label's body
// there, and makes the rest fit, is found by the scan.
TEST_F(Program_slow, ABodyOfAScanIsOfItsLabel) {
  const std::string nifti = two_balls(folder / "scan.nii.gz"), nrrd = as_nrrd(nifti, folder / "scan.nrrd");
  for (const std::string& scan : {nifti, nrrd}) {
    SCOPED_TRACE(scan);
    const auto prepare = [&](const std::string& label, const std::string& to) {
      fs::remove_all(to);
      ASSERT_EQ(
          limber_program({"prepare", scan, "--label", label, "-o", to, "--tets", "60", "--shells", "2"}).code,
          exit_done);
    };
    prepare("5", out("five")), prepare("17", out("seventeen"));
    const auto verified = [&](const std::string& body, const std::string& model) {
      return limber_program({"verify", body, "--model", model});
    };
    const Result good = verified(out("five"), scan);
    EXPECT_EQ(good.code, exit_done) << good.out << good.err;
    EXPECT_NE(good.out.find("body: surface is the model's"), std::string::npos);
    EXPECT_EQ(limber_program({"verify", out("five")}).code, exit_done);
    const auto broken = [&](const std::string& what, const std::string& model, const auto& change,
                            const char* body = "five") {
      fs::remove_all(out("other"));
      fs::copy(out(body), out("other"), fs::copy_options::recursive);
      const fs::path report = fs::path(out("other")) / "report.json";
      Json told = read_json(report);
      change(told.at("input").at("model"));
      write_json(report, told);
      const Result result = verified(out("other"), model);
      EXPECT_EQ(result.code, 1) << what << result.err;
      EXPECT_NE(result.out.find("BROKEN  body: surface is the model's"), std::string::npos)
          << what << result.out;
    };
    broken("another label", scan, [](Json& told) { told.at("label").at("name") = "17"; });
    broken("no such label", scan, [](Json& told) { told.at("label").at("name") = "6"; });
    broken("another gap", scan, [](Json& told) { told.at("label").at("gap") = 0.4; });
    broken("other rounds", scan, [](Json& told) { told.at("label").at("rounds") = 3; });
    broken("other islands", scan, [](Json& told) { told.at("label").at("least_island") = 1; });
    broken("another scale", scan, [](Json& told) { told.at("scale") = 2; });
    broken(
        "another label's body", scan, [](Json& told) { told.at("label").at("name") = "5"; }, "seventeen");
    // Without one voxel in the middle of the ball.
    constexpr std::size_t middle = 13 + 44 * (11 + 24 * 9), voxels = 44 * 24 * 20;
    const fs::path edited = folder / ("edited" + scan.substr(scan.find('.', scan.rfind('/'))));
    std::string bytes = read_file(scan);
    if (scan == nifti) {
      imaging::LabelMap map = imaging::read_label_map(scan);
      map.material[middle] = 0;
      imaging::write_nifti(edited, map);
    } else {
      bytes[bytes.size() - voxels + middle] = 0;
      write_file(edited, bytes);
    }
    broken("another scan", edited.string(), [](Json&) {});
    broken("another scan that it says to be of", edited.string(),
           [&](Json& told) { told.at("file_hash") = content_of_model(edited).file_hash; });
    broken("a model that is no scan", scene(), [&](Json&) {});
  }
  EXPECT_EQ(limber_program({"verify", out("five"), "--model", out("nothing.nii")}).code, exit_bad_input);
}

}  // namespace
}  // namespace limber::detail
