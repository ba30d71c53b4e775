#include "pons/record/file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

#include "pons/record/new_file.hpp"
#include "pons/record/test_recording.hpp"

namespace pons::record {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class FileTest : public ::testing::Test {
 protected:
  FileTest() : folder_(fs::temp_directory_path() / ("pons_file_test_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~FileTest() override { fs::remove_all(folder_); }

  [[nodiscard]] static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  fs::path folder_;
};

TEST_F(FileTest, WritesAndReplaces) {
  const fs::path path = folder_ / "a.json";
  ASSERT_TRUE(write_whole(path, "a longer first text"));
  EXPECT_EQ(read(path), "a longer first text");
  ASSERT_TRUE(write_whole(path, std::string_view("b\0c", 3)));
  EXPECT_EQ(read(path), std::string("b\0c", 3));
  EXPECT_EQ(files(), 1);
}

TEST_F(FileTest, KeepsALinkALink) {
  const fs::path link = folder_ / "link.json";
  ASSERT_TRUE(write_whole(folder_ / "target.json", "old"));
  fs::create_symlink("target.json", link);
  ASSERT_TRUE(write_whole(link, "new"));
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(read(folder_ / "target.json"), "new");
}

TEST_F(FileTest, WhatReplacesAFileHasItsMode) {
  const auto mode = [](const fs::path& path) { return fs::status(path).permissions(); };
  const fs::path path = folder_ / "secret.json", link = folder_ / "link.json";
  constexpr fs::perms kOurs = fs::perms::owner_read | fs::perms::owner_write, kAll = kOurs | fs::perms::others_read;
  ASSERT_TRUE(write_whole(path, "old"));
  fs::create_symlink("secret.json", link);
  for (const fs::perms kept : {kOurs, kAll}) {
    fs::permissions(path, kept);
    ASSERT_TRUE(write_whole(path, "new"));
    EXPECT_EQ(mode(path), kept);
    auto file = NewText::create(link, Overwrite::kAllowed);
    ASSERT_TRUE(file && file->add("newer"));
    for (const auto& each : fs::directory_iterator(folder_)) {
      EXPECT_EQ(mode(each.path()), kept) << each.path() << ": also while it is written";
    }
    ASSERT_TRUE(file->end());
    EXPECT_EQ(mode(path), kept);
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_EQ(read(path), "newer");
  }
}

TEST_F(FileTest, ALinkThatLeadsNowhereIsANameThatIsTaken) {
  const fs::path link = folder_ / "link.json";
  fs::create_symlink("nowhere.json", link);
  const auto refused = NewText::create(link, Overwrite::kNever);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().line(), HasSubstr("link.json: there is such a file already"));
  auto file = NewText::create(link, Overwrite::kAllowed);
  ASSERT_TRUE(file && file->add("new") && file->end());
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(read(folder_ / "nowhere.json"), "new");
}

TEST_F(FileTest, SaysWhatWhereAndHowToMend) {
  const auto missing = write_whole(folder_ / "nowhere" / "a.json", "x");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().line(),
            (folder_ / "nowhere").string() + ": the folder does not exist; create it or choose another path");

  const auto directory = write_whole(folder_, "x");
  ASSERT_FALSE(directory);
  EXPECT_THAT(directory.error().line(), HasSubstr("is a folder"));

  const auto device = write_whole("/dev/null", "x");
  ASSERT_FALSE(device);
  EXPECT_THAT(device.error().line(), HasSubstr("is not a regular file"));

  ASSERT_FALSE(write_whole("", "x"));
  const auto kernel = check_writable("/proc/a.json");
  // Root may write into a folder without permission, but nobody creates a file in /proc.
  const auto written = write_whole("/proc/a.json", "x");
  EXPECT_FALSE(kernel && written);
  EXPECT_EQ(files(), 0);
}

// A full disk, as the file size limit plays it: the old file stays, and no part of the new one does.
TEST_F(FileTest, LeavesTheOldFileWhenTheDiskIsFull) {
  const fs::path path = folder_ / "a.json";
  ASSERT_TRUE(write_whole(path, "old"));

  const auto full = [&] {
    const FullDisk limit(1000);
    return write_whole(path, std::string(4000, 'x'));
  }();
  ASSERT_FALSE(full);
  EXPECT_THAT(full.error().line(), HasSubstr("cannot write"));
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(files(), 1);
}

// Not that of the file which would have become it.
TEST_F(FileTest, WhatCannotBeWrittenHasTheNameThatItWasGiven) {
  const fs::path path = folder_ / "a.jsonl";
  {
    auto file = NewText::create(path, Overwrite::kNever);
    ASSERT_TRUE(file) << file.error().line();
    const FullDisk limit(1000);
    const auto full = file->add(std::string(100'000, 'x'));
    ASSERT_FALSE(full);
    EXPECT_THAT(full.error().line(), StartsWith(path.string() + ": cannot write: "));
  }
  EXPECT_EQ(files(), 0);
}

TEST_F(FileTest, AsksWithoutWriting) {
  EXPECT_TRUE(check_writable(folder_ / "a.json"));
  EXPECT_EQ(files(), 0);
}

}  // namespace
}  // namespace pons::record
