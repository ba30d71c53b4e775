// Two nodes in one process, over loopback. Peers of other makes: tests/ros/.
#include "pons/gate/ros/node.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "pons/gate/ros/service.hpp"
#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "pons/wire/types/std_msgs/msg/int64.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"

namespace pons::gate::ros {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using wire::std_msgs::msg::Int64;
using wire::std_msgs::msg::String;
using Image = wire::sensor_msgs::msg::Image;

TEST(RosNode, ATopicGoesFromOneToTheOther) {
  const auto here = test_node("here"), there = test_node("there");
  auto publisher = here->advertise<String>("chatter");
  ASSERT_TRUE(publisher);
  std::vector<std::string> heard;
  ASSERT_TRUE(there->subscribe<String>("chatter", kTopicQos, [&](const String& text) { heard.push_back(text.data); }));
  ASSERT_TRUE(spin_until({here.get(), there.get()}, [&] { return publisher->matched() == 1; }));
  for (const char* const text : {"one", "two", "three"}) ASSERT_TRUE(publisher->publish({text}));
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return heard.size() == 3; }));
  EXPECT_THAT(heard, ElementsAre("one", "two", "three"));
}

TEST(RosNode, EachKnowsTheOthersName) {
  const auto here = test_node("here"), there = test_node("there");
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return !here->graph().nodes().empty(); }));
  EXPECT_THAT(here->graph().nodes(), ElementsAre("/there"));
  auto publisher = there->advertise<String>("chatter");
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] {
    return std::ranges::any_of(here->graph().endpoints(), [](const auto& each) {
      return each.second.topic == "rt/chatter" && each.second.user_data.find(String::kHash) != std::string::npos;
    });
  }));
}

TEST(RosNode, WhoComesLaterHearsWhatIsLatched) {
  const auto here = test_node("here");
  auto publisher = here->advertise<String>("robot_description", kLatchedQos);
  ASSERT_TRUE(publisher->publish({"before anybody came"}));
  const auto there = test_node("there");
  std::string heard;
  ASSERT_TRUE(
      there->subscribe<String>("robot_description", kLatchedQos, [&](const String& text) { heard = text.data; }));
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return !heard.empty(); }));
  EXPECT_EQ(heard, "before anybody came");
}

// A line of the log that is hours old is no news to who comes now.
TEST(RosNode, WhoComesLaterHearsNothingThatHasOutlivedItsTime) {
  EXPECT_EQ(kRosoutQos.lifespan, std::chrono::seconds(10)) << "as rcl has it";
  const auto here = test_node("here");
  Qos brief = kRosoutQos;
  brief.lifespan = std::chrono::milliseconds(1);
  auto publisher = here->advertise<String>("log", brief);
  ASSERT_TRUE(publisher);
  ASSERT_TRUE(publisher->publish({"old"}));
  const auto there = test_node("there");
  std::vector<std::string> heard;
  ASSERT_TRUE(there->subscribe<String>("log", kRosoutQos, [&](const String& text) { heard.push_back(text.data); }));
  ASSERT_TRUE(spin_until({here.get(), there.get()}, [&] { return publisher->matched() == 1; }));
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return publisher->publish({"new"}) && !heard.empty(); }));
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.front(), "new");
}

TEST(RosNode, AMegabyteArrivesWhole) {
  const auto here = test_node("here"), there = test_node("there");
  auto publisher = here->advertise<Image>("image");
  Image image;
  image.data.resize(1 << 20);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<std::uint8_t>(i * 7919 >> 3U);
  int same = 0;
  ASSERT_TRUE(there->subscribe<Image>("image", kTopicQos, [&](const Image& got) { same += got == image ? 1 : 0; }));
  ASSERT_TRUE(spin_until({here.get(), there.get()}, [&] { return publisher->matched() == 1; }));
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(publisher->publish(image));
    EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return same == i + 1; })) << i;
  }
}

