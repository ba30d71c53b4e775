#include "pons/perception/tracker.hpp"

#include <gtest/gtest.h>

#include "pons/perception/synthetic_camera.hpp"

namespace pons::perception {
namespace {

// An empty, fully seen belt, and sightings made by hand.
struct Bench {
  TopView view;
  Segments segments;
  Tracker tracker{belt_world()};
  Time now;

  Bench() {
    view.cell_m = 0.002, view.x0_m = -1.1, view.y0_m = -0.3, view.surface_z_m = 0.9;
    view.height.create(300, 650);
    view.height.setTo(TopView::kLevel);
    view.flags = cv::Mat1b::zeros(300, 650);
    segments.labels = cv::Mat1i::zeros(300, 650);
  }
  static Sighting sighting(double x, double y, double yaw = 0, Vector3 size = {0.2, 0.15, 0.1}) {
    Sighting s;
    s.world_from_top = pose_xyz_yaw(x, y, 0.9 + size.z(), yaw);
    s.yaw_rad = yaw, s.size_m = size, s.complete = true, s.fill = 1;
    const Eigen::Rotation2Dd turn(yaw);
    for (const double a : {-0.5, 0.5})
      for (const double b : {-0.5, 0.5})
        s.hull_m.emplace_back(Eigen::Vector2d(x, y) + turn * Eigen::Vector2d(a * size.x(), b * size.y()));
    return s;
  }
  std::vector<std::uint32_t> update(const std::vector<Sighting>& sightings, double travel_m = 0) {
    now += from_s(0.2);
    return tracker.update(view, segments, sightings, now, travel_m);
  }
  // In the middle of where the track is believed to be, or aside of that.
  void read(std::uint32_t track, const char* code, const Eigen::Vector2d& aside_m = Eigen::Vector2d::Zero()) {
    for (const ObjectBelief& belief : tracker.beliefs(now, 0)) {
      if (belief.track != track) continue;
      tracker.label_read(track, code, belief.world_from_top.translation().head<2>() + aside_m);
    }
  }
};

TEST(TrackerTest, NeverUsesATrackAgain) {
  Bench bench;
  const auto first = bench.update({Bench::sighting(-0.5, 0)});
  for (int i = 0; i < 3; ++i) bench.update({});
  EXPECT_TRUE(bench.tracker.beliefs(bench.now, 0).empty());
  const auto second = bench.update({Bench::sighting(-0.5, 0)});
  EXPECT_GT(second.at(0), first.at(0));
}

TEST(TrackerTest, AveragesOverFrames) {
  Bench bench;
  for (const double error : {0.004, -0.004, 0.002, -0.002}) bench.update({Bench::sighting(-0.5 + error, error)});
  const auto beliefs = bench.tracker.beliefs(bench.now, 0.1);
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_NEAR(beliefs[0].world_from_top.translation().x(), -0.4, 1e-9);
  EXPECT_EQ(beliefs[0].frames_seen, 4);
}

TEST(TrackerTest, KeepsTheAxesOfASquareThatFlips) {
  Bench bench;
  constexpr double kQuarter = 1.5707963267948966;
  for (int i = 0; i < 6; ++i) {
    bench.update({Bench::sighting(-0.5, 0, i % 2 == 0 ? 0.2 : 0.2 + kQuarter, {0.2, 0.199, 0.1})});
  }
  const auto beliefs = bench.tracker.beliefs(bench.now, 0);
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_NEAR(std::atan2(beliefs[0].world_from_top.linear()(1, 0), beliefs[0].world_from_top.linear()(0, 0)), 0.2,
              1e-6);
  EXPECT_GT(beliefs[0].confidence, 0.9);
}

TEST(TrackerTest, OneBadCutChangesNothingTwoDo) {
  Bench bench;
  for (int i = 0; i < 4; ++i) bench.update({Bench::sighting(-0.5, 0)});
  bench.update({Bench::sighting(-0.54, 0, 0, {0.16, 0.15, 0.1})});
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.2, 1e-9);
  bench.update({Bench::sighting(-0.54, 0, 0, {0.16, 0.15, 0.1})});
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.16, 1e-9);
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).size(), 1u);
}

