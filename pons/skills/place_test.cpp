#include "pons/skills/place.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "pons/skills/pick.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

// The cups have lost a load over its own chute, whose light curtain counts it at once.
class LostOverItsChuteTest : public ObedientArmTest {
 protected:
  void SetUp() override {
    opened_ = true;
    stands({0.2, 0.46, 1.2});
    cell_.lost = held_;
    skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
    fell_ = now_;
    EXPECT_EQ(skill_->tick(now_).status, Status::kRunning);
    ++falls_[0];
  }
  // P2 was felt to hang on it.
  void loses_it_with_another() {
    pass();
    cell_.strays->lifted(world_.arm, "P1", {{2, "P2", {0.2, 0}}});
    cell_.lost = held_;
    cell_.lost->falls = falls_;
    cell_.lost->alone = false;
    skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
    fell_ = now_;
    ASSERT_EQ(skill_->tick(now_).status, Status::kRunning);
  }
  Progress ends() {
    Progress progress;
    while (progress.status == Status::kRunning && now_ < fell_ + from_s(5)) {
      pass();
      progress = skill_->tick(now_);
    }
    return progress;
  }

  task::SkillType type_ = place(cell_);
  std::unique_ptr<task::Skill> skill_;
  Time fell_;
};

TEST_F(LostOverItsChuteTest, ItIsSorted) {
  ASSERT_EQ(world_.places[0].name, "chute_1");
  const Progress progress = ends();
  EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
}

// Off a rim, while nobody looks any more.
TEST_F(LostOverItsChuteTest, WhatIsCountedOnceItWasGivenUpIsNamed) {
  --falls_[0];
  pass();
  cell_.lost = held_;
  skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
  const Progress progress = ends();
  EXPECT_EQ(progress.status, Status::kFailed);
  ++falls_[1];
  pass();
  const std::vector<Stray> strays = cell_.strays->take_found_gone();
  ASSERT_EQ(strays.size(), 1U);
  EXPECT_EQ(strays[0].code, "P1");
  EXPECT_EQ(strays[0].place, "chute_2");
}

// One that lay on a rim falls off it when another load comes down.
TEST_F(LostOverItsChuteTest, OfTwoCountsThatOfItsOwnMouthIsItsOwn) {
  for (const std::size_t first : {0U, 1U}) {
    pass();
    cell_.strays->dropped(world_.arm, "P0", now_);
    cell_.lost = held_;
    cell_.lost->falls = falls_;
    skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
    fell_ = now_;
    ASSERT_EQ(skill_->tick(now_).status, Status::kRunning);
    for (const std::size_t place : {first, 1 - first}) {
      ++falls_[place];
      pass();
      ASSERT_EQ(skill_->tick(now_).status, Status::kRunning);
    }
    const Progress progress = ends();
    EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
    const std::vector<Stray> strays = cell_.strays->take_found_gone();
    ASSERT_EQ(strays.size(), 1U);
    EXPECT_EQ(strays[0].code, "P0");
    EXPECT_EQ(strays[0].place, "chute_2");
  }
}

// Who hung on it fell beside.
TEST_F(LostOverItsChuteTest, OfTwoThatFellTheOneInItsOwnMouthIsTheLoad) {
  loses_it_with_another();
  for (const std::size_t place : {6U, 0U}) {
    ++falls_[place];
    pass();
    ASSERT_EQ(skill_->tick(now_).status, Status::kRunning);
  }
  const Progress progress = ends();
  EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
  ASSERT_NE(cell_.strays->place_of("P2"), nullptr);
  EXPECT_EQ(*cell_.strays->place_of("P2"), "chute_7");
}

// Which of them was counted nobody knows.
TEST_F(LostOverItsChuteTest, OfTwoOfWhichOneIsCountedEitherMayBeTheLoad) {
  loses_it_with_another();
  ++falls_[0];
  const Progress progress = ends();
  EXPECT_EQ(progress.status, Status::kException);
  EXPECT_EQ(progress.reason, "it or what hung on it fell into chute_1");
  EXPECT_EQ(progress.detail.at("fell_into"), "chute_1");
}

