#include "pons/gate/ros/graph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pons/wire/types/rmw_dds_common/msg/participant_entities_info.hpp"
#include "pons/wire/types/rmw_dds_common_humble/msg/participant_entities_info.hpp"

namespace pons::gate::ros {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Guid guid(std::uint8_t participant, std::uint8_t entity) {
  Guid made{};
  made[0] = 1;
  made[1] = 0x0f;
  made[11] = participant;
  made[14] = entity;
  made[15] = 4;
  return made;
}

const Guid kOurs = participant_of(guid(1, 0)), kTheirs = participant_of(guid(2, 0)),
           kOthers = participant_of(guid(3, 0));
const NodeName kNode{"/", "pons"};

template <typename Info>
std::vector<std::byte> info_of(const Guid& participant, const std::string& node, const std::vector<Guid>& writers) {
  Info info;
  std::ranges::copy(participant, info.gid.data.begin());
  auto& entry = info.node_entities_info_seq.emplace_back();
  entry.node_namespace = "/";
  entry.node_name = node;
  for (const Guid& each : writers) std::ranges::copy(each, entry.writer_gid_seq.emplace_back().data.begin());
  std::vector<std::byte> bytes;
  EXPECT_TRUE(wire::encode(info, bytes));
  return bytes;
}
using wire::rmw_dds_common::msg::ParticipantEntitiesInfo;
using HumbleInfo = wire::rmw_dds_common_humble::msg::ParticipantEntitiesInfo;

Heard reader(const std::string& hash) {
  return {.kind = Heard::Kind::kReader,
          .guid = guid(2, 7),
          .topic = "rt/scan",
          .type = "std_msgs::msg::dds_::String_",
          .user_data = "typehash=" + hash + ";"};
}
const Endpoint kWriter{.guid = guid(1, 5),
                       .writes = true,
                       .topic = "rt/scan",
                       .type = "std_msgs::msg::dds_::String_",
                       .user_data = "typehash=RIHS01_aa;"};

TEST(Graph, SpeaksTheFormOfItsPeersAndHumblesBeforeThereAreAny) {
  Graph graph(kNode, kOurs);
  graph.add_own(kWriter);
  EXPECT_TRUE(graph.take_changed());
  EXPECT_FALSE(graph.take_changed());
  HumbleInfo humble;
  ASSERT_TRUE(wire::decode(graph.announcement().value(), humble));
  EXPECT_TRUE(std::ranges::equal(std::span(humble.gid.data).first(16), kOurs));
  EXPECT_EQ(humble.node_entities_info_seq.at(0).node_name, "pons");

  ASSERT_TRUE(
      graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "talker", {guid(2, 1), guid(2, 2)}), {guid(2, 9), 1}));
  EXPECT_EQ(graph.form(), Form::kJazzy);
  EXPECT_TRUE(graph.take_changed());
  ParticipantEntitiesInfo jazzy;
  ASSERT_TRUE(wire::decode(graph.announcement().value(), jazzy));
  EXPECT_EQ(jazzy.node_entities_info_seq.at(0).node_name, "pons");
  EXPECT_EQ(jazzy.node_entities_info_seq.at(0).writer_gid_seq.at(0).data, kWriter.guid);
  EXPECT_THAT(graph.nodes(), ElementsAre("/talker"));
  EXPECT_THAT(graph.take_warnings(), IsEmpty());

  ASSERT_TRUE(graph.told(info_of<HumbleInfo>(kOthers, "listener", {}), {guid(3, 9), 1}));
  EXPECT_EQ(graph.form(), Form::kHumble) << "what the others read would harm it";
  EXPECT_TRUE(graph.take_changed());
  EXPECT_THAT(graph.take_warnings(), ElementsAre(HasSubstr("Humble")));
  graph.heard({.kind = Heard::Kind::kGone, .guid = kOthers});
  EXPECT_EQ(graph.form(), Form::kJazzy);
  EXPECT_TRUE(graph.take_changed());
  graph.heard({.kind = Heard::Kind::kGone, .guid = kTheirs});
  EXPECT_EQ(graph.form(), Form::kHumble) << "whoever comes next";
  EXPECT_TRUE(graph.take_changed());
}

// What comes to whoever joins, before we know of him.
TEST(Graph, JazzysReadersFindNoNodesInHumblesForm) {
  Graph graph(kNode, kOurs);
  graph.add_own(kWriter);
  auto bytes = graph.announcement().value();
  const auto count = std::span(bytes).subspan(wire::kEncapsulation + 16, 4);  // after an identifier of theirs
  EXPECT_THAT(count, testing::Each(std::byte{0}));
}

