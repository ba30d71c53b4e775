#include "pons/task/spelling.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace pons::task
