#include "pons/task/spelling.hpp"

#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace pons::task {
namespace {

TEST(Edits, AreTheFewestThatMakeOneOfTheOther) {
  EXPECT_EQ(edits("", ""), 0U);
  EXPECT_EQ(edits("", "abc"), 3U);
  EXPECT_EQ(edits("abc", ""), 3U);
  EXPECT_EQ(edits("place", "place"), 0U);
  EXPECT_EQ(edits("plcae", "place"), 2U);
  EXPECT_EQ(edits("kitten", "sitting"), 3U);
  EXPECT_EQ(edits("sitting", "kitten"), 3U);
  EXPECT_EQ(edits("_onSucces", "_onSuccess"), 1U);
}

TEST(Nearest, IsWhatMayHaveBeenMeant) {
  const std::vector<std::string> names{"book", "run", "replay", "recording"};
  EXPECT_EQ(nearest("runn", names), "run");
  EXPECT_EQ(nearest("recordnig", names), "recording");
  EXPECT_EQ(nearest("foo", names), "") << "two of three characters are not book's";
  EXPECT_EQ(nearest("", names), "");
  EXPECT_EQ(nearest("run", {}), "");
}

}  // namespace
}  // namespace pons::task