// A shadow, or a load that is carried over it.
TEST(TrackerTest, OneThatComesApartForAMomentStaysOne) {
  Bench bench;
  const std::vector<Sighting> pieces{Bench::sighting(-0.53, 0, 0, {0.14, 0.15, 0.1}),
                                     Bench::sighting(-0.43, 0, 0, {0.06, 0.15, 0.1})};
  for (int i = 0; i < 5; ++i) bench.update({Bench::sighting(-0.5, 0)});
  for (int times = 0; times < 3; ++times) {
    for (int i = 0; i < 2; ++i) bench.update(pieces);
    ASSERT_EQ(bench.tracker.beliefs(bench.now, 0).size(), 1u);
    EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.2, 1e-9);
    bench.update({Bench::sighting(-0.5, 0)});
  }
  for (int i = 0; i < 3; ++i) bench.update(pieces);
  ASSERT_EQ(bench.tracker.beliefs(bench.now, 0).size(), 2u) << "it was two all the time";
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.14, 1e-9);
}

// What hangs before the camera hides its middle for as long as it likes.
TEST(TrackerTest, WhatShowsOnBothSidesOfAScreenStaysOne) {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.update({Bench::sighting(-0.5, 0)});
  std::vector<Sighting> pieces{Bench::sighting(-0.57, 0, 0, {0.06, 0.15, 0.1}),
                               Bench::sighting(-0.43, 0, 0, {0.06, 0.15, 0.1})};
  for (Sighting& piece : pieces) piece.at_screen = true, piece.complete = false;
  for (int i = 0; i < 12; ++i) bench.update(pieces);
  ASSERT_EQ(bench.tracker.beliefs(bench.now, 0).size(), 1u);
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.2, 1e-9);
}

TEST(TrackerTest, CutsThatAllDifferChangeNothing) {
  Bench bench;
  std::uint32_t id = 0;
  for (int i = 0; i < 2; ++i) id = bench.update({Bench::sighting(-0.5, 0, 0, {0.12, 0.10, 0.1})}).at(0);
  bench.read(id, "A");
  for (const Vector3& cut : {Vector3(0.18, 0.16, 0.1), Vector3(0.22, 0.13, 0.1), Vector3(0.26, 0.15, 0.1)}) {
    bench.update({Bench::sighting(-0.53, 0.02, 0, cut)});
    EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.12, 1e-9);
    EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).world_from_top.translation().x(), -0.5, 1e-9);
    EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "A");
  }
}

TEST(TrackerTest, WhatStandsAloneAtLastIsMeasuredAfresh) {
  Bench bench;
  Sighting cut = Bench::sighting(-0.5, 0, 0, {0.208, 0.15, 0.1});
  cut.crowded = true;
  for (int i = 0; i < 12; ++i) bench.update({cut});
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.208, 1e-9);
  for (int i = 0; i < 2; ++i) bench.update({Bench::sighting(-0.504, 0)});
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.2, 1e-9);
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).world_from_top.translation().x(), -0.504, 1e-9);
}

// At the end of the view, say, with something before the camera.
TEST(TrackerTest, APieceOfOneThatIsMeasuredAfreshIsNoOther) {
  Bench bench;
  Sighting crowded = Bench::sighting(-0.5, 0);
  crowded.crowded = true;
  for (int i = 0; i < 8; ++i) bench.update({crowded});
  bench.update({Bench::sighting(-0.5, 0)});
  EXPECT_EQ(bench.update({Bench::sighting(-0.585, 0.01, 1.5, {0.12, 0.03, 0.1})}).at(0), 0U);
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).size(), 1U);
}