TEST(RosNode, QualitiesThatDoNotFitAreToldOnBothSides) {
  const auto here = test_node("here"), there = test_node("there");
  auto publisher = here->advertise<String>("chatter", kSensorQos);
  ASSERT_TRUE(there->subscribe<String>("chatter", kTopicQos, [](const String&) {}));
  std::vector<std::string> here_told, there_told;
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] {
    for (std::string& line : here->take_warnings()) here_told.push_back(std::move(line));
    for (std::string& line : there->take_warnings()) there_told.push_back(std::move(line));
    return !here_told.empty() && !there_told.empty();
  }));
  EXPECT_THAT(here_told, Contains(AllOf(HasSubstr("/chatter: "), HasSubstr("reliability"), HasSubstr("wants more"))));
  EXPECT_THAT(there_told, Contains(AllOf(HasSubstr("/chatter: "), HasSubstr("reliability"), HasSubstr("offers less"))));
}

TEST(RosNode, OfWhatItHasItselfItSaysNothing) {
  const auto here = test_node("here"), there = test_node("there");
  using wire::std_srvs::srv::SetBool;
  ASSERT_TRUE(serve<SetBool>(*here, "switch", [](const SetBool::Request&, const Answer<SetBool>&) {}));
  auto clock = here->advertise<Int64>("/clock");
  ASSERT_TRUE(there->subscribe<Int64>("/clock", kTopicQos, [](const Int64&) {}));
  ASSERT_TRUE(spin_until({here.get(), there.get()}, [&] {
    return clock->matched() == 1 && there->graph().endpoints().size() > 3 && !here->graph().nodes().empty();
  }));
  EXPECT_THAT(here->take_warnings(), IsEmpty());
}

TEST(RosNode, AllWhoPublishAreHeardOnceAndWithoutAWord) {
  const auto here = test_node("here"), there = test_node("there");
  auto reliable = here->advertise<Int64>("stop"), best_effort = here->advertise<Int64>("stop", kSensorQos);
  ASSERT_TRUE(reliable && best_effort);
  std::vector<std::int64_t> heard;
  ASSERT_TRUE(there->subscribe_to_all<Int64>("stop", [&](const Int64& each) { heard.push_back(each.data); }));
  const auto spun = [&](const std::function<bool()>& done) { return spin_until({here.get(), there.get()}, done); };
  // Each side finds the other by itself: what is said before both have, is not heard.
  const auto says_until_heard = [&](Publisher<Int64>& publisher, std::int64_t number) {
    return spun([&] { return publisher.publish({number}) && std::ranges::find(heard, number) != heard.end(); });
  };
  ASSERT_TRUE(spun([&] { return reliable->matched() == 2 && best_effort->matched() == 1; }));
  ASSERT_TRUE(says_until_heard(*best_effort, 1));
  ASSERT_TRUE(says_until_heard(*reliable, 2));
  const std::int64_t last = 2 + kTopicQos.depth;
  for (std::int64_t number = 3; number <= last; ++number) ASSERT_TRUE(reliable->publish({number}));
  ASSERT_TRUE(spun([&] { return heard.back() == last; }));
  ASSERT_TRUE(says_until_heard(*best_effort, last + 1)) << "what had been said before is behind it";
  for (std::int64_t number = 3; number <= last; ++number) EXPECT_EQ(std::ranges::count(heard, number), 1) << number;
  EXPECT_THAT(there->take_warnings(), IsEmpty());
}

// A button that was pressed before anybody heard of it.
TEST(RosNode, HearsWhatWasKeptForIt) {
  const auto here = test_node("here");
  auto kept = here->advertise<Int64>("stop", kLatchedQos);
  ASSERT_TRUE(kept);
  ASSERT_TRUE(kept->publish({7}));
  const auto there = test_node("there");
  std::vector<std::int64_t> heard;
  ASSERT_TRUE(there->subscribe_to_all<Int64>("stop", [&](const Int64& each) { heard.push_back(each.data); }));
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return !heard.empty(); }));
  EXPECT_EQ(heard.front(), 7);
  EXPECT_THAT(there->take_warnings(), IsEmpty());
}

