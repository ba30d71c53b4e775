#include "pons/gate/foxglove/session.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace pons::gate::foxglove {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

Payload payload(std::string_view text) {
  const auto all = std::as_bytes(std::span(text));
  return std::make_shared<const std::vector<std::byte>>(all.begin(), all.end());
}

// "json", "time 5", "message 1 of 3: text"
std::string shown(const Outgoing& out) {
  if (out.text) return *out.text;
  const auto at = [&](std::size_t i) { return std::to_integer<int>(out.header.bytes[i]); };
  if (out.header.size == 9) return fmt::format("time {}", at(1));
  const std::string text(reinterpret_cast<const char*>(out.body->data()), out.body->size());
  return out.header.size == 0 ? "answer " + text : fmt::format("{} of {}: {}", at(1), at(5), text);
}

class FoxgloveSession : public ::testing::Test {
 protected:
  FoxgloveSession() {
    add({"/a", "std_msgs/msg/String", "string data"});
    add({"/b", "std_msgs/msg/String", "string data"});
    add({"/kept", "std_msgs/msg/String", "string data", Keeps::kLast});
  }
  void add(Channel channel) { catalogue_.add(std::move(channel), std::make_shared<std::atomic<int>>(0)); }
  void begin(SessionLimits limits = {}) {
    session_ = std::make_unique<Session>(catalogue_, limits, [this](Call call) { calls_.push_back(std::move(call)); });
    (void)sent();
  }
  std::vector<std::string> sent() {
    std::vector<std::string> all;
    while (const auto out = session_->next()) all.push_back(shown(*out));
    return all;
  }
  void subscribe(int id, int channel) {
    session_->hear_text(
        fmt::format(R"({{"op":"subscribe","subscriptions":[{{"id":{},"channelId":{}}}]}})", id, channel));
  }
  void show(std::size_t channel, std::string_view text) {
    session_->show(channel, Time(Duration(static_cast<int>(text.size()))), payload(text), now_);
  }
  Catalogue catalogue_;
  std::unique_ptr<Session> session_;
  std::vector<Call> calls_;
  SteadyTime now_{1h};
};

TEST_F(FoxgloveSession, BeginsWithWhatThereIs) {
  catalogue_.services.push_back({"/s", "a/srv/A", {}, {}});
  session_ = std::make_unique<Session>(catalogue_, SessionLimits{}, [](const Call&) {});
  EXPECT_EQ(catalogue_.clients, 1U);
  EXPECT_THAT(sent(), ElementsAre(HasSubstr("serverInfo"), AllOf(HasSubstr("\"advertise\""), HasSubstr("/kept")),
                                  HasSubstr("advertiseServices")));
  session_.reset();
  EXPECT_EQ(catalogue_.clients, 0U);
}

TEST_F(FoxgloveSession, SendsWhatWasSubscribedInTheOrderInWhichItCame) {
  begin();
  subscribe(7, 0);
  subscribe(8, 1);
  EXPECT_EQ(*catalogue_.subscribers[0], 1);
  EXPECT_EQ(*catalogue_.subscribers[2], 0);
  show(0, "one");
  show(2, "nobody");
  show(1, "three");
  show(0, "four");
  EXPECT_THAT(sent(), ElementsAre("7 of 3: one", "8 of 5: three", "7 of 4: four"));
  show(0, "too late");
  session_->hear_text(R"({"op":"unsubscribe","subscriptionIds":[7]})");
  show(0, "later");
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_EQ(session_->queued_bytes(), 0U);
  EXPECT_EQ(*catalogue_.subscribers[0], 0);
  session_.reset();
  EXPECT_EQ(*catalogue_.subscribers[1], 0);
}

TEST_F(FoxgloveSession, WhatIsKeptIsSentToWhoSubscribesLater) {
  catalogue_.last[2] = {Time(Duration(1)), payload("robot")};
  begin();
  subscribe(1, 2);
  EXPECT_THAT(sent(), ElementsAre("1 of 1: robot"));
}

TEST_F(FoxgloveSession, TellsOfChannelsThatComeLater) {
  begin();
  add({"/later", "std_msgs/msg/String", "string data"});
  session_->advertise(3);
  EXPECT_THAT(sent(), ElementsAre(AllOf(HasSubstr("\"id\":3"), HasSubstr("/later"), Not(HasSubstr("/kept")))));
  subscribe(1, 3);
  show(3, "text");
  EXPECT_THAT(sent(), ElementsAre("1 of 4: text"));
}