// It was too light for the scale, and nobody has read it. Curtains count both before the cups are known to be open, or
// after.
TEST_F(LostOverItsChuteTest, WhoMayHaveHungOnItUnfeltFellBeside) {
  const Company company{{2, "", {0.2, 0}}};
  for (const bool before : {true, false}) {
    seen_.resize(1);
    seen_[0].track = company[0].track;
    seen_[0].world_from_top.translation() = Vector3(-0.3, 0, 1.0);
    seen_[0].last_seen = now_;
    cell_.strays->lifted(world_.arm, "P1", company);
    pass();
    seen_.clear();
    cell_.lost = held_;
    cell_.lost->falls = falls_;
    cell_.lost->company = company;
    skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
    fell_ = now_;
    for (const std::size_t place : {1U, 0U}) {
      if (!before) {
        EXPECT_EQ(skill_->tick(now_).status, Status::kRunning);
      }
      ++falls_[place];
      pass();
    }
    const Progress progress = ends();
    EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
    for (int i = 0; i < 200; ++i) pass();
    const std::vector<Stray> strays = cell_.strays->take_found_gone();
    ASSERT_EQ(strays.size(), 1U) << before;
    EXPECT_EQ(strays[0].code, "");
    EXPECT_EQ(strays[0].place, "chute_2");
  }
}

// Nothing hung on it.
TEST_F(LostOverItsChuteTest, TheMouthThatCountedLastIsWhereItWent) {
  pass();
  cell_.lost = held_;
  cell_.lost->falls = falls_;
  for (const std::size_t place : {4U, 2U}) {
    ++falls_[place];
    pass();
  }
  skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
  const Progress progress = ends();
  EXPECT_EQ(progress.status, Status::kException);
  EXPECT_EQ(progress.detail.value("fell_into", std::string()), "chute_3");
}

class CarriedTest : public ObedientArmTest {
 protected:
  void SetUp() override { cerebellum_ = std::make_unique<link::CerebellumEnd>(*link_); }
  // Whether the cups were told to let go, since the last call.
  bool lets_go() {
    bool told = false;
    for (link::Command command; cerebellum_->receive(command);)
      told = told || (command.kind == link::CommandKind::kVacuum && command.vacuum_on == 0);
    return told;
  }
  std::unique_ptr<link::CerebellumEnd> cerebellum_;
  const task::SkillType type_ = place(cell_);
};

// On the straight way the arm's own links are in the way of so wide a load.
TEST_F(CarriedTest, WhatIsWideAndFarIsBroughtThereInTwoParts) {
  stands({0.56, -0.03, 1.04});
  cell_.held = Held{"P1", {{0.378, 0.284, 0.04}, 0, {}}, 0.83};
  const auto skill = type_.start(task::Json{{"place", "chute_6"}, {"object", "P1"}}, now_);
  Progress progress;
  bool gone = false;
  for (int i = 0; i < 1000 && progress.status == Status::kRunning && !gone; ++i) {
    pass();
    progress = skill->tick(now_);
    gone = lets_go();
  }
  ASSERT_TRUE(gone) << progress.reason;
  EXPECT_LT((tip_now() - world_.place("chute_6")->center_m).head<2>().norm(), 0.03);
}

// Leaning, one end first.
TEST_F(CarriedTest, WhatHangsBesideTheCupsIsBroughtWithItsMiddleOverTheMouth) {
  stands({0.3, -0.03, 1.3});
  const Load load{.size_m = {0.46, 0.16, 0.08}, .yaw_in_tip_rad = 0, .offset_in_tip_m = {0.03, 0, 0}};
  cell_.held = Held{"P1", load, 0.6};
  const auto skill = type_.start(task::Json{{"place", "chute_2"}, {"object", "P1"}}, now_);
  bool gone = false;
  for (int i = 0; i < 1000 && !gone; ++i) {
    pass();
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
    gone = lets_go();
  }
  ASSERT_TRUE(gone);
  const Pose tip = cell_.model.world_from_tip(cell_.arm.state().position);
  const Vector3 middle = tip * (load.offset_in_tip_m + Vector3(0, 0, 0.5 * load.size_m.z()));
  EXPECT_LT((middle - world_.place("chute_2")->center_m).head<2>().norm(), 0.005);
}