// Who tells of hashes will read that form; he need not have said a word yet.
TEST(Graph, KnowsTheFormOfItsPeersByWhatTheirEndpointsTell) {
  Graph graph(kNode, kOurs);
  EXPECT_TRUE(graph.take_changed());
  Heard about{.kind = Heard::Kind::kWriter, .guid = guid(2, 9), .topic = std::string(kDiscoveryTopic)};
  graph.heard(about);
  EXPECT_EQ(graph.form(), Form::kHumble);
  EXPECT_FALSE(graph.take_changed());
  about.user_data = "typehash=RIHS01_aa;";
  graph.heard(about);
  EXPECT_EQ(graph.form(), Form::kJazzy);
  EXPECT_TRUE(graph.take_changed());
  EXPECT_THAT(graph.nodes(), IsEmpty());
  // What he says himself counts more, and another node of Pons tells nothing of it.
  ASSERT_TRUE(graph.told(info_of<HumbleInfo>(kTheirs, "listener", {}), {guid(2, 9), 1}));
  graph.heard(about);
  EXPECT_EQ(graph.form(), Form::kHumble);
  graph.heard({.kind = Heard::Kind::kGone, .guid = kTheirs});
  graph.heard({.kind = Heard::Kind::kParticipant, .guid = kOthers, .user_data = "enclave=/;pons=1;"});
  about.guid = guid(3, 9);
  graph.heard(about);
  EXPECT_EQ(graph.form(), Form::kHumble);
  EXPECT_THAT(graph.take_warnings(), IsEmpty());
}

// Nothing that is cut short: what stands in place of it would be empty.
TEST(Graph, WhatCannotBeToldIsAnError) {
  const Graph graph({"/", std::string(300, 'n')}, kOurs);
  EXPECT_FALSE(graph.announcement());
}

// They would mirror each other, and each what the other has just left.
TEST(Graph, OtherNodesOfPonsTellNothingOfTheForm) {
  Graph graph(kNode, kOurs);
  graph.heard({.kind = Heard::Kind::kParticipant, .guid = kTheirs, .user_data = "enclave=/;pons=1;"});
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "alike", {}), {guid(2, 9), 1}));
  EXPECT_EQ(graph.form(), Form::kHumble);
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kOthers, "talker", {}), {guid(3, 9), 1}));
  EXPECT_EQ(graph.form(), Form::kJazzy);
  ASSERT_TRUE(graph.told(info_of<HumbleInfo>(kTheirs, "alike", {}), {guid(2, 9), 2}));
  EXPECT_EQ(graph.form(), Form::kJazzy);
  EXPECT_THAT(graph.take_warnings(), IsEmpty());
}

TEST(Graph, NodesAreThoseOfTheNewestWordAndGoWithTheirParticipant) {
  Graph graph(kNode, kOurs);
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "one", {}), {guid(2, 9), 1}));
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "two", {}), {guid(2, 9), 2}));
  EXPECT_THAT(graph.nodes(), ElementsAre("/two"));
  graph.heard({.kind = Heard::Kind::kGone, .guid = kTheirs});
  EXPECT_THAT(graph.nodes(), IsEmpty());
}

TEST(Graph, WhatIsOfNeitherFormIsRefused) {
  Graph graph(kNode, kOurs);
  auto bytes = info_of<ParticipantEntitiesInfo>(kTheirs, "one", {guid(2, 1)});
  for (std::size_t cut = 0; cut < bytes.size(); ++cut)
    EXPECT_FALSE(graph.told(std::span(bytes).first(cut), {guid(2, 9), 1})) << cut;
  EXPECT_THAT(graph.nodes(), IsEmpty());
}

TEST(Graph, AnotherDefinitionOfATypeIsToldOnceWithItsNode) {
  Graph graph(kNode, kOurs);
  graph.add_own(kWriter);
  graph.heard(reader("RIHS01_aa"));
  EXPECT_THAT(graph.take_warnings(), IsEmpty());
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "listener", {guid(2, 7)}), {guid(2, 9), 1}));
  graph.heard(reader("RIHS01_bb"));
  graph.heard(reader("RIHS01_bb"));
  EXPECT_THAT(graph.take_warnings(), ElementsAre(AllOf(HasSubstr("/listener"), HasSubstr("RIHS01_bb"))));
}

TEST(Graph, WhoServesTheSameOrTellsTheTimeTooIsToldOnce) {
  Graph graph(kNode, kOurs);
  const auto theirs = [&](const std::string& topic, bool writes, std::uint8_t number) {
    graph.heard({.kind = writes ? Heard::Kind::kWriter : Heard::Kind::kReader,
                 .guid = guid(2, number),
                 .topic = topic,
                 .type = "T"});
  };
  std::uint8_t number = 1;
  for (const char* const part : {"send_goal", "get_result"}) {
    const std::string topic = std::string("rq/go/_action/") + part + "Request";
    graph.add_own({.guid = guid(1, number), .topic = topic, .type = "T"});
    theirs(topic, false, number++);
  }
  for (const char* const topic : {"rt/clock", "rt/tf"}) {
    graph.add_own({.guid = guid(1, number), .writes = true, .topic = topic, .type = "T"});
    theirs(topic, true, number++);
  }
  EXPECT_THAT(graph.take_warnings(),
              ElementsAre(HasSubstr("/go: somebody serves it, too"), HasSubstr("/clock: somebody")));
  // Once he says who he is, he is named.
  const auto says = [&](const std::vector<Guid>& endpoints) {
    return graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "rogue", endpoints), {guid(2, 9), 1}).has_value();
  };
  ASSERT_TRUE(says({guid(2, 1)}));
  EXPECT_THAT(graph.take_warnings(), ElementsAre(HasSubstr("/go: /rogue serves it, too")));
  ASSERT_TRUE(says({guid(2, 1), guid(2, 2), guid(2, 3)}));
  EXPECT_THAT(graph.take_warnings(), ElementsAre(HasSubstr("/clock: /rogue tells the time, too")));
}