// As a load carried over it hides more and more of it, and then less.
TEST(TrackerTest, WhatHangsOverAParcelNeitherMovesNorRenamesIt) {
  Bench bench;
  std::uint32_t id = 0;
  for (int i = 0; i < 4; ++i) id = bench.update({Bench::sighting(-0.5, 0)}).at(0);
  bench.read(id, "A");
  for (const double hidden : {0.03, 0.05, 0.08, 0.0, 0.0}) {
    bench.update({Bench::sighting(-0.5 - 0.5 * hidden, 0, 0, {0.2 - hidden, 0.15, 0.1})});
  }
  bench.now += from_s(1);
  const auto beliefs = bench.tracker.beliefs(bench.now, 0);
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_EQ(beliefs[0].code, "A");
  EXPECT_NEAR(beliefs[0].world_from_top.translation().x(), -0.5, 2e-3);
  EXPECT_NEAR(beliefs[0].size_m.x(), 0.2, 2e-3);
}

// Something came along with a load, was seen in the air over a third, and fell back; of that one, a load hides a part.
TEST(TrackerTest, WhatNoLongerHangsWhereLowerThingsShowIsGone) {
  Bench bench;
  const auto show = [&](double top_m) {
    const cv::Rect there{255, 120, 90, 60};
    bench.segments.labels(there).setTo(1);
    bench.view.height(there).setTo(TopView::steps(top_m));
    Sighting part = Bench::sighting(-0.5, 0, 0, {0.18, 0.12, top_m});
    part.complete = false;
    bench.update({part});
    return bench.tracker.beliefs(bench.now, 0).size();
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(show(0.09), 1U);
  EXPECT_EQ(show(0.12), 2U);
  EXPECT_EQ(show(0.11), 2U) << "as high as it was, all but";
  EXPECT_EQ(show(0.09), 2U) << "once may be a bad reading";
  EXPECT_EQ(show(0.09), 1U);
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.z(), 0.09, 1e-9);
}

// Two side by side that were taken for one, with the label of the one that the track does not become.
TEST(TrackerTest, ALabelThatTurnsOutToLieBesideItIsNotIts) {
  for (const bool beside : {true, false}) {
    Bench bench;
    Sighting both = Bench::sighting(-0.5, 0.01, 0, {0.216, 0.143, 0.1});
    both.complete = false;
    std::uint32_t id = 0;
    for (int i = 0; i < 3; ++i) id = bench.update({both}).at(0);
    bench.read(id, "A", {0, beside ? 0.06 : -0.04});
    ASSERT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "A");
    Sighting one = Bench::sighting(-0.5, -0.02, 0, {0.163, 0.1, 0.1});
    one.complete = false;
    for (int i = 0; i < 4; ++i) bench.update({one});
    EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.163, 1e-9);
    EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, beside ? "" : "A");
    EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).label_attempts, 0);
    bench.read(id, "B", {0, 0.08});
    EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, beside ? "" : "A");
  }
}

TEST(TrackerTest, ALabelMovesWithTheParcelThatIsPushedOrRolls) {
  Bench bench;
  std::uint32_t id = 0;
  for (int i = 0; i < 4; ++i) id = bench.update({Bench::sighting(-0.5, 0)}).at(0);
  bench.read(id, "A", {0.08, 0.05});
  for (int i = 0; i < 4; ++i) bench.update({Bench::sighting(-0.7, 0.1, 1.0)});
  for (int i = 1; i < 10; ++i) bench.update({Bench::sighting(-0.7 + 0.04 * i, 0.1, 1.0)});
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "A");
}

TEST(TrackerTest, OneThatStaysShorterIsAnotherAndABadCutInBetweenIsNot) {
  Bench bench;
  std::uint32_t id = 0;
  for (int i = 0; i < 4; ++i) id = bench.update({Bench::sighting(-0.5, 0)}).at(0);
  bench.read(id, "A");
  const Sighting shorter = Bench::sighting(-0.53, 0, 0, {0.14, 0.15, 0.1});
  for (int i = 0; i < 3; ++i) bench.update({shorter});
  bench.update({Bench::sighting(-0.54, 0, 0, {0.16, 0.15, 0.1})});
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "A");
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.2, 1e-9);
  for (int i = 0; i < 4; ++i) bench.update({shorter});
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "");
  EXPECT_NEAR(bench.tracker.beliefs(bench.now, 0).at(0).size_m.x(), 0.14, 1e-9);
}

