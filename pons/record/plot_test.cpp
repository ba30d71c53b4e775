#include "pons/record/plot.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pons/core/random.hpp"

namespace pons::record {
namespace {

TEST(Plot, TicksAreRoundAndHoldTheirValues) {
  EXPECT_EQ(ticks(2.4, 3.6, 5), (std::vector<double>{2, 2.5, 3, 3.5, 4}));
  EXPECT_EQ(ticks(0, 1, 5), (std::vector<double>{0, 0.5, 1}));
  Random random(7);
  for (int i = 0; i < 1000; ++i) {
    const double low = random.uniform(-1000, 1000), high = low + std::pow(10, random.uniform(-6, 6));
    const auto found = ticks(low, high, 5);
    ASSERT_GE(found.size(), 2U) << low << " " << high;
    EXPECT_LE(found.size(), 8U) << low << " " << high;
    EXPECT_LE(found.front(), low + 1e-6 * (high - low));
    EXPECT_GE(found.back(), high - 1e-6 * (high - low));
  }
}

TEST(Plot, OneValueHasTicksRoundIt) {
  for (const double value : {0.0, 2.5, -3.0}) {
    const auto found = ticks(value, value, 5);
    EXPECT_LT(found.front(), value);
    EXPECT_GT(found.back(), value);
  }
}

Plot example() {
  return {.title = "t",
          .about = {},
          .x = {.label = "seed", .names = {"7", "8", "9"}},
          .y = {.label = "s", .least = 0, .most = 10, .names = {}},
          .dots = {{0, 0, "good", "a", "run-1"}, {2, 10, "bad", "b", "run-2"}},
          .levels = {{2, 4, {}}, {5, 5, "median"}}};
}

TEST(Plot, PutsDotsWhereTheirTicksAre) {
  const auto view = view_of(example());
  const auto& first = view["dots"][0];
  const auto& last = view["dots"][1];
  EXPECT_EQ(first["x"], view["x_ticks"][0]["at"]);
  EXPECT_EQ(last["x"], view["x_ticks"][2]["at"]);
  EXPECT_EQ(view["x_ticks"][2]["text"], "9");
  EXPECT_EQ(first["y"], view["y_ticks"].front()["at"]);
  EXPECT_EQ(last["y"], view["y_ticks"].back()["at"]);
  EXPECT_EQ(view["y_ticks"].back()["text"], "10");
  EXPECT_EQ(view["bands"].size(), 1U);
  EXPECT_EQ(view["lines"].size(), 1U);
}

TEST(Plot, OneDotIsInThePicture) {
  Plot plot = example();
  plot.x.names = {"7"};
  plot.y = {.label = "s", .least = 2.5, .most = 2.5, .names = {}};
  plot.dots = {{0, 2.5, "good", "a", "run-1"}};
  plot.levels.clear();
  const auto view = view_of(plot);
  const double x = std::stod(view["dots"][0]["x"].get<std::string>()),
               y = std::stod(view["dots"][0]["y"].get<std::string>());
  EXPECT_GT(x, 0);
  EXPECT_LT(x, kPlotWidth);
  EXPECT_GT(y, 0);
  EXPECT_LT(y, kPlotHeight);
}

}  // namespace
}  // namespace pons::record
