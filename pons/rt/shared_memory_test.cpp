#include "pons/rt/shared_memory.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "pons/rt/ring.hpp"
#include "pons/rt/triple_buffer.hpp"
#include "pons/rt/wake_word.hpp"

namespace pons::rt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

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
  const std::string name_ = "test." + std::to_string(getpid()) + ".rt";
  const std::string path_ = "/dev/shm/pons." + name_;
  ~SharedMemoryTest() override {
    std::error_code ignored;
    for (const std::string& file : files()) std::filesystem::remove(file, ignored);
  }
  // Of this name, or of one that begins with it.
  std::vector<std::string> files() const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
      if (entry.path().string().starts_with(path_)) found.push_back(entry.path());
    }
    return found;
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

// Every word of an element repeats its number.
struct Element {
  std::array<std::uint64_t, 64> words{};
  [[nodiscard]] bool whole() const {
    return std::ranges::all_of(words, [&](std::uint64_t word) { return word == words[0]; });
  }
  static Element of(std::uint64_t number) {
    Element element;
    element.words.fill(number);
    return element;
  }
};
struct Both {
  static constexpr std::uint64_t kVersion = 9;
  SpscRing<Element, 64> down;
  std::atomic<std::size_t> first{0};
  TripleBuffer<Element> up;
  std::atomic<std::uint64_t> torn{0};
};

// The user is killed again and again wherever it is in a push or read; the next one goes on.
TEST_F(SharedMemoryTest, AUserThatIsKilledLeavesItsChannelsUsable) {
  constexpr int kKills = 40;
  const auto owner = Shared<Both>::make(name_);
  ASSERT_TRUE(owner) << owner.error().line();
  Both& both = **owner;
  const auto work = [this](std::uint64_t sender) {
    const auto user = Shared<Both>::open(name_);
    if (!user) return 1;
    (*user)->first.store((*user)->down.take_over());
    std::uint64_t last = 0;
    for (std::uint64_t i = 1;; ++i) {
      (void)(*user)->down.push(Element::of((sender << 32U) + i));
      const Element& state = (*user)->up.read();
      if (!state.whole() || state.words[0] < last) (*user)->torn.fetch_add(1);
      last = state.words[0];
    }
  };
  std::uint64_t written = 0, newest = 0, popped = 0;
  for (std::uint64_t sender = 1; sender <= kKills; ++sender) {
    const pid_t child = in_a_process([&] { return work(sender); });
    Element got;
    for (std::uint64_t of_this = 0; of_this < 500 + 37 * sender;) {
      both.up.write(Element::of(++written));
      both.down.drop_before(both.first.load());
      if (!both.down.pop(got)) continue;
      ASSERT_TRUE(got.whole());
      ASSERT_GT(got.words[0], newest);
      newest = got.words[0];
      of_this += newest >> 32U == sender ? 1U : 0U;
      ++popped;
    }
    kill(child, SIGKILL);
    ASSERT_EQ(wait_for(child), -SIGKILL);
  }
  EXPECT_GT(popped, 20'000U);
  EXPECT_EQ(both.torn.load(), 0U);
  EXPECT_EQ(both.up.read().words[0], written);
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

TEST_F(SharedMemoryTest, ThatIsNoMemoryOfPonsIsRefusedWhateverItsSize) {
  const auto owner = Shared<Channel>::make(name_);
  ASSERT_TRUE(owner) << owner.error().line();
  EXPECT_EQ(open_error<Channel>(), "opened");
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.put('q');
  }
  EXPECT_THAT(open_error<Channel>(), HasSubstr("is not shared memory of Pons, or not whole"));
}

TEST_F(SharedMemoryTest, NobodySeesItBeforeItIsPublished) {
  const SharedMemory::Layout layout{4096, 1};
  auto memory = SharedMemory::make(name_, layout);
  ASSERT_TRUE(memory) << memory.error().line();
  EXPECT_FALSE(SharedMemory::open(name_, layout));
  EXPECT_THAT(files(), IsEmpty());
  ASSERT_TRUE(memory->publish());
  EXPECT_TRUE(SharedMemory::open(name_, layout));
  EXPECT_THAT(files(), ElementsAre(path_));
}

TEST_F(SharedMemoryTest, AnOwnerThatIsKilledBeforeItPublishesLeavesNothing) {
  const pid_t child = in_a_process([&] {
    const auto memory = SharedMemory::make(name_, {4096, 1});
    if (memory) kill(getpid(), SIGKILL);
    return 1;
  });
  EXPECT_EQ(wait_for(child), -SIGKILL);
  EXPECT_THAT(files(), IsEmpty());
}

// Whatever a link is called, nobody else's is in its way: not what one makes that is called by part of its name.
TEST_F(SharedMemoryTest, NamesThatBeginAlikeAreStrangers) {
  const auto longer = Shared<Channel>::make(name_ + "." + std::to_string(getpid()));
  ASSERT_TRUE(longer) << longer.error().line();
  {
    const auto owner = Shared<Channel>::make(name_);
    ASSERT_TRUE(owner) << owner.error().line();
    EXPECT_THAT(files(), SizeIs(2));
  }
  const auto user = Shared<Channel>::open(name_ + "." + std::to_string(getpid()));
  ASSERT_TRUE(user) << user.error().line();
  EXPECT_TRUE(longer->other_lives());
}

TEST_F(SharedMemoryTest, AnotherUsersIsSaidToBe) {
  const auto owner = Shared<Channel>::make(name_);
  ASSERT_TRUE(owner) << owner.error().line();
  ASSERT_EQ(chmod(path_.c_str(), 0), 0);  // as for a stranger
  const pid_t child = in_a_process([&] {
    constexpr uid_t kNobody = 65'534;
    if (geteuid() == 0 && setresuid(kNobody, kNobody, kNobody) != 0) return 1;
    const auto is_told = [](const auto& shared) {
      return !shared && shared.error().line().find("run both sides as one user") != std::string::npos;
    };
    if (!is_told(Shared<Channel>::open(name_))) return 2;
    if (!is_told(Shared<Channel>::make(name_))) return 3;
    return 0;
  });
  EXPECT_EQ(wait_for(child), 0);
}

TEST_F(SharedMemoryTest, NamesAreNoPaths) {
  for (const std::string& name : {std::string(), std::string("../x"), std::string("a/b"), std::string(201, 'a')}) {
    EXPECT_FALSE(Shared<Channel>::make(name)) << name;
    EXPECT_FALSE(Shared<Channel>::open(name)) << name;
  }
}

// Two that begin at once: the one that is published first has the name.
TEST_F(SharedMemoryTest, OfTwoMakersOneHasTheName) {
  const SharedMemory::Layout layout{4096, 1};
  auto first = SharedMemory::make(name_, layout), second = SharedMemory::make(name_, layout);
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  ASSERT_TRUE(first->publish());
  const auto late = second->publish();
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().what, "another process owns it");
  EXPECT_EQ(files().size(), 1U);
}

}  // namespace
}  // namespace pons::rt
