#include "pons/skills/place.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace pons::skills
