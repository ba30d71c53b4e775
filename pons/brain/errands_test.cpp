#include "pons/brain/errands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pons::brain {
namespace {

using ::testing::ElementsAre;

Errand errand(const std::string& id, double at_s) { return {{{"id", id}}, Time(from_s(at_s))}; }

std::vector<std::string> asked(Errands& errands, double now_s) {
  std::vector<std::string> ids;
  for (const Json& task : errands.observe({}, Time(from_s(now_s)), {}).tasks) ids.push_back(task.at("id"));
  return ids;
}

TEST(Errands, EachIsAskedForOnceAndAtItsTime) {
  Errands errands({errand("late", 4), errand("first", 0), errand("second", 0)});
  EXPECT_TRUE(errands.waits());
  EXPECT_THAT(asked(errands, 0.01), ElementsAre("first", "second"));
  EXPECT_TRUE(errands.waits()) << "one comes yet: the run must go on";
  EXPECT_THAT(asked(errands, 3.99), ElementsAre());
  EXPECT_THAT(asked(errands, 4), ElementsAre("late"));
  EXPECT_THAT(asked(errands, 5), ElementsAre());
  EXPECT_FALSE(errands.waits());
  EXPECT_TRUE(errands.heard("late", task::Outcome::kSucceeded));
  EXPECT_FALSE(errands.heard("somebody else's", task::Outcome::kSucceeded));
}

TEST(Errands, WhatAnEarlierOneAskedForIsNotAskedForAgain) {
  Errands errands({errand("a", 0), errand("b", 0)});
  errands.recall({.id = "a"}, std::nullopt);
  EXPECT_THAT(asked(errands, 1), ElementsAre("b"));
}

}  // namespace
}  // namespace pons::brain