TEST_F(FoxgloveSession, OnlyTheNewestTimeWaits) {
  begin();
  session_->show_time(Time(Duration(1)));
  session_->show_time(Time(Duration(2)));
  EXPECT_THAT(sent(), ElementsAre("time 2"));
}

TEST_F(FoxgloveSession, TellsWhatIsWrongAndGoesOn) {
  begin();
  session_->hear_text("{");
  subscribe(1, 3);
  subscribe(1, 0);
  subscribe(1, 1);
  subscribe(2, 0);
  session_->hear_text(R"({"op":"unsubscribe","subscriptionIds":[9]})");
  session_->hear_binary({});
  show(0, "x");
  EXPECT_THAT(sent(),
              ElementsAre(HasSubstr("JSON"), HasSubstr("subscribe/subscriptions/0: there is no channel 3"),
                          HasSubstr("subscription 1 is there already"), HasSubstr("channel 0 is subscribed already"),
                          HasSubstr("there is no subscription 9"), HasSubstr("is empty"), "1 of 1: x"));
}

TEST_F(FoxgloveSession, OfWhatDoesNotFitTheOldestOfTheTopicGoAndItIsTold) {
  begin({.queued_bytes = 350});
  subscribe(1, 0);
  subscribe(2, 1);
  for (const char* const text : {"a", "b"}) show(0, text);
  show(1, "c");
  show(0, "d");
  EXPECT_EQ(catalogue_.dropped, 1U);
  EXPECT_THAT(sent(), ElementsAre(AllOf(HasSubstr("\"level\":1"), HasSubstr("1 of /a;")), "1 of 1: b", "2 of 1: c",
                                  "1 of 1: d"));
  // Not at once again; then all together. A topic of which nothing waits takes the oldest one's place.
  for (const char* const text : {"a", "b", "c", "d"}) show(0, text);
  show(1, "e");
  EXPECT_THAT(sent(), ElementsAre("1 of 1: c", "1 of 1: d", "2 of 1: e"));
  now_ += 1s;
  show(0, "f");
  EXPECT_THAT(sent(), ElementsAre(HasSubstr("2 of /a;"), "1 of 1: f"));
  EXPECT_EQ(catalogue_.dropped, 3U);
}

TEST_F(FoxgloveSession, WhatIsLargerThanItsRoomIsSentWhenNothingElseWaits) {
  begin({.queued_bytes = 350});
  subscribe(1, 0);
  const std::string picture(1000, 'x');
  show(0, "a");
  show(0, picture);
  show(0, picture);
  EXPECT_THAT(sent(), ElementsAre(HasSubstr("of /a"), HasSubstr(picture)));
}

TEST_F(FoxgloveSession, WhoTakesNoAnswersHasToGo) {
  begin({.words = 10});
  for (int i = 0; i < 10; ++i) session_->hear_text("{");
  EXPECT_THAT(session_->broken(), IsEmpty());
  session_->hear_text("{");
  EXPECT_THAT(session_->broken(), HasSubstr("10 answers wait"));
  EXPECT_EQ(sent().size(), 10U);
}

TEST_F(FoxgloveSession, CallsServices) {
  catalogue_.services.push_back({"/s", "a/srv/A", {}, {}});
  begin({.calls = 2});
  const auto call = [&](char service, char id, std::string_view encoding) {
    std::string text{'\2', service, 0, 0, 0, id, 0, 0, 0, static_cast<char>(encoding.size()), 0, 0, 0};
    text += std::string(encoding) + "?";
    session_->hear_binary(std::as_bytes(std::span(text)));
  };
  call(1, 5, "cdr");
  call(0, 6, "json");
  EXPECT_THAT(sent(), ElementsAre(AllOf(HasSubstr("serviceCallFailure"), HasSubstr("there is no service 1")),
                                  AllOf(HasSubstr("encoding 'json' is not taken"), HasSubstr("\"callId\":6"))));
  for (char id = 7; id < 10; ++id) call(0, id, "cdr");
  ASSERT_EQ(calls_.size(), 2U);
  EXPECT_EQ(calls_[0].request.size(), 1U);
  EXPECT_THAT(sent(), ElementsAre(AllOf(HasSubstr("2 calls wait already"), HasSubstr("\"callId\":9"))));
  session_->answer(calls_[0], *payload("yes"));
  session_->answer(calls_[1], fail("no"));
  EXPECT_THAT(sent(), ElementsAre(HasSubstr("yes"), AllOf(HasSubstr("\"no\""), HasSubstr("\"callId\":8"))));
  call(0, 11, "cdr");
  EXPECT_EQ(calls_.size(), 3U);
}

}  // namespace
}  // namespace pons::gate::foxglove