// As Fast DDS does of ours.
TEST(Graph, WhatWeHaveOurselvesIsNobodyElses) {
  Graph graph(kNode, kOurs);
  const Endpoint serves{.guid = guid(1, 1), .topic = "rq/goRequest", .type = "T"};
  graph.add_own(serves);
  graph.heard({.kind = Heard::Kind::kReader, .guid = serves.guid, .topic = serves.topic, .type = serves.type});
  EXPECT_THAT(graph.take_warnings(), IsEmpty());
  EXPECT_TRUE(graph.endpoints().empty());
}

TEST(Graph, AnotherTypeIsToldWhoeverCameFirst) {
  Heard other = reader("RIHS01_aa");
  other.type = "std_msgs::msg::dds_::Int32_";
  for (const bool ours_first : {true, false}) {
    Graph graph(kNode, kOurs);
    if (ours_first) graph.add_own(kWriter);
    graph.heard(other);
    if (!ours_first) graph.add_own(kWriter);
    EXPECT_THAT(graph.take_warnings(),
                ElementsAre(HasSubstr("has the type std_msgs/msg/Int32 there, ours is std_msgs/msg/String")));
  }
}

// They go to a terminal.
TEST(Graph, WhatOthersCallThingsIsFitForALine) {
  Graph graph(kNode, kOurs);
  graph.add_own(kWriter);
  Heard other = reader("");
  other.type = "a\nros2: all is well\x1b[2J" + std::string(10'000, 'x');
  graph.heard(other);
  const auto lines = graph.take_warnings();
  ASSERT_THAT(lines, ElementsAre(HasSubstr("a\\x0aros2: all is well\\x1b")));
  EXPECT_LT(lines[0].size(), 600U);
}

TEST(Graph, RemembersNoMoreThanAThousandParticipants) {
  Graph graph(kNode, kOurs);
  for (std::uint8_t many = 0; many < 5; ++many) {
    for (std::uint8_t i = 0; i < 250; ++i) {
      Guid sender = guid(i, 9);
      sender[10] = 1 + many;
      ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "one", {}), {sender, 1}));
    }
  }
  EXPECT_EQ(graph.nodes().size(), 1000U);
  EXPECT_THAT(graph.take_warnings(), ElementsAre(HasSubstr("more than 1000 participants")));
  // Whoever is known is heard further.
  Guid known = guid(0, 9);
  known[10] = 1;
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "two", {}), {known, 2}));
  EXPECT_THAT(graph.nodes(), ::testing::Contains("/two"));
}

TEST(Graph, QualitiesThatDoNotFitAreNamed) {
  Graph graph(kNode, kOurs);
  graph.add_own(kWriter);
  graph.heard({.kind = Heard::Kind::kIncompatible, .guid = kWriter.guid, .topic = "rt/scan", .policy = "durability"});
  EXPECT_THAT(graph.take_warnings(), ElementsAre(AllOf(HasSubstr("/scan: a reader"), HasSubstr("durability"),
                                                       HasSubstr("reliable, volatile"))));
}

TEST(Graph, WhoIsHeardByAnotherReaderIsNotNamed) {
  Graph graph(kNode, kOurs);
  const Endpoint reliable{.guid = guid(1, 6), .topic = "rt/stop", .type = kWriter.type};
  Endpoint others = reliable;
  others.guid = guid(1, 7);
  others.qos.reliability = Qos::Reliability::kBestEffort;
  const auto hear = [&](const char* policy) {
    graph.heard({.kind = Heard::Kind::kIncompatible, .guid = reliable.guid, .topic = reliable.topic, .policy = policy});
    return graph.take_warnings();
  };
  graph.add_own(reliable);
  graph.add_own(others);
  EXPECT_THAT(hear("reliability"), IsEmpty());
  EXPECT_THAT(hear("durability"), ElementsAre(HasSubstr("durability")));
}

TEST(Graph, ASecondNodeOfOurNameIsTold) {
  Graph graph(kNode, kOurs);
  ASSERT_TRUE(graph.told(info_of<ParticipantEntitiesInfo>(kTheirs, "pons", {}), {guid(2, 9), 1}));
  EXPECT_THAT(graph.take_warnings(), ElementsAre(HasSubstr("/pons")));
  // What we hear of ourselves is not somebody else.
  Graph alone(kNode, kOurs);
  ASSERT_TRUE(alone.told(info_of<ParticipantEntitiesInfo>(kOurs, "pons", {}), {guid(1, 9), 1}));
  EXPECT_THAT(alone.take_warnings(), IsEmpty());
}

}  // namespace
}  // namespace pons::gate::ros
