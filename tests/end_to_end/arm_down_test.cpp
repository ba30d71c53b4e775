// One of two arms is stopped for good while the other goes on.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <tuple>

#include "apps/run_kit.hpp"
#include "pons/sim/truth.hpp"
#include "tests/end_to_end/task_run.hpp"

namespace pons::tests {
namespace {

constexpr std::int64_t kParcels = 24;
constexpr double kRests_rad_s = 0.3;

world::World two_arms() {
  auto world = world::load("worlds", "parcel_cell_two_arms");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

class ArmDown : public testing::TestWithParam<std::tuple<std::size_t, std::uint64_t>> {};

// A person stops it where it hangs clear of the belt and of the other arm with nothing on its cups, and comes back when
// nothing is left to do: what it would have taken is the other's, but for what its own task is about. On seed 7 that
// task holds the zone between them, and what is for a chute there rides by.
TEST_P(ArmDown, TheOtherTakesItsShare) {
  const auto [down, seed] = GetParam();
  TaskRun cell(two_arms(), kParcels, seed);
  const sim::Truth truth(cell.simulation());
  runner::Arming& arming = cell.above().bridge_side->arming(down);
  skills::Cell& arm = cell.above().arms[down]->cell;
  std::optional<Time> stopped, back;
  const bool finished = cell.finish([&](Time now) {
    if (!stopped) {
      const bool rests = arm.arm.state().speed.norm() < kRests_rad_s;
      const bool clear = rests && !arm.held && arm.lets_pass() && !arm.stands_in_zone();
      if (cell.above().dispatcher->tally().sorted < kParcels / 3 || !clear) return;
      arming.emergency_stop(now);
      stopped = now;
    } else if (!back) {
      if (!cell.simulation().finished() || cell.bridge().open_count() > cell.bridge().set_aside().size()) return;
      EXPECT_TRUE(arming.reset(now));
      back = now;
    } else if (arming.needs_person()) {
      (void)arming.arm(now);  // as soon as it is disarmed
    }
  });
  EXPECT_TRUE(finished);
  ASSERT_TRUE(stopped);
  EXPECT_TRUE(back);
  const auto reckoning =
      apps::reckon(cell.world(), cell.body(), cell.journal(), {.result = {.end = cell.now(), .complete = finished}});
  ASSERT_TRUE(reckoning) << reckoning.error().line();
  EXPECT_EQ(reckoning->verdict.lost, 0);
  EXPECT_EQ(reckoning->verdict.missorted, 0);
  std::map<int, int> after;  // parcels by the arm that brought them, since then
  for (const sim::ParcelTruth& parcel : truth.parcels()) {
    if (parcel.where == sim::Whereabouts::kChute && parcel.arrived > *stopped + from_s(1)) ++after[parcel.arm];
  }
  EXPECT_EQ(after[static_cast<int>(down)], 0);
  EXPECT_GE(after[static_cast<int>(1 - down)], 4);
  EXPECT_GE(reckoning->verdict.sorted, kParcels - 8) << fmt::format("{}", fmt::join(reckoning->verdict.findings, "\n"));
}

INSTANTIATE_TEST_SUITE_P(Each, ArmDown, testing::Combine(testing::Values(0U, 1U), testing::Values(4U, 7U)));

}  // namespace
}  // namespace pons::tests