// On its rim, or beside it.
TEST_F(CarriedTest, WhatItsOwnCurtainDoesNotCountIsNamed) {
  ASSERT_EQ(world_.places[2].name, "chute_3");
  for (const bool counted : {true, false}) {
    opened_ = false;
    stands({0.4, -0.3, 1.4});
    cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 0.5};
    const auto skill = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
    Progress progress;
    for (int i = 0; i < 600 && progress.status == Status::kRunning; ++i) {
      pass();
      progress = skill->tick(now_);
      opened_ = opened_ || lets_go();
    }
    EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
    if (counted) ++falls_[2];
    for (int i = 0; i < 200; ++i) pass();
    const std::vector<Stray> strays = cell_.strays->take_found_gone();
    ASSERT_EQ(strays.size(), counted ? 0U : 1U);
    if (counted) continue;
    EXPECT_EQ(strays[0].code, "P1");
    EXPECT_EQ(strays[0].place, "");
  }
}

// A bridge that dies meanwhile must have written it down.
TEST_F(CarriedTest, WhatFallsOnTheWayIsLostUntilThatIsTold) {
  opened_ = false;
  stands({0.4, -0.3, 1.4});
  cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 0.5};
  const auto skill = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
  for (int i = 0; i < 20; ++i) {
    pass();
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
  }
  loses_ = true;
  Progress progress;
  int ticks = 0;
  for (; ticks < 600 && progress.status == Status::kRunning; ++ticks) {
    pass();
    progress = skill->tick(now_);
    if (progress.status != Status::kRunning) break;
    ASSERT_TRUE(cell_.lost);
    EXPECT_EQ(cell_.lost->code, "P1");
  }
  EXPECT_GT(ticks, 10);
  EXPECT_EQ(progress.reason, "dropped");
  EXPECT_FALSE(cell_.lost);
}

// Whatever a person says meanwhile: it is no more there to be held.
TEST_F(CarriedTest, CancelledOnceAStopHasTakenItOffTheCupsItSaysWhereItWent) {
  const Vector3 over = world_.place("chute_3")->center_m + Vector3(0, 0, 0.4);
  for (const bool armed : {true, false}) {
    opened_ = false;
    stands(over);
    cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 0.5, {}, true, {}, falls_};
    const auto skill = type_.start(task::Json{{"place", "chute_5"}, {"object", "P1"}}, now_);
    pass();
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
    skill->pause(now_, task::Pause::kStand);
    opened_ = true;
    stops_at(over, link::StopCause::kHeartbeatLost);
    ASSERT_FALSE(cell_.held);
    ASSERT_TRUE(cell_.lost);
    if (armed) is_armed_at(over);
    skill->cancel(now_);
    ++falls_[2];
    Progress progress;
    for (int i = 0; i < 600 && progress.status == Status::kRunning; ++i) {
      progress = skill->tick(now_);
      pass();
    }
    EXPECT_EQ(progress.reason, "fell into chute_3") << armed << " " << task::name(progress.status);
    EXPECT_FALSE(cell_.lost);
    is_armed_at(over);
  }
}

// It was sorted, whatever stopped the arm meanwhile.
TEST_F(CarriedTest, WhatIsLetGoOfInAStopIsNobodysLoss) {
  opened_ = false;
  stands({0.4, -0.3, 1.4});
  cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 0.5};
  const auto skill = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
  for (int i = 0; i < 600 && !lets_go(); ++i) {
    pass();
    ASSERT_EQ(skill->tick(now_).status, Status::kRunning);
  }
  const Vector3 over = tip_now();
  opened_ = true;
  stops_at(over, link::StopCause::kCommanded);
  ASSERT_TRUE(cell_.lost);
  EXPECT_EQ(skill->tick(now_).status, Status::kSucceeded);
  EXPECT_FALSE(cell_.lost);
}

// It was to be laid down, for its own task had given it up.
TEST_F(CarriedTest, WhatAStopTookOffTheCupsAfterItsTaskIsToldByTheNextPick) {
  const Vector3 over = world_.place("chute_3")->center_m + Vector3(0, 0, 0.15);
  stands(over);
  cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 1.5};
  opened_ = true;
  stops_at(over, link::StopCause::kHeartbeatLost);
  ASSERT_FALSE(cell_.held);
  ++falls_[static_cast<std::size_t>(world_.place("chute_3") - world_.places.data())];
  pass();
  is_armed_at(over);
  EXPECT_TRUE(cell_.strays->take_found_gone().empty());
  const auto skill = pick(cell_).start(task::Json{{"object", "P2"}}, now_);
  for (int i = 0; i < 3; ++i) (void)skill->tick(now_);
  const std::vector<Stray> gone = cell_.strays->take_found_gone();
  ASSERT_EQ(gone.size(), 1U) << "once";
  EXPECT_EQ(gone[0].code, "P1");
  EXPECT_EQ(gone[0].place, "chute_3");

  cell_.lost = held_;
  cell_.lost_at.reset();
  (void)pick(cell_).start(task::Json{{"object", "P2"}}, now_)->tick(now_);
  cell_.strays->fell(world_.arm, "chute_5", now_);
  EXPECT_TRUE(cell_.strays->take_found_gone().empty()) << "who took over has told of it";
}

