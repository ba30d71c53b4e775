#include "pons/skills/cell.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>

#include "pons/skills/grip.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

constexpr double kReserve = 0.40;  // of the cups' hold, the most that a planned carry may use up

class CarryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // At rest so high over the belt that every way is clear: only the load tells them apart.
    const auto from = cell_.model.inverse(Cell::tip_down({0.1, 0, 1.35}, 0), world_.robot.home);
    ASSERT_TRUE(from) << from.error().line();
    const AxisVector still = AxisVector::Zero(from->size());
    link::State state;
    state.safety = link::SafetyState::kOperational, state.epoch = 1;
    state.commanded = {*from, still, still};
    state.position = *from, state.speed = still;
    cerebellum_.publish(state);
    cell_.refresh(now_, {});
  }

  Expected<AxisVector> goal(const AxisVector& from) { return cell_.model.inverse(Cell::tip_down(goal_, 0), from); }
  motion::Trajectory carry(const Vector3& size_m, double mass_kg) {
    cell_.held = Held{"P000001", {.size_m = size_m}, mass_kg};
    Cell::Search search;
    auto way = cell_.carry(now_, [this](const AxisVector& from) { return goal(from); }, search);
    EXPECT_TRUE(way) << way.error().line();
    return way.value_or(motion::Trajectory{});
  }
  double use(const motion::Trajectory& way) {
    return grip_use(cell_.model, world_.robot.tool, cell_.held->load, cell_.held->mass_kg, way);
  }
  static double duration_s(const motion::Trajectory& way) { return to_s(way.back().end() - way.front().start); }

  Vector3 goal_{-0.2, 0.46, 1.3};
  const Time now_ = Time(from_s(4));
  const world::World world_ = parcel_cell();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd cerebellum_{*link_};
  Cell cell_{bridge_, world_, model::RobotModel::load(world_.robot).value()};
};

class RestTest : public CarryTest {
 protected:
  // On the belt, coming along, its front `ahead_m` from the tip.
  ObjectBelief coming(double ahead_m, double height_m) const {
    ObjectBelief object;
    object.track = 7;
    object.stamp = now_;
    object.size_m = {0.2, 0.2, height_m};
    object.world_from_top.translation() = Vector3(0.1 - ahead_m - 0.1, 0, world_.belt.surface_z_m + height_m);
    object.velocity_m_s.x() = 0.25;
    return object;
  }
  double highest_tip_m() {
    double highest = 0;
    for (Time time = now_; time <= cell_.arm.motion_end(); time += std::chrono::milliseconds(10))
      highest = std::max(highest, cell_.model.world_from_tip(cell_.arm.planned(time).position).translation().z());
    return highest;
  }
};

// A lift rides along: what came off on the way back lies further on, and no camera sees it there.
TEST_F(RestTest, WhoHungOnWhatWasPutBackIsInTheWayFurtherOn) {
  const auto rooms = [&](const std::vector<ObjectBelief>& seen, Time now) {
    cell_.refresh(now, seen);
    return std::ranges::count(cell_.objects(), 0U, &ObjectBelief::track);
  };
  const ObjectBelief beside = coming(0.4, 0.2);
  EXPECT_EQ(rooms({beside}, now_), 0);
  cell_.held = Held{.code = "P1", .company = {{beside.track, "", {0.3, 0}}}, .alone = false, .ahead_m = 0.2};
  cell_.left_on_belt(Cell::tip_down({0, 0, 1.1}, 0));
  cell_.holds_nothing();
  EXPECT_EQ(rooms({beside}, now_ + from_s(0.01)), 0);
  EXPECT_EQ(rooms({}, now_ + from_s(0.02)), 1);
}

TEST_F(RestTest, AnArmThatWaitsMakesRoomForWhatIsTallAndNearOnly) {
  const Time rested = cell_.arm.motion_end();
  Time now = now_;
  for (const ObjectBelief& harmless : {coming(0.2, 0.40), coming(1.0, 0.46)}) {
    cell_.refresh(now_, {harmless});
    cell_.keep_clear(now += std::chrono::milliseconds(200));
    EXPECT_EQ(cell_.arm.motion_end(), rested) << harmless.size_m.z();
  }
  cell_.refresh(now_, {coming(0.4, 0.46)});
  cell_.keep_clear(now += std::chrono::milliseconds(200));
  EXPECT_GT(cell_.arm.motion_end(), rested);
}

