#include "pons/link/frames.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>

#include "pons/link/border.hpp"

namespace pons::link {
namespace {

Time at(double seconds) { return Time(from_s(seconds)); }

TEST(Frames, APlaceGoesFromHandToHand) {
  Frames frames;
  EXPECT_TRUE(frames.is_free(0));
  EXPECT_FALSE(frames.oldest());
  frames.open(0, {at(1), AxisVector::Constant(6, 0.5), 2.0});
  EXPECT_FALSE(frames.is_free(0));
  EXPECT_TRUE(frames.under_way(0, at(1)));
  EXPECT_FALSE(frames.under_way(0, at(0.9)));
  EXPECT_FALSE(frames.oldest()) << "not developed";
  const std::uint32_t before = frames.handed_over().value();
  frames.hand_over(0);
  EXPECT_NE(frames.handed_over().value(), before);
  ASSERT_EQ(frames.oldest(), 0U);
  EXPECT_EQ(frames.shot(0).belt_travel_m, 2.0);
  EXPECT_FALSE(frames.is_free(0)) << "as long as it is looked at";
  frames.give_back(0);
  EXPECT_TRUE(frames.is_free(0));
}

TEST(Frames, TheOldestComesFirst) {
  Frames frames;
  frames.open(2, {at(1), {}, 0});
  frames.open(0, {at(1.5), {}, 0});
  frames.hand_over(2);
  frames.hand_over(0);
  EXPECT_EQ(frames.oldest(), 2U);
  frames.give_back(2);
  EXPECT_EQ(frames.oldest(), 0U);
}

TEST(Frames, ANewBridgeGivesBackWhatADeadOneHeldAndNoMore) {
  Frames frames;
  frames.open(0, {at(1), {}, 0});
  frames.hand_over(0);
  frames.open(1, {at(1), {}, 0});
  frames.want_labels(true);
  frames.take_over();
  EXPECT_TRUE(frames.is_free(0));
  EXPECT_FALSE(frames.is_free(1)) << "the body still develops it";
  EXPECT_FALSE(frames.wants_labels());
  frames.hand_over(1);
  EXPECT_EQ(frames.oldest(), 1U);
}

TEST(FramePages, EveryCameraHasPagesOfItsOwn) {
  const std::array<Intrinsics, 2> cameras{Intrinsics{.width = 100, .height = 50}, Intrinsics{.width = 31, .height = 7}};
  const FramePages pages(cameras);
  EXPECT_EQ(pages.bytes(), 4U * 4096 + 5 * 4096 + 4096 + 4096);
  const std::unique_ptr<std::byte[]> memory(new std::byte[pages.bytes()]);
  std::memset(memory.get(), 0, pages.bytes());
  std::array<RgbdFrame, 2> frames;
  for (std::size_t i = 0; i < 2; ++i) {
    pages.lay(frames[i], i, memory.get());
    const auto pixels = static_cast<std::size_t>(cameras[i].width * cameras[i].height);
    frames[i].rgb.resize(3 * pixels);
    frames[i].depth_m.resize(pixels);
    std::memset(frames[i].rgb.data(), 1 + static_cast<int>(i), 3 * pixels);
    std::fill_n(frames[i].depth_m.data(), pixels, 0.5F);
  }
  const auto* const bytes = reinterpret_cast<const unsigned char*>(memory.get());
  EXPECT_EQ(bytes[3 * 5000 - 1], 1) << "written where the pages lie, not in memory of its own";
  EXPECT_EQ(frames[0].rgb[3 * 5000 - 1], 1);
  EXPECT_EQ(frames[1].rgb[0], 2);
  RgbdFrame copy = frames[1];
  copy.rgb.data()[0] = 9;
  EXPECT_EQ(frames[1].rgb[0], 2) << "a copy is one";
}

// A change here is a change of what two processes must agree on: give Border another version, and these figures with
// it.
TEST(Border, ItsVersionIsThatOfThisLayout) {
  EXPECT_EQ(Border::kVersion, 5U);
  EXPECT_EQ(sizeof(Command), 632U);
  EXPECT_EQ(sizeof(State), 1040U);
  EXPECT_EQ(sizeof(Link), 650752U);
  EXPECT_EQ(sizeof(Frames), 2960U);
  EXPECT_EQ(sizeof(Border), 662144U);
  EXPECT_EQ(offsetof(Command, contact_n), 456U);
  EXPECT_EQ(offsetof(Command, belt), 624U);
  EXPECT_EQ(offsetof(State, tip_wrench), 624U);
  EXPECT_EQ(offsetof(State, late), 1024U);
  EXPECT_EQ(static_cast<int>(CommandKind::kBelt), 10);
  EXPECT_EQ(static_cast<int>(SafetyState::kRecovery), 6);
  EXPECT_EQ(static_cast<int>(StopCause::kCollision), 14);
  EXPECT_EQ(static_cast<int>(VacuumPhase::kReleasing), 4);
  EXPECT_EQ(static_cast<int>(Controller::kAdmittance), 2);
}

TEST(Border, AnotherWorldCellOrDayIsRefusedByName) {
  Identity body;
  std::string_view("parcel_cell").copy(body.world.data(), 64);
  body.cell = 1;
  body.orders = 2;
  EXPECT_TRUE(check_same(body, body, "x"));
  Identity other = body;
  other.world[0] = 'q';
  EXPECT_EQ(check_same(body, other, "x").error().what, "the body runs the world 'parcel_cell', not 'qarcel_cell'");
  other = body;
  other.cell = 7;
  EXPECT_EQ(check_same(body, other, "x").error().what,
            "the body's 'parcel_cell' is another cell: its world, scene, robot or tool differs");
  other = body;
  other.orders = 7;
  EXPECT_EQ(check_same(body, other, "x").error().what, "the body was started with other parcels");
}

TEST(Border, TheJournalIsTheOneNamedLastBeforeTheEnd) {
  const auto border = std::make_unique<Border>(Identity{}, 1);
  EXPECT_EQ(border->journal(), "");
  EXPECT_FALSE(border->name_journal(std::string(Border::kLongestPath, 'x')));
  EXPECT_EQ(border->journal(), "");
  ASSERT_TRUE(border->name_journal("/a/long/path"));
  EXPECT_EQ(border->journal(), "/a/long/path");
  ASSERT_TRUE(border->name_journal("/another"));
  EXPECT_EQ(border->journal(), "/another") << "nothing of an older one hangs on it";
  ASSERT_TRUE(border->name_journal("/b"));
  EXPECT_EQ(border->journal(), "/b");
  border->go_to(Stage::kEnded);
  EXPECT_TRUE(border->name_journal("/too/late"));
  EXPECT_EQ(border->journal(), "/b") << "the body may be reading";
}

}  // namespace
}  // namespace pons::link
