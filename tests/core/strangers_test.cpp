// Files from strangers: no reader waits for ever, eats the memory or falls over, and each says what is wrong.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "core/error.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/npz.h"
#include "tests/core/deflated_zip.h"
#include "tests/core/temporary_folder.h"

namespace limber {
namespace {

std::string complaint(const std::function<void()>& read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Strangers, PipesAndDevicesAreNotRead) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const fs::path& path : {folder / "pipe", fs::path("/dev/zero")})
    EXPECT_NE(complaint([&] { read_file(path); }).find("is a pipe or a device"), std::string::npos) << path;
}

// A file can say that it has more bytes than any disk.
TEST(Strangers, ASizeBeyondTheLimitIsRefusedBeforeItIsRead) {
  const TemporaryFolder folder;
  std::ofstream(folder / "large.npz") << "";
  fs::resize_file(folder / "large.npz", std::uintmax_t(1) << 42);
  EXPECT_NE(complaint([&] { read_npz(folder / "large.npz"); }).find("4398046511104 bytes"),
            std::string::npos);
  fs::resize_file(folder / "large.npz", max_json_bytes + 1);
  EXPECT_NE(complaint([&] { read_json(folder / "large.npz"); }).find("at most 67108864"), std::string::npos);
}

TEST(Strangers, AKeyTwiceIsTwoAnswers) {
  EXPECT_EQ(parse_json(R"({"a": {"b": 1}, "b": {"b": 2}, "c": [{"b": 3}, {"b": 4}]})", "x").size(), 3u);
  for (const char* text : {R"({"a": 1, "a": 1})", R"([{"b": {"a": 1, "c": {"a": 2}, "a": 3}}])"})
    EXPECT_NE(complaint([&] { parse_json(text, "x"); }).find("x: has the key \"a\" twice"), std::string::npos)
        << text;
}

TEST(Strangers, AJsonOfAnyDepthIsAnAnswer) {
  const auto nested = [](int depth) {
    std::string text = "\n";
    for (int i = 0; i < depth; ++i) text += i % 2 ? "{\"a[\\\"\": " : "[\"]]\", ";
    text += "1";
    for (int i = depth; i-- > 0;) text += i % 2 ? '}' : ']';
    return text;
  };
  EXPECT_FALSE(parse_json(nested(max_json_depth), "a").dump().empty());
  EXPECT_NE(complaint([&] { parse_json(nested(max_json_depth + 1), "a"); }).find("a:2: has lists within"),
            std::string::npos);
  EXPECT_NE(complaint([] { parse_json(std::string(200000, '['), "a"); }), "");
}

// 80 MB of zeros in 80 kB.
TEST(Strangers, AZipThatUnpacksToFarMoreThanItHasIsRefused) {
  const TemporaryFolder folder;
  const auto write = [&](std::int64_t numbers) {
    const std::vector<float> zeros(std::size_t(numbers), 0.f);
    std::ofstream(folder / "a.npz", std::ios::binary)
        << deflated_zip("zeros.npy", npy_file(NpyArray::of<float>(zeros, {numbers})));
  };
  write(1'000'000);  // as numpy.savez_compressed may do to what sleeps
  EXPECT_EQ(read_npz(folder / "a.npz").array("zeros").size(), 1'000'000);
  write(20'000'000);
  EXPECT_NE(complaint([&] { read_npz(folder / "a.npz"); }).find("unpacks to more than"), std::string::npos);
}

// A header that explains more than there is costs nothing: no memory is asked for.
TEST(Strangers, AShapeThatTheEntryDoesNotHoldIsRefused) {
  const TemporaryFolder folder;
  std::string npy = npy_file(NpyArray::of<float>(std::vector<float>(4), {4}));
  npy.replace(npy.find("(4,)"), 4, "(9,)");
  std::ofstream(folder / "a.npz", std::ios::binary) << deflated_zip("a.npy", npy);
  EXPECT_NE(complaint([&] { read_npz(folder / "a.npz"); }).find("which its shape does not explain"),
            std::string::npos);
}

// A scene may name any file as a cage.
TEST(Strangers, OfAFileThatIsSomethingElseNothingIsTold) {
  const TemporaryFolder folder;
  std::ofstream(folder / "secret") << "root:x:0:0:root\nmore\n";
  for (const std::string& told :
       {complaint([&] { read_msh(folder / "secret"); }), complaint([&] { read_ply(folder / "secret"); }),
        complaint([&] { read_obj_shells(folder / "secret"); })}) {
    EXPECT_NE(told.find("secret: is not"), std::string::npos) << told;
    EXPECT_EQ(told.find("root"), std::string::npos) << told;
  }
}

}  // namespace
}  // namespace limber
