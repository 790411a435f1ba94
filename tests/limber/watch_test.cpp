// When --watch reads files again, told by what it sees of them look by look.
#include "limber/edits.h"

#include <gtest/gtest.h>

#include "tests/core/temporary_folder.h"

namespace limber::detail {
namespace {

using Look = std::vector<Stamp>;
constexpr Stamp missing;

// How many looks were answered by yes, and the last of them, from 1.
std::pair<int, int> answers(const Look& read, const std::vector<Look>& looks) {
  Edits edits(read);
  std::pair<int, int> yes{0, 0};
  for (std::size_t i = 0; i < looks.size(); ++i)
    if (edits.are_done(looks[i])) ++yes.first, yes.second = int(i) + 1;
  return yes;
}

TEST(Watch, FilesAreReadAgainOnceAfterAChangeThatIsOver) {
  const Stamp old{100, 1}, same_size{100, 2}, longer{120, 2}, half{60, 3}, whole{140, 4};
  EXPECT_EQ(answers({old}, {{old}, {old}, {old}}), std::pair(0, 0));
  EXPECT_EQ(answers({old}, {{old}, {same_size}, {same_size}, {same_size}}), std::pair(1, 3));
  EXPECT_EQ(answers({old}, {{longer}, {longer}, {longer}}), std::pair(1, 2));
  // While it is written, and where it is put in the place of what was removed.
  EXPECT_EQ(answers({old}, {{half}, {whole}, {whole}, {whole}}), std::pair(1, 3));
  EXPECT_EQ(answers({old}, {{missing}, {missing}, {missing}, {whole}, {whole}}), std::pair(1, 5));
  // Removed and put back as it was: nothing new.
  EXPECT_EQ(answers({old}, {{missing}, {missing}, {old}, {old}}), std::pair(0, 0));
  // Each change for itself; back to an older file is a change, too.
  EXPECT_EQ(answers({old}, {{longer}, {longer}, {old}, {old}, {old}}), std::pair(2, 4));
  // Any of several.
  EXPECT_EQ(answers({old, old}, {{old, longer}, {old, longer}}), std::pair(1, 2));
  EXPECT_EQ(answers({old, old}, {{longer, missing}, {longer, missing}}), std::pair(0, 0));
}

TEST(Watch, AFileInThePlaceOfAnotherHasAnotherStamp) {
  TemporaryFolder folder;
  const std::vector<fs::path> files{folder / "a", folder / "none"};
  write_file(files[0], "one");
  const Look before = stamps_of(files);
  EXPECT_EQ(before[0].bytes, 3);
  EXPECT_EQ(before[1], missing);
  EXPECT_EQ(stamps_of(files), before);
  write_file(folder / "b", "three");
  fs::rename(folder / "b", files[0]);
  EXPECT_NE(stamps_of(files)[0], before[0]);
}

}  // namespace
}  // namespace limber::detail
