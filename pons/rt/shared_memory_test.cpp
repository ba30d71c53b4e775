#include "pons/rt/shared_memory.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <functional>

#include "pons/rt/ring.hpp"
#include "pons/rt/wake_word.hpp"

namespace pons::rt {
namespace {

using testing::HasSubstr;

struct Channel {
  static constexpr std::uint64_t kVersion = 7;
  SpscRing<std::uint64_t, 64> down;
  WakeWord word;
};
struct OtherVersion : Channel {
  static constexpr std::uint64_t kVersion = 8;
};
struct OtherSize : Channel {
  std::array<std::uint64_t, 64> more{};
};

class SharedMemoryTest : public testing::Test {
 protected:
  const std::string name_ = "test." + std::to_string(getpid());
  const std::string path_ = "/dev/shm/pons." + name_;
  ~SharedMemoryTest() override {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  template <typename T>
  std::string open_error() const {
    const auto opened = Shared<T>::open(name_);
    return opened ? "opened" : opened.error().line();
  }
};

// A process of its own; it ends with what `body` returns, or by a signal.
pid_t in_a_process(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  return child;
}
int wait_for(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

constexpr timespec kNever{.tv_sec = 1'000'000'000, .tv_nsec = 0};

TEST_F(SharedMemoryTest, ARingAndAWordReachTheOtherProcess) {
  constexpr std::uint64_t kCount = 10'000;
  const auto owner = Shared<Channel>::make(name_);
  ASSERT_TRUE(owner) << owner.error().line();
  const pid_t child = in_a_process([&] {
    const auto user = Shared<Channel>::open(name_);
    if (!user) return 1;
    for (std::uint64_t i = 0; i < kCount;) {
      if ((*user)->down.push(i)) ++i;
    }
    (*user)->word.set(1);
    return 0;
  });
  bool in_order = true;
  std::uint64_t got = 0;
  for (std::uint64_t i = 0; i < kCount;) {
    if (!(*owner)->down.pop(got)) continue;
    in_order = in_order && got == i;
    ++i;
  }
  EXPECT_EQ((*owner)->word.wait(0, kNever), WakeWord::Woken::kChanged);
  EXPECT_EQ(wait_for(child), 0);
  EXPECT_TRUE(in_order);
}

TEST_F(SharedMemoryTest, EachSideSeesTheOtherDieAndAnotherUserMayFollow) {
  auto owner = Shared<Channel>::make(name_);
  ASSERT_TRUE(owner) << owner.error().line();
  EXPECT_FALSE(owner->other_lives());
  const pid_t child = in_a_process([&] {
    const auto user = Shared<Channel>::open(name_);
    if (!user || !user->other_lives()) return 1;
    (*user)->word.set(1);
    pause();
    return 2;
  });
  ASSERT_EQ((*owner)->word.wait(0, kNever), WakeWord::Woken::kChanged);
  EXPECT_TRUE(owner->other_lives());
  EXPECT_THAT(open_error<Channel>(), HasSubstr("another process uses it"));
  kill(child, SIGKILL);
  EXPECT_EQ(wait_for(child), -SIGKILL);
  EXPECT_FALSE(owner->other_lives());
  const auto next = Shared<Channel>::open(name_);
  ASSERT_TRUE(next) << next.error().line();
  EXPECT_TRUE(owner->other_lives());
  EXPECT_TRUE(next->other_lives());
  {
    const auto gone = std::move(*owner);
    EXPECT_TRUE(gone.other_lives());
  }
  EXPECT_FALSE(next->other_lives());
  EXPECT_EQ((*next)->word.value(), 1U) << "the user keeps its pages";
}

TEST_F(SharedMemoryTest, AnOwnerThatWasKilledLeavesNothingInTheWayOfTheNext) {
  const pid_t child = in_a_process([&] {
    const auto owner = Shared<Channel>::make(name_);
    if (owner) kill(getpid(), SIGKILL);
    return 1;
  });
  EXPECT_EQ(wait_for(child), -SIGKILL);
  EXPECT_THAT(open_error<Channel>(), HasSubstr("its owner has died"));
  const auto next = Shared<Channel>::make(name_);
  ASSERT_TRUE(next) << next.error().line();
  EXPECT_EQ(open_error<Channel>(), "opened");
}

TEST_F(SharedMemoryTest, WhatIsNotWholeOrOfAnotherVersionIsRefused) {
  EXPECT_THAT(open_error<Channel>(), HasSubstr("nobody owns it"));
  {
    const auto owner = Shared<Channel>::make(name_);
    ASSERT_TRUE(owner) << owner.error().line();
    EXPECT_THAT(open_error<OtherVersion>(), HasSubstr("is of version 7 with"));
    EXPECT_THAT(open_error<OtherSize>(), HasSubstr("run both sides from one build"));
    const auto second = Shared<Channel>::make(name_);
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().line(), HasSubstr("another process owns it"));
    EXPECT_EQ(open_error<Channel>(), "opened");
    ASSERT_EQ(truncate(path_.c_str(), 8192), 0);
    EXPECT_THAT(open_error<Channel>(), HasSubstr("run both sides from one build"));
    ASSERT_EQ(truncate(path_.c_str(), 100), 0);
    EXPECT_THAT(open_error<Channel>(), HasSubstr("not whole"));
  }
  EXPECT_FALSE(std::filesystem::exists(path_)) << "it goes with its owner";
}

TEST_F(SharedMemoryTest, NobodySeesItBeforeItIsPublished) {
  const SharedMemory::Layout layout{4096, 1};
  auto memory = SharedMemory::make(name_, layout);
  ASSERT_TRUE(memory) << memory.error().line();
  EXPECT_FALSE(SharedMemory::open(name_, layout));
  ASSERT_TRUE(memory->publish());
  EXPECT_TRUE(SharedMemory::open(name_, layout));
}

TEST_F(SharedMemoryTest, NamesAreNoPaths) {
  for (const std::string& name : {std::string(), std::string("../x"), std::string("a/b"), std::string(201, 'a')}) {
    EXPECT_FALSE(Shared<Channel>::make(name)) << name;
    EXPECT_FALSE(Shared<Channel>::open(name)) << name;
  }
}

}  // namespace
}  // namespace pons::rt