TEST_F(RestTest, ItRisesOverWhatWouldMeetTheTool) {
  cell_.refresh(now_, {coming(0.2, 0.46)});
  cell_.keep_clear(now_);
  EXPECT_GT(highest_tip_m(), world_.belt.surface_z_m + 0.46 + 0.01);
}

TEST_F(RestTest, WhatItHoldsRisesToo) {
  cell_.held = Held{"P000001", {.size_m = {0.2, 0.15, 0.15}}, 1.0};
  cell_.refresh(now_, {coming(0.2, 0.32)});
  cell_.keep_clear(now_);
  EXPECT_GT(highest_tip_m(), world_.belt.surface_z_m + 0.32 + 0.15 + 0.01);
}

// Another arm may have to come there, while what this one is to take does not come.
using ZoneTest = ObedientArmTest;
TEST_F(ZoneTest, AnArmThatWaitsLeavesTheZoneBetweenArms) {
  world::Place& place = world_.places[0];
  place.resource = "between";
  opened_ = true;
  stands(place.center_m + 0.3 * Vector3::UnitZ());
  ASSERT_TRUE(cell_.stands_in_zone());
  ASSERT_TRUE(cell_.arm.stop(now_)) << "it has come here just now";
  const Time came = cell_.arm.motion_end();
  const auto waits = [&](double s) {
    for (const Time until = now_ + from_s(s); now_ < until; pass()) cell_.keep_clear(now_);
  };
  waits(0.15);
  EXPECT_EQ(cell_.arm.motion_end(), came) << "it may be about to leave anyway";
  cell_.held = held_;
  waits(1);
  EXPECT_TRUE(cell_.stands_in_zone()) << "what it holds has a place to go to";
  cell_.held.reset();
  waits(2);
  EXPECT_FALSE(cell_.stands_in_zone());
}

class LeftOnBeltTest : public CarryTest {
 protected:
  void SetUp() override {
    CarryTest::SetUp();
    Pose tip = Cell::tip_down({0.1, 0.05, 1.2}, 0.3);
    cell_.held = Held{"P000001", {.size_m = {0.2, 0.15, 0.1}, .yaw_in_tip_rad = 0.3}, 1.0};
    cell_.left_on_belt(tip);
    cell_.holds_nothing();
  }
  // Without a label, there.
  [[nodiscard]] ObjectBelief seen(double x_m, double y_m) const {
    ObjectBelief object;
    object.track = 7;
    object.stamp = object.last_seen = now_ + from_s(0.5);
    object.size_m = {0.2, 0.15, 0.1};
    object.world_from_top.translation() = Vector3(x_m, y_m, world_.belt.surface_z_m + 0.1);
    return object;
  }
};

TEST_F(LeftOnBeltTest, IsKnownWithoutACameraAsLyingOnTheBelt) {
  cell_.refresh(now_ + from_s(0.01), {});
  const ObjectBelief* const left = cell_.find("P000001");
  ASSERT_NE(left, nullptr);
  EXPECT_NEAR(left->world_from_top.translation().x(), 0.1, 1e-9);
  EXPECT_NEAR(left->world_from_top.translation().z(), world_.belt.surface_z_m + 0.1, 1e-9);
  EXPECT_NEAR(left->world_from_top.linear()(0, 0), 1, 1e-9) << "turned as it hung";
  EXPECT_NE(left->track, 0U);
}

TEST_F(LeftOnBeltTest, WhatIsSeenThereKeepsItsLabelAndIsOne) {
  cell_.refresh(now_ + from_s(0.5), {seen(0.12, 0.05)});
  ASSERT_EQ(cell_.objects().size(), 1U);
  EXPECT_EQ(cell_.objects()[0].code, "P000001");
  cell_.refresh(now_ + from_s(1), {seen(0.3, 0.05)});
  ASSERT_NE(cell_.find("P000001"), nullptr) << "the same track, wherever it has ridden";
  EXPECT_EQ(cell_.find("P000001")->track, 7U);
  cell_.lifted(*cell_.find("P000001"));
  EXPECT_EQ(cell_.take_forgotten(), std::vector<std::uint32_t>{7});
}

