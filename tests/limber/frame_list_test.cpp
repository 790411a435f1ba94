#include "limber/detail/film/frame_list.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/error.h"

namespace limber::detail {
namespace {

TEST(FrameList, ReadsFramesRangesAndSteps) {
  EXPECT_EQ(parse_frames("3", 10), (std::vector<int>{3}));
  EXPECT_EQ(parse_frames("1-3,5-9:2", 10), (std::vector<int>{1, 2, 3, 5, 7, 9}));
  EXPECT_EQ(parse_frames("1-3,5-9x2", 10), (std::vector<int>{1, 2, 3, 5, 7, 9}));  // as OpenCue writes it
  EXPECT_EQ(parse_frames("9,2-3,3", 10), (std::vector<int>{2, 3, 9}));             // ascending, each once
  EXPECT_EQ(parse_frames("", 3), (std::vector<int>{0, 1, 2}));
}

TEST(FrameList, LeavesOutAndCountsWhatLiesBeyondTheLastFrame) {
  std::int64_t left_out = 0;
  EXPECT_EQ(parse_frames("8-12", 10, &left_out), (std::vector<int>{8, 9}));
  EXPECT_EQ(left_out, 3);
  parse_frames("0,8-2147483647:2,5-2147483647", 10, &left_out);
  EXPECT_EQ(left_out, (2147483646 - 10) / 2 + 1 + (2147483647LL - 10 + 1));
  const auto complaint = [](const std::string& text) {
    try {
      parse_frames(text, 10);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(complaint("5-3").find("ends before it begins; write 3-5"), std::string::npos);
  EXPECT_NE(complaint("0-9:0").find("the step of \"0-9:0\" is 0"), std::string::npos);
  EXPECT_NE(complaint("99999999999").find("above 2147483647"), std::string::npos);
  EXPECT_THROW(chunk_of({0, 1}, "1/99999999999"), InputError);
  EXPECT_THROW(parse_frames("10-12", 10), InputError);
}

TEST(FrameList, SeedsHaveTheSameFormAndNoEnd) {
  EXPECT_EQ(parse_seeds("7,1-3,100-104:2"), (std::vector<int>{1, 2, 3, 7, 100, 102, 104}));
  EXPECT_EQ(parse_seeds("2147483647"), (std::vector<int>{2147483647}));
  for (const char* text : {"", "a", "3-1", "1-2000000", "2147483648"})
    EXPECT_THROW(parse_seeds(text), InputError) << text;
}

TEST(FrameList, RefusesWhatItCannotRead) {
  for (const char* text : {"a", "1-", "-3", "5-3", "1-3:0", "1-3:x", "1-9x2:2", "1-9x", "0x3", "7:2", "1,,2",
                           "1 2", "99999999999999"})
    EXPECT_THROW(parse_frames(text, 100), InputError) << text;
}

TEST(FrameList, ChunksPartitionTheFrames) {
  std::vector<int> frames(17);
  std::iota(frames.begin(), frames.end(), 4);
  for (int n = 1; n <= 20; ++n) {
    std::vector<int> together;
    for (int i = 1; i <= n; ++i) {
      const std::vector<int> part = chunk_of(frames, fmt::format("{}/{}", i, n));
      EXPECT_LE(part.size(), std::size_t(17 / n + 1));
      EXPECT_GE(part.size(), std::size_t(17 / n));
      together.insert(together.end(), part.begin(), part.end());
    }
    EXPECT_EQ(together, frames) << n;
  }
  for (const char* text : {"0/3", "4/3", "1", "1/0", "a/b", "1/3/5"})
    EXPECT_THROW(chunk_of(frames, text), InputError) << text;
}

TEST(FrameList, Sizes) {
  EXPECT_EQ(parse_size("1920x1080"), std::pair(1920, 1080));
  for (const char* text : {"1920", "1920x", "0x0", "15x100", "100x8193", "1920 x 1080"})
    EXPECT_THROW(parse_size(text), InputError) << text;
}

}  // namespace
}  // namespace limber::detail
