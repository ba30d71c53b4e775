// In which order visitors are answered.
#include "apps/desk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/by_hand.hpp"
#include "apps/views/journal_tail.hpp"
#include "pons/bridge/test_kit.hpp"

namespace pons::apps {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class Asks final : public gate::Visitors {
 public:
  explicit Asks(std::vector<std::string>& answered) : answered_(answered) {}
  [[nodiscard]] std::vector<gate::Request> poll() override {
    std::vector<gate::Request> requests;
    for (const std::string& text : std::exchange(texts, {}))
      requests.push_back({text, [this, text](const gate::Json& answer) {
                            told = answer;
                            answered_.push_back(told.value("ok", false) ? text : told.value("error", ""));
                          }});
    return requests;
  }
  std::vector<std::string> texts;
  gate::Json told;  // the last answer

 private:
  std::vector<std::string>& answered_;
};

// Of a run with one robot, whose stops are written down.
class DeskOfARobot : public testing::Test {
 protected:
  bridge::TemporaryFolder folder_;
  std::unique_ptr<bridge::Journal> journal_ = bridge::Journal::open(folder_ / "j.db").value();
  const world::World world_;
  const task::SkillRegistry skills_;
  bridge::Bridge bridge_{*journal_, skills_, world_};
  const link::State state_;
  std::vector<std::string> done_;
  const runner::SkillPort port_{.state = [this]() -> const link::State& { return state_; },
                                .halt = [this] { done_.emplace_back("halt"); },
                                .raise_emergency = [this] { done_.emplace_back("emergency"); }};
  runner::Arming arming_{bridge_, port_, world_.zones, runner::Recovery::kRefused};
  const runner::Health health_{{}};
  std::vector<std::string> answered_;
  std::unique_ptr<Asks> asks_ = std::make_unique<Asks>(answered_);
  Asks& visitor_ = *asks_;
  Desk desk_{std::move(asks_), bridge_, *journal_, {&arming_}, health_, [] { return nullptr; }};
};

TEST_F(DeskOfARobot, AnswersStopsBeforeAllElseAndInTheSamePeriod) {
  const std::string stop = R"({"op":"stop"})", emergency = R"({"op":"emergency_stop"})", look = R"({"op":"health"})";
  visitor_.texts = {look, stop, look, emergency};
  desk_.attend(Time{});
  EXPECT_EQ(answered_, (std::vector{stop, emergency, look, look}));
  EXPECT_EQ(done_, (std::vector<std::string>{"halt", "emergency"}));
}

// The arm stops all the same, but a bridge that takes over would go on by itself.
TEST_F(DeskOfARobot, WhoAsksForAStopHearsThatItIsNotKept) {
  ASSERT_TRUE(std::filesystem::remove(folder_ / "j.db"));
  visitor_.texts = {R"({"op":"stop"})", R"({"op":"stop"})"};
  desk_.attend(Time{});
  EXPECT_EQ(done_, (std::vector<std::string>{"halt", "halt"}));
  ASSERT_EQ(answered_.size(), 2U);
  for (const std::string& answer : answered_) EXPECT_NE(answer.find("not kept"), std::string::npos) << answer;
}

TEST(ByHand, NobodyHearsOfATaskBeforeTheDiskHasIt) {
  const bridge::TemporaryFolder folder;
  const auto journal = bridge::Journal::open(folder / "j.db").value();
  world::World world;
  world.resources = {{"arm"}};
  bridge::Actor actor{"act", {{}}};
  task::SkillRegistry skills;
  skills.add(actor.type());
  bridge::Bridge bridge(*journal, skills, world);
  ByHand hand(bridge, "act", "arm");
  const auto taken = hand.take(bridge::Json::object(), Time{});
  ASSERT_TRUE(taken) << taken.error().line();
  EXPECT_TRUE(taken->begun);
  EXPECT_EQ(bridge.state(taken->id), "waiting");
  EXPECT_FALSE(bridge.unkept());
}

// The next bridge would give its number to another event, and who watches from there on would miss one.
TEST_F(DeskOfARobot, NothingOfATaskIsToldBeforeTheDiskHasIt) {
  bridge_.note("seen", {{"track", 1}}, Time{}, "P1");
  ASSERT_GT(journal_->newest(), journal_->durable());
  ASSERT_FALSE(bridge_.unkept()) << "nobody waits for it";
  visitor_.texts = {R"({"op":"history","id":"P1"})"};
  desk_.attend(Time{});
  EXPECT_EQ(visitor_.told.at("events").size(), 1U);
  EXPECT_EQ(journal_->durable(), visitor_.told.at("events").back().at("sequence"));
}

// When someone looks is another time in each run; what its recording shows, and in which order, must not be.
TEST_F(DeskOfARobot, WhoLooksIsNotSeenInARecording) {
  JournalTail tail(bridge_);
  std::vector<std::string> heard;
  tail.add([&](const bridge::Event& event) { heard.push_back(event.kind); });
  bridge_.note("seen", {{"track", 1}}, Time{}, "P1");
  visitor_.texts = {R"({"op":"history","id":"P1"})", R"({"op":"list"})", R"({"op":"show","id":"P1"})"};
  desk_.attend(Time{});
  ASSERT_EQ(answered_.size(), 3U);
  tail.show(Time{});
  EXPECT_THAT(heard, IsEmpty());
  ASSERT_TRUE(bridge_.commit(Time{}));
  tail.show(Time{});
  EXPECT_THAT(heard, ElementsAre("seen"));
}

// Of a run without robots and skills.
class BareDesk : public testing::Test {
 protected:
  std::string ask(const std::string& text) {
    visitor_.texts = {text};
    desk_.attend(Time{});
    return answered_.back();
  }
  bridge::TemporaryFolder folder_;
  std::unique_ptr<bridge::Journal> journal_ = bridge::Journal::open(folder_ / "j.db").value();
  const world::World world_;
  const task::SkillRegistry skills_;
  bridge::Bridge bridge_{*journal_, skills_, world_};
  const runner::Health health_{{}};
  std::vector<std::string> answered_;
  std::unique_ptr<Asks> asks_ = std::make_unique<Asks>(answered_);
  Asks& visitor_ = *asks_;
  Desk desk_{std::move(asks_), bridge_, *journal_, {}, health_, [] { return nullptr; }};
};

TEST_F(BareDesk, TellsOfAnArmsAxesOnceItsLoopHas) {
  const std::string axes = R"({"op":"axes"})";
  EXPECT_NE(ask(axes).find("the robot is no arm"), std::string::npos);
  link::State state;
  desk_.serve(Desk::Axes{{"j1", "j2"},
                         [&]() -> const link::State& { return state; },
                         [&](const AxisVector& q, Time) -> Expected<std::string> {
                           if (q.size() != 2) return fail("other joints", "positions", "give two");
                           return "servo-1";
                         }});
  EXPECT_NE(ask(axes).find("has told nothing of its arm yet"), std::string::npos);
  state.position = state.speed = AxisVector::Constant(2, 0.5);
  state.commanded = at_rest(AxisVector::Constant(2, 0.25));
  ask(axes);
  EXPECT_EQ(visitor_.told.at("names"), (std::vector<std::string>{"j1", "j2"}));
  EXPECT_EQ(visitor_.told.at("positions"), (std::vector{0.5, 0.5}));
  EXPECT_EQ(visitor_.told.at("commanded").at("positions"), (std::vector{0.25, 0.25}));
  EXPECT_EQ(visitor_.told.at("commanded").at("speeds"), (std::vector{0.0, 0.0}));
  ask(R"({"op":"servo","positions":[1,2]})");
  EXPECT_EQ(visitor_.told.at("id"), "servo-1");
  EXPECT_NE(ask(R"({"op":"servo","positions":[1]})").find("other joints"), std::string::npos);
}

TEST_F(BareDesk, ARunThatIsNotServedIsNotToldToRest) {
  for (const char* const text : {R"({"op":"rest"})", R"({"op":"end"})"})
    EXPECT_NE(ask(text).find("cannot be told to rest"), std::string::npos) << text;
}

}  // namespace
}  // namespace pons::apps