class DroppedTest : public ObedientArmTest {
 protected:
  void loses_over(const Vector3& tip) {
    stands(tip);
    cell_.held = held_;
    cell_.dropped();
  }
  // Unread, of the load's size on another side.
  [[nodiscard]] ObjectBelief seen() const {
    ObjectBelief object;
    object.track = 3;
    object.frames_seen = 3;
    object.size_m = {0.3, 0.1, 0.2};
    object.world_from_top.translation() = Vector3(-0.1, 0.1, 1.1);
    return object;
  }
};

TEST_F(DroppedTest, OverTheBeltItIsAwaitedAndKnownByPlaceAndSize) {
  loses_over({-0.2, 0, 1.2});
  EXPECT_FALSE(cell_.held);
  EXPECT_TRUE(cell_.awaits("P1"));
  pass();
  EXPECT_EQ(cell_.find("P1"), nullptr);
  seen_ = {seen()};
  pass();
  ASSERT_NE(cell_.find("P1"), nullptr);
  EXPECT_EQ(cell_.find("P1")->track, 3U);
  EXPECT_FALSE(cell_.awaits("P1"));
  std::vector<ObjectBelief> others{seen()};
  others[0].half_seen = true;
  cell_.label(others);
  EXPECT_EQ(others[0].code, "P1") << "for the brain, too";
  EXPECT_FALSE(others[0].half_seen) << "the hand knows it";
}

// Then it lies anywhere again.
TEST_F(DroppedTest, WhatTurnsOutToBeLargerIsNotTakenForItAnyMore) {
  loses_over({-0.2, 0, 1.2});
  seen_ = {seen()};
  pass();
  ASSERT_NE(cell_.find("P1"), nullptr);
  seen_[0].size_m.y() = 0.2;
  seen_[0].frames_seen = 9;
  pass();
  EXPECT_EQ(cell_.find("P1"), nullptr);
  cell_.strays->fell(world_.arm, "chute_2", now_);
  EXPECT_EQ(cell_.strays->take_found_gone().at(0).code, "P1");
}

TEST_F(DroppedTest, OverAChuteOrOutOfViewItIsNot) {
  loses_over({-0.2, 0.46, 1.2});
  EXPECT_FALSE(cell_.awaits("P1"));
  pass();
  EXPECT_TRUE(cell_.objects().empty());
  loses_over({0.4, 0, 1.2});
  EXPECT_FALSE(cell_.awaits("P1"));
  pass();
  ASSERT_EQ(cell_.objects().size(), 1U) << "but something is in the way there";
  EXPECT_NEAR(cell_.objects()[0].world_from_top.translation().x(), 0.4, 1e-9);
  cell_.await_no_more("P1");
  pass();
  EXPECT_TRUE(cell_.objects().empty());
}

class FeltBySomeTest : public ObedientArmTest {
 protected:
  void SetUp() override {
    stands({0.1, 0, 1.2});
    ObjectBelief object;
    object.track = 3;
    object.code = "P1";
    object.last_seen = now_;
    object.world_from_top.translation() = Vector3(0.3, 0, 1.0);
    seen_ = {object};
  }
  // Some cups have sealed, the tool down and its x axis along the world's.
  void touches(std::size_t cups) {
    sealed_cups_ = cups;
    pass();
    cell_.felt_by_some("P1", Cell::tip_down({}, 0).linear());
    pass();
  }
  Vector3 believed() { return cell_.find("P1")->world_from_top.translation(); }
};

TEST_F(FeltBySomeTest, ItLiesTowardsTheCupsThatSealed) {
  const std::vector<Vector3>& cups = world_.robot.tool.cups_m;
  const Vector3 first_two = 0.5 * (cups[0] + cups[1]);  // pointing down, the tool has the world's y the other way
  touches(2);
  EXPECT_NEAR(believed().x(), 0.3 + first_two.x(), 1e-9);
  EXPECT_NEAR(believed().y(), -first_two.y(), 1e-9);
  touches(2);
  EXPECT_NEAR(believed().y(), -2 * first_two.y(), 1e-9) << "further still";
}

