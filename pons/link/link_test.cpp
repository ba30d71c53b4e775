#include "pons/link/link.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>
#include <thread>
#include <type_traits>

namespace pons::link {
namespace {

static_assert(std::is_trivially_copyable_v<Command>);

TEST(Link, CommandsGoDownInOrderAndRefuseWhenFull) {
  const auto link = std::make_unique<Link>();
  BridgeEnd bridge(*link);
  CerebellumEnd cerebellum(*link);
  Command command;
  for (std::uint64_t i = 0; i < Link::kCommands; ++i) {
    command.sequence = i;
    ASSERT_TRUE(bridge.send(command));
  }
  EXPECT_EQ(bridge.room(), 0u);
  EXPECT_FALSE(bridge.send(command));
  for (std::uint64_t i = 0; i < Link::kCommands; ++i) {
    ASSERT_TRUE(cerebellum.receive(command));
    ASSERT_EQ(command.sequence, i);
  }
  EXPECT_FALSE(cerebellum.receive(command));
}

TEST(Link, ANewBridgesEndLeavesItsPredecessorsCommandsBehind) {
  const auto link = std::make_unique<Link>();
  CerebellumEnd cerebellum(*link);
  Command command;
  {
    BridgeEnd dead(*link);
    for (command.sequence = 0; command.sequence < Link::kCommands - 1; ++command.sequence)
      ASSERT_TRUE(dead.send(command));
  }
  ASSERT_TRUE(cerebellum.receive(command));
  EXPECT_EQ(command.sequence, 0U);
  BridgeEnd bridge(*link);
  EXPECT_FALSE(cerebellum.receive(command)) << "what was queued by one that is no more moves nothing";
  EXPECT_EQ(bridge.room(), Link::kCommands);
  for (command.sequence = 5000; bridge.send(command); ++command.sequence) {
  }
  EXPECT_EQ(command.sequence, 5000 + Link::kCommands) << "and takes no room";
  ASSERT_TRUE(cerebellum.receive(command));
  EXPECT_EQ(command.sequence, 5000U);
}

TEST(Link, ALoopThatFollowsAnotherTakesInNothingThatWasSentToThatOne) {
  const auto link = std::make_unique<Link>();
  BridgeEnd bridge(*link);
  Command command;
  for (command.sequence = 0; command.sequence < 5; ++command.sequence) ASSERT_TRUE(bridge.send(command));
  CerebellumEnd next(*link);
  next.take_over();
  EXPECT_FALSE(next.receive(command));
  EXPECT_EQ(bridge.room(), Link::kCommands) << "and it takes no room";
  command.sequence = 7;
  ASSERT_TRUE(bridge.send(command));
  ASSERT_TRUE(next.receive(command));
  EXPECT_EQ(command.sequence, 7U);
}

TEST(Link, TheNewestStateComesUp) {
  const auto link = std::make_unique<Link>();
  BridgeEnd bridge(*link);
  CerebellumEnd cerebellum(*link);
  EXPECT_EQ(bridge.latest().epoch, 0u);
  State state;
  state.epoch = 3;
  state.position = AxisVector::Constant(6, 0.5);
  cerebellum.publish(state);
  state.tick = 2;
  cerebellum.publish(state);
  EXPECT_EQ(bridge.latest().tick, 2u);
  EXPECT_EQ(bridge.latest().position, AxisVector::Constant(6, 0.5));
}

TEST(Link, AnybodyMayRaiseTheEmergencyWordAndItStays) {
  const auto link = std::make_unique<Link>();
  const CerebellumEnd cerebellum(*link);
  EXPECT_FALSE(cerebellum.emergency_stop_raised());
  std::thread([&] { link->raise_emergency_stop(); }).join();
  EXPECT_TRUE(cerebellum.emergency_stop_raised());
  EXPECT_TRUE(cerebellum.emergency_stop_raised());
  link->clear_emergency_stop();
  EXPECT_FALSE(cerebellum.emergency_stop_raised());
}

TEST(Message, EveryValueHasAName) {
  std::set<std::string_view> names;
  for (int i = 0; i <= static_cast<int>(SafetyState::kRecovery); ++i) names.insert(name(static_cast<SafetyState>(i)));
  EXPECT_EQ(names.size(), 7u);
  names.clear();
  for (int i = 0; i <= static_cast<int>(StopCause::kNotSlowed); ++i) names.insert(name(static_cast<StopCause>(i)));
  EXPECT_EQ(names.size(), 14u);
  names.clear();
  for (int i = 0; i <= static_cast<int>(StopResult::kFailed); ++i) names.insert(name(static_cast<StopResult>(i)));
  EXPECT_EQ(names.size(), 5u);
  EXPECT_FALSE(names.contains("unknown"));
}

}  // namespace
}  // namespace pons::link