// A second label may lie in what another covers.
TEST(TrackerTest, WhatWasReadOnAPartIsHalfSeenUntilAllOfItWasInSight) {
  Bench bench;
  const std::uint32_t id = bench.update({Bench::sighting(-0.5, 0)}).at(0);
  const auto half_seen = [&] { return bench.tracker.beliefs(bench.now, 0).at(0).half_seen; };
  EXPECT_FALSE(half_seen()) << "it has no code";
  bench.read(id, "A");
  EXPECT_TRUE(half_seen());
  bench.tracker.label_shown(id, true);
  EXPECT_FALSE(half_seen());
}

TEST(TrackerTest, ASecondCodeNeedsTwoReadsAndStaysUnique) {
  Bench bench;
  const auto ids = bench.update({Bench::sighting(-0.8, 0), Bench::sighting(-0.4, 0)});
  bench.read(ids[0], "A");
  bench.read(ids[0], "B");
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "A");
  bench.read(ids[0], "B");
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "B");
  for (int i = 0; i < 2; ++i) bench.tracker.label_shown(ids[0], true);
  EXPECT_FALSE(bench.tracker.wants_label(ids[0]));
  bench.read(ids[1], "B");
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(0).code, "");
  EXPECT_EQ(bench.tracker.beliefs(bench.now, 0).at(1).code, "B");
}

TEST(TrackerTest, OneThatShowsTwoCodesHasNoneOfThem) {
  Bench bench;
  const auto code = [&] { return bench.tracker.beliefs(bench.now, 0).at(0).code; };
  const auto disputed = [&] { return bench.tracker.beliefs(bench.now, 0).at(0).disputed; };
  const auto seen = [&](double length_m) {
    return bench.update({Bench::sighting(-0.8, 0, 0, {length_m, 0.15, 0.1})}).at(0);
  };
  const std::uint32_t id = seen(0.2);
  bench.read(id, "A", {-0.06, 0});
  EXPECT_EQ(code(), "A");
  bench.read(id, "B", {0.06, 0});
  EXPECT_EQ(code(), "") << "one after the other";
  EXPECT_EQ(disputed(), (std::vector<std::string>{"A", "B"}));
  bench.read(id, "B", {0.06, 0});
  EXPECT_EQ(code(), "") << "that one was read more often says nothing";
  for (int i = 0; i < 4; ++i) seen(0.12);
  EXPECT_TRUE(disputed().empty()) << "it was two, or part of it is hidden";
  bench.read(id, "A");
  EXPECT_EQ(code(), "") << "nobody has the other";
  const Sighting part = Bench::sighting(-0.8, 0, 0, {0.12, 0.15, 0.1}), other = Bench::sighting(-0.6, 0);
  bench.read(bench.update({part, other}).at(1), "B");
  bench.read(id, "A");
  EXPECT_EQ(code(), "A");
  bench.tracker.labels_read(id, {"A", {-0.8, 0}}, {"C", {-0.6, 0}});
  EXPECT_EQ(code(), "A") << "the other lies beside it";
  bench.tracker.labels_read(id, {"A", {-0.83, 0}}, {"C", {-0.77, 0}});
  EXPECT_EQ(disputed(), (std::vector<std::string>{"A", "C"}));
}

// For a moment it seemed to be two.
TEST(TrackerTest, APieceOfOneThatShowsTwoCodesHasNoneOfThem) {
  Bench bench;
  const std::uint32_t whole = bench.update({Bench::sighting(-0.5, 0, 0.3, {0.36, 0.12, 0.1})}).at(0);
  bench.tracker.labels_read(whole, {"A", {-0.6, -0.03}}, {"B", {-0.4, 0.03}});
  const auto pieces = bench.update({Bench::sighting(-0.53, -0.05, 0.05, {0.36, 0.11, 0.1}),
                                    Bench::sighting(-0.47, 0.05, 0.05, {0.3, 0.085, 0.1}), Bench::sighting(0.2, 0)});
  ASSERT_EQ(pieces[0], whole);
  const auto read = [&](std::uint32_t track, const char* code) {
    bench.read(track, code);
    const auto beliefs = bench.tracker.beliefs(bench.now, 0);
    return std::ranges::find(beliefs, track, &ObjectBelief::track)->code;
  };
  EXPECT_EQ(read(pieces[1], "B"), "");
  EXPECT_EQ(read(pieces[2], "B"), "B") << "far from it";
  EXPECT_EQ(read(pieces[1], "C"), "C");
}