TEST_F(FeltBySomeTest, UntilItIsSeenAgain) {
  touches(1);
  EXPECT_NE(believed(), Vector3(0.3, 0, 1.0));
  seen_[0].last_seen = now_ + from_s(1);
  pass();
  EXPECT_EQ(believed(), Vector3(0.3, 0, 1.0));
  seen_[0].last_seen = Time{};
  pass();
  EXPECT_EQ(believed(), Vector3(0.3, 0, 1.0)) << "a camera knew better";
}

TEST_F(FeltBySomeTest, CupsOfWhichNoneSealsTellNothing) {
  touches(0);
  EXPECT_EQ(believed(), Vector3(0.3, 0, 1.0));
}

// It leans, or lies on another: there the arm would strike it again.
TEST_F(LeftOnBeltTest, WhatIsStruckIsOnlyAnObstacle) {
  cell_.struck("P000002");
  ASSERT_EQ(cell_.left().size(), 1U);
  cell_.struck("P000001");
  EXPECT_TRUE(cell_.left().empty()) << "nobody asks for it";
  cell_.refresh(now_ + from_s(0.5), {seen(0.12, 0.05)});
  EXPECT_EQ(cell_.find("P000001"), nullptr) << "what is seen there may be what it leans on";
  ASSERT_EQ(cell_.objects().size(), 2U);
  EXPECT_GT(cell_.objects()[1].world_from_top.translation().z(), world_.belt.surface_z_m + 0.19);
}

// With a label of its own, and no higher. Its neighbour overlaps it little, and what hooked may have come to lie on it.
TEST_F(LeftOnBeltTest, WhereAnotherIsSeenItLiesNoMore) {
  const auto is_left = [&](double x_m, double higher_m, const char* code, bool whole = true) {
    ObjectBelief other = seen(x_m, 0.05);
    other.code = code;
    other.confidence = whole ? 1 : 0.3;
    other.frames_seen = 3;
    other.world_from_top.translation().z() += higher_m;
    cell_.refresh(now_ + from_s(0.5), {other});
    return cell_.find("P000001") != nullptr;
  };
  EXPECT_TRUE(is_left(0.36, 0, "P000002")) << "beside it";
  EXPECT_TRUE(is_left(0.2, 0, "")) << "unread";
  EXPECT_TRUE(is_left(0.2, 0.05, "P000002")) << "on it";
  EXPECT_TRUE(is_left(0.2, -0.08, "P000002")) << "under it";
  EXPECT_TRUE(is_left(0.2, -0.03, "P000002", false)) << "what of it shows may be measured wrong";
  EXPECT_FALSE(is_left(0.2, -0.03, "P000002"));
}

TEST_F(LeftOnBeltTest, WhatIsSeenElsewhereIsAnother) {
  cell_.refresh(now_ + from_s(0.5), {seen(0.2, 0.05)});
  ASSERT_EQ(cell_.objects().size(), 2U);
  EXPECT_EQ(cell_.objects()[0].code, "");
  EXPECT_NE(cell_.find("P000001")->track, 7U);
  cell_.lifted(*cell_.find("P000001"));
  cell_.refresh(now_ + from_s(0.6), {seen(0.2, 0.05)});
  EXPECT_EQ(cell_.find("P000001"), nullptr);
}

class UnseenEndTest : public ObedientArmTest {
 protected:
  // It comes after what was seen.
  [[nodiscard]] double unseen_from_m() const {
    const ObjectBelief& object = cell_.objects().back();
    return object.world_from_top.translation().x() - 0.5 * object.size_m.x();
  }
  [[nodiscard]] double unseen_to_m() const { return unseen_from_m() + cell_.objects().back().size_m.x(); }
};