// With an edge on the belt it weighed nothing on the scale.
TEST_F(CarriedTest, WhoIsFeltToHangOnItOnTheWayEndsTheWay) {
  const auto carries = [&](double felt_kg) {
    is_stopped_at({0.4, -0.3, 1.4});
    (void)lets_go();
    cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 1.5};
    hangs_kg_ = felt_kg;
    const auto skill = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
    Progress progress;
    for (int i = 0; i < 600 && progress.status == Status::kRunning && !lets_go(); ++i) {
      pass();
      progress = skill->tick(now_);
    }
    return progress;
  };
  EXPECT_EQ(carries(1.6).status, Status::kRunning) << "swings, and a scale is wrong by a little";
  const Progress progress = carries(4);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, testing::StartsWith("another hangs on P1: "));
  ASSERT_TRUE(cell_.held);
  EXPECT_FALSE(cell_.held->alone);
  EXPECT_NEAR(cell_.held->mass_kg, 4, 1);
  const auto again = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
  EXPECT_EQ(again->tick(now_).status, Status::kFailed) << "not before it was laid down";
  cell_.held->alone = true, cell_.held->doubtful = true;
  const auto doubtful = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
  EXPECT_EQ(doubtful->tick(now_).reason, "it may be another: nobody has seen it");
}

// Then a mouth is jammed, maybe. What stops the arm for another reason is no collision, however often it comes.
TEST_F(CarriedTest, ItIsGivenUpWhenSomethingIsStruckAThirdTime) {
  const auto ends_after = [&](link::StopCause cause, int most) {
    stands({0.4, -0.3, 1.4});
    cell_.held = Held{"P1", {{0.2, 0.15, 0.1}, 0, {}}, 0.5};
    const auto skill = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
    Progress progress;
    int stops = 0;
    while (progress.status == Status::kRunning && stops < most) {
      for (int i = 0; i < 10; ++i) {
        pass();
        progress = skill->tick(now_);
        EXPECT_EQ(progress.status, Status::kRunning) << progress.reason;
      }
      ++stops;
      stops_at({0.4, -0.3, 1.4}, cause);
      for (int i = 0; i < 3; ++i) EXPECT_EQ(skill->tick(now_).status, Status::kRunning);
      is_armed_at({0.4, -0.3, 1.4});
      progress = skill->tick(now_);
    }
    return std::pair(stops, progress);
  };
  const auto [stops, progress] = ends_after(link::StopCause::kCollision, 9);
  EXPECT_EQ(stops, 3);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_EQ(progress.reason, "chute_3: struck something 3 times on the way");
  ASSERT_TRUE(cell_.held);
  EXPECT_EQ(ends_after(link::StopCause::kHeartbeatLost, 6).second.status, Status::kRunning);
}

// A load over chute_3 that swings, less and less.
class SwingingTest : public CarriedTest {
 protected:
  // By what it still swings when it is let go of (Nm, as the wrist feels it).
  double swings_nm_when_let_go(const Vector3& size_m) {
    stands({0.4, -0.3, 1.4});
    cell_.held = Held{"P1", {size_m, 0, {}}, 2.5};
    const auto skill = type_.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
    for (int i = 0; i < 600; ++i) {
      const double swings_nm = 2.5 * std::exp(-i / 200.0);
      wrist_nm_ = swings_nm * Eigen::Vector2d(std::sin(0.116 * i), std::cos(0.09 * i));
      pass();
      EXPECT_EQ(skill->tick(now_).status, Status::kRunning);
      if (lets_go()) return swings_nm;
    }
    ADD_FAILURE() << "never let go of";
    return 0;
  }
};

TEST_F(SwingingTest, WhatHardlyPassesItsMouthHangsStillFirst) {
  EXPECT_LT(swings_nm_when_let_go({0.348, 0.343, 0.196}), 0.8);
  now_ += from_s(10);
  EXPECT_GT(swings_nm_when_let_go({0.2, 0.15, 0.1}), 1.1);
}

}  // namespace
}  // namespace pons::skills
