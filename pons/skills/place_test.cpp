#include "pons/skills/place.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

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
    cell_.watch("tray", kThings, now_);
    cell_.lost = held_;
    skill_ = type_.start(task::Json{{"place", "chute_1"}, {"object", "P1"}}, now_);
    fell_ = now_;
    EXPECT_EQ(skill_->tick(now_).status, Status::kRunning);
    ++falls_[0];
  }
  // Ticks until it ends; the tray's camera shows so many things at that time.
  Progress ends(double shown_s, int things) {
    Progress progress;
    while (progress.status == Status::kRunning && now_ < fell_ + from_s(5)) {
      pass();
      if (now_ >= fell_ + from_s(shown_s)) cell_.watch("tray", things, fell_ + from_s(shown_s));
      progress = skill_->tick(now_);
    }
    return progress;
  }

  static constexpr int kThings = 2;
  task::SkillType type_ = place(cell_);
  std::unique_ptr<task::Skill> skill_;
  Time fell_;
};

TEST_F(LostOverItsChuteTest, ItIsSortedOnceTheTrayIsSeenAsItWas) {
  ASSERT_EQ(world_.places[0].name, "chute_1");
  const Progress progress = ends(1.2, kThings);
  EXPECT_EQ(progress.status, Status::kSucceeded) << progress.reason;
  EXPECT_GE(now_, fell_ + from_s(1.2));
}

TEST_F(LostOverItsChuteTest, WithOneThingMoreOnTheTrayItLiesThere) {
  const Progress progress = ends(1.2, kThings + 1);
  EXPECT_EQ(progress.status, Status::kException) << progress.reason;
  EXPECT_EQ(progress.detail.value("fell_into", std::string()), "tray");
}

// It may still be falling.
TEST_F(LostOverItsChuteTest, APictureOfTheNextMomentSaysNothing) {
  const Progress progress = ends(0.2, kThings);
  EXPECT_EQ(progress.status, Status::kSucceeded) << "the camera has failed since";
  EXPECT_GE(now_, fell_ + from_s(2));
}

// A load over chute_3 that swings, less and less.
class SwingingTest : public ObedientArmTest {
 protected:
  // By what it still swings when it is let go of (Nm, as the wrist feels it).
  double swings_nm_when_let_go(const Vector3& size_m) {
    stands({0.4, -0.3, 1.4});
    cell_.held = Held{"P1", {size_m, 0, {}}, 2.5};
    const task::SkillType type = place(cell_);
    const auto skill = type.start(task::Json{{"place", "chute_3"}, {"object", "P1"}}, now_);
    link::CerebellumEnd cerebellum(*link_);
    link::Command command;
    for (int i = 0; i < 600; ++i) {
      const double swings_nm = 2.5 * std::exp(-i / 200.0);
      wrist_nm_ = swings_nm * Eigen::Vector2d(std::sin(0.116 * i), std::cos(0.09 * i));
      pass();
      EXPECT_EQ(skill->tick(now_).status, Status::kRunning);
      while (cerebellum.receive(command))
        if (command.kind == link::CommandKind::kVacuum && command.vacuum_on == 0) return swings_nm;
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