TEST_F(UnseenEndTest, RidesOffTheEnd) {
  stands({0, 0, 1.4});
  cell_.unseen_end(0.3);
  belt_m_s_ = 0.2;
  pass();
  ASSERT_EQ(cell_.objects().size(), 1U);
  const double began_m = unseen_from_m();
  // So high over the belt the view ends sooner than on it.
  EXPECT_NEAR(began_m, 0.095, 0.003);
  EXPECT_TRUE(cell_.in_view(began_m + 0.12));
  EXPECT_EQ(cell_.objects().front().size_m.y(), world_.belt.width_m);
  EXPECT_NEAR(cell_.objects().front().world_from_top.translation().z(), world_.belt.surface_z_m + 0.3, 1e-9);
  for (int i = 0; i < 100; ++i) pass();
  ASSERT_EQ(cell_.objects().size(), 1U);
  EXPECT_NEAR(unseen_from_m(), began_m + 0.2, 1e-9);
  EXPECT_NEAR(unseen_to_m(), world_.belt.x_end_m, 1e-9);
  for (double x_m = unseen_from_m(); x_m < world_.belt.x_end_m; x_m += 0.002) pass();
  pass();
  EXPECT_TRUE(cell_.objects().empty());
}

// Nobody knows how long that is, and soon no camera shows it.
TEST_F(UnseenEndTest, BeginsWithWhatTheBorderCuts) {
  stands({0, 0, 1.4});
  cell_.unseen_end(0.3);
  ObjectBelief coming, tracked, cut;
  coming.size_m = tracked.size_m = cut.size_m = {0.4, 0.2, 0.1};
  coming.world_from_top.translation().x() = -1.2;
  tracked.track = 7;
  tracked.world_from_top.translation().x() = 0.1;
  seen_ = {coming, tracked};
  pass();
  ASSERT_EQ(cell_.objects().size(), 3U);
  EXPECT_GT(unseen_from_m(), 0.09);
  cut.world_from_top.translation().x() = 0.1;
  seen_.push_back(cut);
  pass();
  EXPECT_NEAR(unseen_from_m(), -0.1, 1e-9);
  seen_.clear();
  pass();
  EXPECT_NEAR(unseen_from_m(), -0.1, 1e-9);
  // What the border cuts after so long a ride was whole in view before.
  belt_m_s_ = 0.2;
  for (int i = 0; i < 205; ++i) pass();
  seen_ = {cut};
  pass();
  EXPECT_GT(unseen_from_m(), 0.3);
}

TEST_F(UnseenEndTest, IsNoHigherThanWhereTheArmPasses) {
  stands({0.3, 0, 1.1});
  cell_.unseen_end(0.3);
  cell_.hides(0.4, 0.12);
  pass();
  ASSERT_EQ(cell_.objects().size(), 2U);
  for (const ObjectBelief& object : cell_.objects()) EXPECT_EQ(object.size_m.z(), 0.12);
  cell_.hides_nothing();
  pass();
  ASSERT_EQ(cell_.objects().size(), 1U);
  EXPECT_EQ(cell_.objects().front().size_m.z(), 0.3);
}

TEST_F(CarryTest, WhatIsHeavyAndTallGoesSlowerThanWhatIsLightAndFlat) {
  const motion::Trajectory light = carry({0.2, 0.15, 0.02}, 0.2);
  EXPECT_LE(use(light), kReserve);
  const double light_s = duration_s(light);
  for (const double mass_kg : {2.0, 3.5}) {
    const motion::Trajectory heavy = carry({0.2, 0.2, 0.3}, mass_kg);
    // The light one's haste would take the heavy one off the cups.
    EXPECT_GT(use(light), 1.5 * kReserve);
    EXPECT_LE(use(heavy), kReserve) << mass_kg << " kg";
    EXPECT_GT(duration_s(heavy), 1.15 * light_s) << mass_kg << " kg";
    // It does not crawl either: no carry is slower than the cups ask for.
    EXPECT_GT(use(heavy), 0.7 * kReserve) << mass_kg << " kg";
  }
}

TEST_F(CarryTest, WhatTheCupsHoldWithLessVacuumGoesSlower) {
  const Vector3 size_m{0.2, 0.2, 0.3};
  const double base_s = duration_s(carry(size_m, 2));
  cell_.grip_share = 0.5;
  const motion::Trajectory slow = carry(size_m, 2);
  EXPECT_LE(use(slow), 0.5 * kReserve);
  EXPECT_GT(duration_s(slow), 1.1 * base_s);
}

