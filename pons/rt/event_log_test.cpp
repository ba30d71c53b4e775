#include "pons/rt/event_log.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace pons::rt {
namespace {

std::vector<std::string> drained(EventLog& log) {
  std::vector<std::string> lines;
  log.drain(
      [&](Time at, std::string_view text) { lines.push_back(std::to_string(at.ns()) + " " + std::string(text)); });
  return lines;
}

TEST(EventLog, SaysWhatWasWrittenOnceAndInOrder) {
  const auto log = std::make_unique<EventLog>();
  log->write(Time(Duration(5)), "axis {} strays {:.3f} rad", 3, 0.0521);
  log->write(Time(Duration(7)), "{}", std::string_view("heartbeat lost"));
  log->write(Time(Duration(9)), "armed");
  EXPECT_EQ(drained(*log), (std::vector<std::string>{"5 axis 3 strays 0.052 rad", "7 heartbeat lost", "9 armed"}));
  EXPECT_TRUE(drained(*log).empty());
}

TEST(EventLog, CountsWhatDidNotFit) {
  const auto log = std::make_unique<EventLog>();
  for (std::size_t i = 0; i < EventLog::kCapacity + 3; ++i) log->write(Time{}, "event {}", i);
  const auto lines = drained(*log);
  ASSERT_EQ(lines.size(), EventLog::kCapacity + 1);
  EXPECT_EQ(lines.back(), "0 3 more events did not fit into the log");
  log->write(Time{}, "again");
  EXPECT_EQ(drained(*log), std::vector<std::string>{"0 again"});
}

TEST(EventLog, SaysOrCountsEveryEventBetweenThreads) {
  constexpr std::uint64_t kEvents = 20'000;
  const auto log = std::make_unique<EventLog>();
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < kEvents; ++i) log->write(Time(Duration(static_cast<std::int64_t>(i))), "{}", i);
  });
  std::uint64_t said = 0, dropped = 0;
  std::int64_t last = -1;
  const auto hear = [&](Time at, std::string_view text) {
    if (text.ends_with("log")) {
      dropped += std::stoull(std::string(text));
      return;
    }
    EXPECT_EQ(std::to_string(at.ns()), text);
    EXPECT_GT(at.ns(), last);
    last = at.ns();
    ++said;
  };
  while (said + dropped < kEvents) log->drain(hear);
  writer.join();
  log->drain(hear);
  EXPECT_EQ(said + dropped, kEvents);
}

}  // namespace
}  // namespace pons::rt