TEST(RosNode, RulesThatRenameNothingAreNamed) {
  const NodeName name{"/", "here"};
  Remaps remaps;
  for (const char* const rule : {"chatter:=/talk", "work:=/labour", "scan:=/left/scan"})
    ASSERT_TRUE(add_remap(rule, name, remaps));
  const auto here = Node::open({.participant = {.domain = test_domain()}, .name = name, .remaps = remaps});
  ASSERT_TRUE(here);
  const auto text = (*here)->advertise<String>("chatter"), status = (*here)->advertise<String>("work/_action/status");
  ASSERT_TRUE(text && status);
  (*here)->warn_of_idle_remaps();
  EXPECT_THAT((*here)->take_warnings(), ElementsAre(HasSubstr("/scan:=/left/scan")));
}

TEST(RosNode, TellsWhatItsSettingsNote) {
  const auto here = Node::open({.participant = {.domain = test_domain()}, .notes = {"a note"}});
  ASSERT_TRUE(here);
  EXPECT_THAT((*here)->take_warnings(), ElementsAre("a note"));
}

TEST(RosNode, WhatCannotBeReadIsToldAndTheNextIsHeard) {
  const auto here = test_node("here"), there = test_node("there");
  // Of the name and the hash of one type, and the bytes of another.
  auto writer = here->add_writer("chatter", Use::kTopic, String::kName, String::kHash, kTopicQos);
  ASSERT_TRUE(writer);
  std::string heard;
  ASSERT_TRUE(there->subscribe<String>("chatter", kTopicQos, [&](const String& text) { heard = text.data; }));
  ASSERT_TRUE(spin_until({here.get(), there.get()}, [&] { return !(*writer)->matched().empty(); }));
  std::vector<std::byte> bytes;
  ASSERT_TRUE(wire::encode(Int64{.data = -1}, bytes));
  ASSERT_TRUE((*writer)->write(bytes));
  ASSERT_TRUE(wire::encode(String{.data = "good"}, bytes));
  ASSERT_TRUE((*writer)->write(bytes));
  EXPECT_TRUE(spin_until({here.get(), there.get()}, [&] { return heard == "good"; }));
  EXPECT_THAT(there->take_warnings(), Contains(HasSubstr("std_msgs/msg/String")));
}

// Fast DDS would look for them here, and parse them with what has another layout in this process.
TEST(RosNode, ReadsNoFileOfSettings) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "pons_no_settings";
  std::filesystem::create_directories(folder);
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(folder);
  for (const char* const name : {"DEFAULT_FASTRTPS_PROFILES.xml", "named.xml"})
    std::ofstream(folder / name) << "<profiles/>";
  ::setenv("FASTRTPS_DEFAULT_PROFILES_FILE", (folder / "named.xml").c_str(), 1);
  const Descriptor watch(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
  ASSERT_GE(::inotify_add_watch(watch.get(), folder.c_str(), IN_OPEN), 0);
  const auto node = test_node("here");
  std::array<char, 4096> events{};
  EXPECT_EQ(::read(watch.get(), events.data(), events.size()), -1);
  std::ifstream(folder / "named.xml").get();
  EXPECT_GT(::read(watch.get(), events.data(), events.size()), 0) << "opening a file is not seen";
  std::filesystem::current_path(here);
  std::filesystem::remove_all(folder);
}

TEST(RosNode, BadSettingsAreRefused) {
  const auto away = Node::open({.participant = {.domain = test_domain(), .interface = "no_such0"}});
  ASSERT_FALSE(away);
  EXPECT_THAT(away.error().line(), AllOf(HasSubstr("no_such0"), HasSubstr("lo (127.0.0.1)")));
  const auto nameless = Node::open({.participant = {.domain = test_domain()}, .name = {"/", std::string(256, 'n')}});
  ASSERT_FALSE(nameless);
  EXPECT_THAT(nameless.error().line(), HasSubstr("has 256 characters"));
  const auto here = test_node("here");
  EXPECT_FALSE(here->advertise<String>("2d"));
  auto text = here->advertise<String>("chatter");
  ASSERT_TRUE(text);
  const auto number = here->advertise<Int64>("chatter");
  ASSERT_FALSE(number);
  EXPECT_THAT(number.error().line(), AllOf(HasSubstr("String_"), HasSubstr("Int64_")));
}

}  // namespace
}  // namespace pons::gate::ros