TEST_F(CarryTest, AsHighOrAsHeavyAloneAlreadySlowsItDown) {
  const double base_s = duration_s(carry({0.2, 0.2, 0.05}, 1.5));
  EXPECT_GT(duration_s(carry({0.2, 0.2, 0.3}, 1.5)), 1.05 * base_s);
  EXPECT_GT(duration_s(carry({0.2, 0.2, 0.05}, 3.4)), 1.02 * base_s);
}

TEST_F(CarryTest, AsksNoMoreOfTheMotorsThanTheyGive) {
  const Vector3 size_m{0.24, 0.18, 0.14};
  const double mass_kg = 4.5, give = 0.92;
  const auto torque = [&](const motion::Trajectory& way) {
    return torque_use(cell_.model, world_.robot, cell_.held->load, mass_kg, way);
  };
  goal_ = {-0.8, -0.46, 1.06};
  const motion::Trajectory light = carry(size_m, 0.1);
  EXPECT_GT(torque(light), give) << "the light one's haste would be too much for them";
  EXPECT_LE(torque(carry(size_m, mass_kg)), give);
}

// As slowly as can be it would still come off the cups, or stall the arm far out: not even tried.
TEST_F(CarryTest, WhatNoSpeedCanCarryIsRefused) {
  const auto refused = [this](const Vector3& size_m, double mass_kg) {
    cell_.held = Held{"P000001", {.size_m = size_m}, mass_kg};
    Cell::Search search;
    Expected<motion::Trajectory> way;
    do {  // a tick each
      cell_.refresh(now_, {});
      way = cell_.carry(now_, [this](const AxisVector& from) { return goal(from); }, search);
    } while (!way && cell_.router.spent());
    EXPECT_EQ(search.share, 1) << "the next carry begins anew";
    return way ? std::string("carried") : way.error().line();
  };
  EXPECT_TRUE(refused({0.2, 0.2, 0.2}, 10).starts_with("carry: 10.00 kg are too heavy"))
      << refused({0.2, 0.2, 0.2}, 10);
  Cell::Search must{.must = true};
  EXPECT_TRUE(cell_.carry(now_, [this](const AxisVector& from) { return goal(from); }, must)) << "to put it down";
  goal_ = {-0.8, -0.46, 1.06};
  const Vector3 flat(0.2, 0.2, 0.02);
  EXPECT_EQ(refused(flat, 5), "carried");
  EXPECT_TRUE(refused(flat, 9).starts_with("carry: 9.00 kg are too heavy")) << refused(flat, 9);  // for the motors
}

TEST_F(CarryTest, EndsAtRestAtTheGoalWithinTheLimits) {
  const motion::Trajectory way = carry({0.2, 0.2, 0.3}, 3);
  const AxisVector end = goal(motion::sample(way, way.front().start, cell_.model.axes()).position).value();
  const AxisState last = motion::sample(way, way.back().end(), cell_.model.axes());
  EXPECT_TRUE(last.position.isApprox(end, 1e-7));
  EXPECT_TRUE(last.speed.isZero(1e-7));
  EXPECT_LE(motion::limit_use(way, world_.robot.limits).worst(), 1.0);
}

// What was found out about one way is not carried over to the next.
TEST_F(CarryTest, ASearchThatHasEndedIsForgotten) {
  cell_.held = Held{"P000001", {.size_m = {0.3, 0.3, 0.2}}, 3.4};
  Cell::Search search{.share = 0.3, .corrections = 2, .known = Passage{.higher_m = 0.25, .leads = false}};
  const auto way = cell_.carry(now_, [this](const AxisVector& from) { return goal(from); }, search);
  ASSERT_TRUE(way) << way.error().line();
  EXPECT_EQ(search.share, 1);
  EXPECT_EQ(search.corrections, 0);
  EXPECT_FALSE(search.known);
}

TEST_F(CarryTest, AGoalOutOfReachIsNamed) {
  cell_.held = Held{"P000001", {.size_m = {0.2, 0.2, 0.1}}, 1};
  Cell::Search search;
  const auto beyond = [this](const AxisVector& from) {
    return cell_.model.inverse(Cell::tip_down({3, 0, 1.2}, 0), from);
  };
  const auto way = cell_.carry(now_, beyond, search);
  ASSERT_FALSE(way);
  EXPECT_FALSE(way.error().what.empty());
}

}  // namespace
}  // namespace pons::skills
