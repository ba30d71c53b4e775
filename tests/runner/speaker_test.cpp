// The voice: a child process beside the bridge's thread.

#include "pons/runner/speaker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

namespace pons::runner {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SpeakerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  static Time at(double seconds) { return Time(from_s(seconds)); }
  // A program that speaks like espeak-ng, but otherwise.
  std::string program(const std::string& script) {
    const fs::path file = folder_ / "program";
    std::ofstream(file) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(file, fs::perms::owner_all);
    return file.string();
  }

  fs::path folder_;
};

TEST_F(SpeakerTest, SpeaksForAsLongAsItIsHeard) {
  Speaker speaker(folder_, Pace::kLockstep);
  ASSERT_TRUE(speaker.begin("Good morning.", at(5)));
  EXPECT_FALSE(speaker.look(at(5.09)));
  ASSERT_FALSE(speaker.look(at(5.1))) << "it is made by now, and not heard yet";
  const double length_s = wav_length_s(folder_ / "speech_001.wav").value_or(0);
  EXPECT_GT(length_s, 0.4);
  EXPECT_FALSE(speaker.look(at(5.1 + length_s - 0.001)));
  const auto spoken = speaker.look(at(5.1 + length_s + 0.001));
  ASSERT_TRUE(spoken && *spoken);
  EXPECT_EQ((*spoken)->length_s, length_s);
  EXPECT_EQ((*spoken)->file, "speech_001.wav");
}

TEST_F(SpeakerTest, WhatIsSaidIsText) {
  Speaker speaker(folder_, Pace::kLockstep);
  ASSERT_TRUE(speaker.begin("--version; $(touch here)", at(0)));
  const auto spoken = speaker.look(at(1000));
  ASSERT_TRUE(spoken && *spoken) << spoken->error().line();
  EXPECT_GT((*spoken)->length_s, 0.5) << "neither an option nor a command";
}

TEST_F(SpeakerTest, OneAtATimeAndStoppedItMayBeginAnew) {
  Speaker speaker(folder_, Pace::kLockstep, program("exec sleep 30"));
  ASSERT_TRUE(speaker.begin("one", at(0)));
  const auto second = speaker.begin("two", at(0));
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().line(), HasSubstr("it speaks already"));
  const auto began = std::chrono::steady_clock::now();
  speaker.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(10)) << "the program was ended";
  EXPECT_TRUE(speaker.begin("two", at(0)));
}

TEST_F(SpeakerTest, ByTheClockItNeverWaitsForTheProgram) {
  Speaker speaker(folder_, Pace::kRealTime, program("exec sleep 30"));
  ASSERT_TRUE(speaker.begin("one", at(0)));
  const auto began = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(speaker.look(at(i)));
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(5));
}

TEST_F(SpeakerTest, SaysWhatFailed) {
  const auto error = [&](const std::string& name) {
    Speaker speaker(folder_, Pace::kLockstep, name);
    if (!speaker.begin("x", at(0))) return std::string("does not begin");
    const auto spoken = speaker.look(at(1));
    return spoken && !*spoken ? spoken->error().line() : std::string("no error");
  };
  EXPECT_THAT(error("/nowhere/espeak"), HasSubstr("cannot be started: No such file"));
  EXPECT_THAT(error(program("exit 3")), HasSubstr("ended without having spoken"));
  EXPECT_THAT(error(program("exit 0")), HasSubstr("is no WAV file"));
  EXPECT_THAT(error(program("printf RIFF0000WAVEdata0000 > \"$2\"")), HasSubstr("is no WAV file"));
}

}  // namespace
}  // namespace pons::runner
