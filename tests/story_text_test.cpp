// The lines of a task's history.
#include "apps/story_text.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace pons::apps {
namespace {

// What a line says of an event beside time, task and kind.
std::string told(std::string_view kind, const task::Json& detail) {
  const std::string line = story_line({{"time_s", 12.5}, {"task", "P1"}, {"kind", kind}, {"detail", detail}});
  const std::string before = "    12.500 s  P1             ";
  EXPECT_EQ(line.substr(0, before.size()), before);
  EXPECT_EQ(line.substr(before.size(), kind.size()), kind);
  const auto text = line.find_first_not_of(' ', before.size() + kind.size());
  return line.substr(text, line.find('\n') - text);
}

TEST(StoryText, SaysWhereAParcelIsThatWasNotCounted) {
  EXPECT_EQ(told("stray", {{"code", "P1"}, {"fell_into", "chute_3"}}), "fell into chute_3");
  EXPECT_EQ(told("stray", {{"code", "P1"}, {"fell_into", ""}}), "its chute's light curtain has not counted it");
  EXPECT_EQ(told("stray", {{"code", ""}, {"fell_into", "chute_1"}}), "a parcel that nobody has read fell into chute_1");
  EXPECT_EQ(told("stray", {{"code", ""}, {"fell_into", ""}}),
            "a parcel that nobody has read hung on another that fell, and no camera has seen it since");
}

TEST(StoryText, SaysThatAnotherWasTakenForIt) {
  EXPECT_EQ(told("mistaken", {{"code", "P1"}, {"track", 7}}), "track 7 is larger: another");
}

TEST(StoryText, SaysWhatTheCupsHold) {
  EXPECT_EQ(told("carries", {{"load", nullptr}}), "the cups hold nothing");
  EXPECT_EQ(told("carries", {{"load", {{"code", "P1"}, {"mass_kg", 0.0}}}}), "the cups hold P1, not weighed yet");
  EXPECT_EQ(told("carries", {{"load", {{"code", "P1"}, {"mass_kg", 1.25}}}}), "the cups hold P1, 1.25 kg");
  EXPECT_EQ(told("carries", {{"load", {{"code", "P1"}, {"mass_kg", 1.25}, {"gone", true}}}}), "the cups have lost P1");
}

TEST(StoryText, SaysHowATaskEnded) {
  EXPECT_EQ(told("ended", {{"outcome", "SUCCEEDED"}, {"reason", ""}, {"detail", task::Json::object()}}), "SUCCEEDED");
  EXPECT_EQ(told("ended", {{"outcome", "FAILED"}, {"reason", "dropped"}, {"detail", {{"stop", "CONFIRMED"}}}}),
            "FAILED: dropped; standstill CONFIRMED");
}

TEST(StoryText, SaysWhatWasRefused) {
  EXPECT_EQ(told("refused", {{"id", "P1"}, {"reason", "not JSON"}, {"text", "{"}}), "not JSON; sent: {");
  EXPECT_EQ(told("refused", {{"id", ""}, {"reason", "not JSON"}, {"text", "{"}, {"untold", 30}}),
            "not JSON; sent: {; and 30 more before it");
  EXPECT_EQ(told("refused", {{"skill", "pick"}, {"reason", "too heavy"}}), "too heavy");
}

TEST(StoryText, WhatItDoesNotKnowIsShownAsItIs) {
  EXPECT_EQ(told("novel", {{"a", 1}}), "{\"a\":1}");
  EXPECT_EQ(told("stray", "no object"),
            "a parcel that nobody has read hung on another that fell, and no camera has seen it since");
}

}  // namespace
}  // namespace pons::apps
