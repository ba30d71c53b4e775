#include "pons/rt/clock.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace pons::rt {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

constexpr Duration kLeash = milliseconds(2);

void spin(Duration length) {
  const MonotonicClock clock;
  while (clock.now() < Time(length)) {
  }
}

TEST(MonotonicClock, RunsFreeWithoutALeash) {
  const MonotonicClock clock;
  spin(milliseconds(5));
  EXPECT_GE(clock.now(), Time(milliseconds(5)));
  EXPECT_EQ(clock.stood_still(), Duration{0});
}

TEST(MonotonicClock, OnALeashItStandsStillUntilItsPacerComesAndGoesOnFromThere) {
  MonotonicClock clock(kLeash);
  spin(milliseconds(10));
  EXPECT_EQ(clock.now(), Time(kLeash));
  clock.reach(Time(milliseconds(1)));
  EXPECT_GE(clock.now(), Time(kLeash));
  EXPECT_LE(clock.now(), Time(milliseconds(1) + kLeash));
  EXPECT_GE(clock.stood_still(), milliseconds(8));
  spin(milliseconds(5));
  EXPECT_EQ(clock.now(), Time(milliseconds(1) + kLeash));
}

TEST(MonotonicClock, WhatItStoodStillIsInItsAbsoluteTimes) {
  MonotonicClock clock(kLeash);
  const timespec before = clock.absolute(Time(kLeash));
  spin(milliseconds(10));
  clock.reach(Time(milliseconds(1)));
  const timespec after = clock.absolute(Time(kLeash));
  const auto ns = [](const timespec& t) { return t.tv_sec * 1'000'000'000LL + t.tv_nsec; };
  EXPECT_EQ(ns(after) - ns(before), clock.stood_still().count());
}

TEST(MonotonicClock, LetGoItRunsFree) {
  MonotonicClock clock(kLeash);
  clock.let_go();
  spin(milliseconds(5));
  EXPECT_GT(clock.now(), Time(kLeash));
  EXPECT_LT(clock.now(), Time(hours(1)));
}

TEST(MonotonicClock, NeverGoesBackWhileItsPacerStumbles) {
  MonotonicClock clock(Duration{50'000});
  std::thread pacer([&] {
    for (int i = 1; i <= 2000; ++i) {
      if (i % 50 == 0) spin(Duration{200'000});
      clock.reach(clock.now());
    }
    clock.let_go();
  });
  Time last;
  bool back = false;
  while (last < Time(milliseconds(20))) {
    const Time now = clock.now();
    back = back || now < last;
    last = now;
  }
  pacer.join();
  EXPECT_FALSE(back);
}

}  // namespace
}  // namespace pons::rt
