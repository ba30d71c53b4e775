// When a run is over, with every part of a real cell behind it.

#include "pons/runner/ending.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "apps/assembly.hpp"

namespace pons::runner {
namespace {

constexpr Duration kAfterwards = std::chrono::seconds(2);

class EndingTest : public ::testing::Test {
 protected:
  static std::unique_ptr<apps::Assembly> build() {
    auto world = world::load("worlds", "parcel_cell");
    EXPECT_TRUE(world) << world.error().line();
    const auto manifest = world::draw_manifest(*world, 1, 1);
    EXPECT_TRUE(manifest) << manifest.error().line();
    auto cell = apps::Assembly::build(std::move(*world), *manifest, {.journal = ":memory:"});
    EXPECT_TRUE(cell) << cell.error().line();
    return std::move(*cell);
  }

  // Asks every bridge period from now on whether the run is over; the first time that it is, or nothing by `until`.
  std::optional<Time> over(Ending& ending, Time until, bool finished) {
    for (; now_ <= until; now_ += kBridgePeriod) {
      if (ending.check(now_, finished)) return now_;
    }
    return std::nullopt;
  }
  void submit(const char* id) {
    const auto admitted = cell_->above->bridge->submit(
        std::string(R"({"id":")") + id + R"(","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})", now_);
    ASSERT_TRUE(admitted) << admitted.error().line();
  }
  std::vector<std::string> shutdowns() const {
    std::vector<std::string> reasons;
    const auto events = cell_->above->journal->notes();
    EXPECT_TRUE(events);
    for (const bridge::Event& event : *events) {
      if (event.kind == "shutdown") reasons.push_back(event.detail.at("reason"));
    }
    return reasons;
  }

  const std::unique_ptr<apps::Assembly> cell_ = build();
  Time now_;
};

TEST_F(EndingTest, QuietIsNotTheEndWhileParcelsMayCome) {
  const Watch watch;
  Ending ending(watch, *cell_->above->bridge_side);
  ASSERT_TRUE(cell_->above->bridge_side->idle());
  EXPECT_FALSE(over(ending, Time(from_s(10)), false));
  EXPECT_EQ(ending.broken_off(), "");
}

TEST_F(EndingTest, ComesSomeTimeAfterTheLastOutcome) {
  const Watch watch;
  Ending ending(watch, *cell_->above->bridge_side);
  EXPECT_FALSE(over(ending, Time(from_s(1)), false));
  const Time quiet = now_;
  EXPECT_EQ(over(ending, Time(from_s(10)), true), quiet + kAfterwards);
  EXPECT_EQ(ending.broken_off(), "");
  EXPECT_TRUE(shutdowns().empty());
}

TEST_F(EndingTest, WaitsForATaskThatIsOpen) {
  const Watch watch;
  Ending ending(watch, *cell_->above->bridge_side);
  EXPECT_FALSE(over(ending, Time(from_s(1)), true));
  submit("late");  // it waits for the arm, which nobody has armed
  EXPECT_FALSE(over(ending, Time(from_s(10)), true));
  ASSERT_TRUE(cell_->above->bridge->cancel("late", now_, "no longer wanted"));
  const Time quiet = now_;
  EXPECT_EQ(over(ending, Time(from_s(20)), true), quiet + kAfterwards) << "counted from the last outcome anew";
}

TEST_F(EndingTest, AnInterruptCancelsAndStillSeesWhatWasLetGoLand) {
  bool interrupted = false;
  int shown = 0;
  const Watch watch{.interrupted = [&] { return interrupted; }, .progress = [&](Time) { ++shown; }, .limit = Time{}};
  Ending ending(watch, *cell_->above->bridge_side);
  submit("open");
  EXPECT_FALSE(over(ending, Time(from_s(1)), false));
  EXPECT_EQ(shown, 101) << "once a period";
  interrupted = true;
  const Time quiet = now_;
  EXPECT_EQ(over(ending, Time(from_s(10)), false), quiet + kAfterwards) << "parcels on the belt do not hold it up";
  EXPECT_EQ(ending.broken_off(), "interrupted");
  EXPECT_EQ(shutdowns(), std::vector<std::string>{"interrupted"}) << "once, however long the button is held";
  const auto history = cell_->above->journal->task("open");
  ASSERT_TRUE(history && *history);
  EXPECT_EQ((*history)->record.outcome.value().outcome, task::Outcome::kCancelled);
}

TEST_F(EndingTest, ARunThatTakesTooLongIsBrokenOff) {
  const Watch watch{.interrupted = {}, .progress = {}, .limit = Time(from_s(3))};
  Ending ending(watch, *cell_->above->bridge_side);
  EXPECT_FALSE(over(ending, Time(from_s(3)), false));
  EXPECT_EQ(ending.broken_off(), "");
  const Time quiet = now_;
  EXPECT_EQ(over(ending, Time(from_s(10)), false), quiet + kAfterwards);
  EXPECT_EQ(ending.broken_off(), "it ran too long");
  EXPECT_EQ(shutdowns(), std::vector<std::string>{"it ran too long"});
}

}  // namespace
}  // namespace pons::runner