// What lay beside it was lost from sight, and lies there again.
TEST(TrackerTest, OneThatIsTakenForASmallerThatLayBesideItHasNoneOfItsTwoCodes) {
  Bench bench;
  const auto code = [&](std::uint32_t track) {
    const auto beliefs = bench.tracker.beliefs(bench.now, 0);
    return std::ranges::find(beliefs, track, &ObjectBelief::track)->code;
  };
  const std::uint32_t id = bench.update({Bench::sighting(-0.5, 0, 0, {0.18, 0.08, 0.1})}).at(0);
  ASSERT_EQ(bench.update({Bench::sighting(-0.5, 0, 0, {0.24, 0.09, 0.1})}).at(0), id);
  bench.tracker.labels_read(id, {"A", {-0.55, 0}}, {"B", {-0.385, 0}});
  bench.read(id, "A", {-0.05, 0});
  EXPECT_EQ(code(id), "") << "B may be on it, too";
  const std::uint32_t other =
      bench.update({Bench::sighting(-0.5, 0, 0, {0.18, 0.08, 0.1}), Bench::sighting(0.2, 0)})[1];
  bench.read(other, "B");
  bench.read(id, "A", {-0.05, 0});
  EXPECT_EQ(code(id), "A") << "B is somebody else's";
}

TEST(TrackerTest, WantsLabelsOfWhatCouldBeReadAndIsNotSure) {
  Bench bench;
  EXPECT_FALSE(bench.tracker.wants_labels());
  const auto seen = [&](Sighting sighting) { return bench.update({std::move(sighting)}).at(0); };
  const std::uint32_t id = seen(Bench::sighting(-0.5, 0));
  bench.read(id, "A");
  EXPECT_TRUE(bench.tracker.wants_labels()) << "one read may be of a neighbour";
  Sighting covered = Bench::sighting(-0.5, 0);
  covered.covered = true;
  seen(covered);
  EXPECT_FALSE(bench.tracker.wants_labels());
  seen(Bench::sighting(-0.5, 0));
  bench.read(id, "A");
  EXPECT_TRUE(bench.tracker.wants_labels()) << "what was hidden may show another";
  for (int i = 0; i < 2; ++i) bench.tracker.label_shown(id, true);
  EXPECT_FALSE(bench.tracker.wants_labels());
  bench.tracker.forget(id);

  const std::uint32_t blank = seen(Bench::sighting(0.2, 0));
  EXPECT_TRUE(bench.tracker.wants_labels());
  for (int i = 0; i < 10; ++i) bench.tracker.label_shown(blank, true);
  EXPECT_FALSE(bench.tracker.wants_labels()) << "it lies with its label down";
  bench.tracker.forget(blank);

  const std::uint32_t two = seen(Bench::sighting(-0.3, 0, 0, {0.6, 0.15, 0.1}));
  for (int i = 0; i < 2; ++i) {
    bench.read(two, "B");
    bench.tracker.label_shown(two, true);
  }
  EXPECT_TRUE(bench.tracker.wants_labels()) << "no parcel is that long";
}

TEST(TrackerTest, DoesNotStartOnWhatTheRobotTouchesOrTheBorderCuts) {
  Bench bench;
  Sighting held = Bench::sighting(-0.5, 0), cut = Bench::sighting(-0.9, 0);
  held.near_robot = true, held.complete = false;
  cut.at_border = true, cut.complete = false;
  EXPECT_EQ(bench.update({held, cut}), (std::vector<std::uint32_t>{0, 0}));
  EXPECT_TRUE(bench.tracker.beliefs(bench.now, 0).empty());
}

}  // namespace
}  // namespace pons::perception
