#include "pons/runner/aside.hpp"

#include <gtest/gtest.h>

#include <future>
#include <thread>
#include <vector>

namespace pons::runner {
namespace {

TEST(Aside, DoesWhatCameOneAfterTheOtherOnAThreadOfItsOwn) {
  std::vector<int> done;  // plain: its own locks and the promise must be all that it takes
  std::thread::id by;
  std::promise<void> last;
  Aside aside(100);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(aside.put([&, i] {
      done.push_back(i);
      by = std::this_thread::get_id();
      if (i == 99) last.set_value();
    }));
  }
  last.get_future().wait();
  ASSERT_EQ(done.size(), 100U);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
  EXPECT_NE(by, std::this_thread::get_id());
}

TEST(Aside, WhatFindsNoRoomIsRefusedAndWhatWaitsAtTheEndIsLeft) {
  std::promise<void> begun, go_on;
  int done = 0;
  {
    Aside aside(2);
    ASSERT_TRUE(aside.put([&] {
      begun.set_value();
      go_on.get_future().wait();
      ++done;
    }));
    begun.get_future().wait();
    EXPECT_TRUE(aside.put([] {}));
    EXPECT_TRUE(aside.put([] {}));
    EXPECT_FALSE(aside.put([&] { ++done; }));
    go_on.set_value();
  }
  EXPECT_EQ(done, 1);
}

}  // namespace
}  // namespace pons::runner
