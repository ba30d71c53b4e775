// What a lying brain asks for, and what it keeps to itself.
#include "pons/brain/liar.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace pons::brain {
namespace {

// Asks for one parcel a call, and keeps what it is told.
class Honest final : public Brain {
 public:
  Decisions observe(const std::vector<ObjectBelief>&, Time, const std::set<std::string>&) override {
    Decisions decisions;
    const std::string id = std::string("P").append(std::to_string(++asked));
    decisions.tasks.push_back({{"id", id},
                               {"order", id},
                               {"steps",
                                {{{"skill", "pick"}, {"arguments", {{"object", id}}}},
                                 {{"skill", "place"}, {"arguments", {{"place", "north"}, {"object", id}}}}}}});
    return decisions;
  }
  bool heard(std::string_view id, task::Outcome outcome) override {
    told[std::string(id)] = outcome;
    return true;
  }
  void recall(const task::Task&, std::optional<task::Outcome>) override {}
  void recall_ride(std::string_view) override {}
  [[nodiscard]] std::vector<std::string> unseen() const override { return {}; }

  int asked = 0;
  std::map<std::string, task::Outcome> told;
};

world::World two_chutes() {
  world::World world;
  for (const char* name : {"north", "south"}) {
    world::Place place;
    place.name = name;
    place.kind = world::PlaceKind::kChute;
    world.places.push_back(place);
  }
  return world;
}

class LiarTest : public testing::Test {
 protected:
  // An hour of it, with a lie a second: what it asked for beside its honest work.
  std::vector<Json> lies_of_an_hour() {
    std::vector<Json> lies;
    for (int s = 0; s < 3600; ++s) {
      const std::string honest = std::string("P").append(std::to_string(honest_.asked + 1));
      bool worked = false;
      for (const Json& task : liar_.observe({}, Time(from_s(s)), {}).tasks) {
        const bool is_honest = !worked && task::text_of(task, "id") == honest;
        worked = worked || is_honest;
        if (!is_honest) lies.push_back(task);
        is_honest ? liar_.taken(task) : void(liar_.refused(task, {"no", "", ""}));
      }
      EXPECT_TRUE(worked) << "its honest work goes on";
    }
    return lies;
  }

  world::World world_ = two_chutes();
  Honest honest_;
  Lies lies_{{.often = 1200}, Random(1)};
  Liar liar_{honest_, lies_, world_};
};

TEST_F(LiarTest, TellsAllKindsOfLiesAndDoesItsWorkAllTheSame) {
  const std::vector<Json> lies = lies_of_an_hour();
  EXPECT_NEAR(static_cast<double>(lies_.count()), 1200, 150);
  EXPECT_GT(lies.size(), static_cast<std::size_t>(lies_.count())) << "some are several tasks";
  std::set<std::string> kinds;
  std::set<std::string> ids;
  for (const Json& task : lies) {
    if (!task.is_object()) kinds.insert("no task");
    const std::string id = task::text_of(task, "id");
    if (id.starts_with("lie-")) {
      EXPECT_TRUE(ids.insert(id).second) << id << " comes twice";
    } else if (id.starts_with("P")) {
      kinds.insert("id of another");
    }
    const std::string text = task.dump(-1, ' ', false, Json::error_handler_t::replace);
    for (const char* const sign : {"teleport", ":17}", "NOBODY", "nowhere", "south", "1000000000", "deadline_s", "[[[[",
                                   "exception", "xxxx", "\"priority\":100"})
      if (text.find(sign) != std::string::npos) kinds.insert(sign);
  }
  EXPECT_EQ(kinds.size(), 13U);
  EXPECT_TRUE(honest_.told.empty()) << "of what was refused it hears nothing";
}

TEST_F(LiarTest, WhatBecomesOfItsLiesTheHonestOneDoesNotHear) {
  std::vector<std::string> taken;
  for (int s = 0; s < 600; ++s) {
    for (const Json& task : liar_.observe({}, Time(from_s(s)), {}).tasks) {
      const std::string id = task::text_of(task, "id");
      if (id.starts_with("lie-")) taken.push_back(id);
      liar_.taken(task);
    }
  }
  ASSERT_GT(taken.size(), 50U);
  for (const std::string& id : taken) EXPECT_FALSE(liar_.heard(id, task::Outcome::kSucceeded));
  EXPECT_TRUE(honest_.told.empty());
  EXPECT_TRUE(liar_.heard("P1", task::Outcome::kFailed));
  EXPECT_EQ(honest_.told, (std::map<std::string, task::Outcome>{{"P1", task::Outcome::kFailed}}));
}

// One and the same id, and only the words differ.
TEST_F(LiarTest, ALieUnderAHonestIdThatIsRefusedIsNotTakenForTheHonestOne) {
  int under_honest_ids = 0;
  for (int s = 0; s < 600; ++s) {
    for (const Json& task : liar_.observe({}, Time(from_s(s)), {}).tasks) {
      const std::string id = task::text_of(task, "id");
      const bool lie = !id.starts_with("P") || task.at("steps").size() == 1;
      if (lie && id.starts_with("P")) ++under_honest_ids;
      lie ? void(liar_.refused(task, {"the id is taken", "", ""})) : liar_.taken(task);
    }
  }
  EXPECT_GE(under_honest_ids, 5);
  EXPECT_TRUE(honest_.told.empty());
}

TEST_F(LiarTest, OneSeedTellsTheSameLies) {
  Honest honest;
  Lies lies({.often = 1200}, Random(1));
  Liar other(honest, lies, world_);
  for (int s = 0; s < 300; ++s) {
    const Time now(from_s(s));
    EXPECT_EQ(liar_.observe({}, now, {}).tasks, other.observe({}, now, {}).tasks) << s;
  }
  EXPECT_GT(lies.count(), 50);
}

}  // namespace
}  // namespace pons::brain
