#include "pons/perception/splitter.hpp"

#include <gtest/gtest.h>

namespace pons::perception {
namespace {

struct Patch {
  TopView view;
  std::vector<cv::Point> cells;

  Patch() {
    view.cell_m = 0.002;
    view.height.create(200, 300);
    view.height.setTo(TopView::steps(0.1));
    view.colour.create(200, 300);
    view.colour.setTo(cv::Scalar(60, 60, 60));
  }
  void fill(const cv::Rect& box, const cv::Vec3b& colour) {
    for (int row = box.y; row < box.br().y; ++row) {
      for (int column = box.x; column < box.br().x; ++column) {
        view.colour(row, column) = colour;
        cells.emplace_back(column, row);
      }
    }
  }
};

TEST(SplitterTest, CutsWhereTwoColoursMeet) {
  Patch patch;
  patch.fill({50, 50, 80, 60}, {150, 120, 90});
  patch.fill({130, 50, 70, 60}, {110, 120, 140});
  Splitter splitter;
  splitter.prepare(patch.view);
  const auto line = splitter.by_colour(patch.view, patch.cells);
  ASSERT_TRUE(line);
  EXPECT_NE(line->beyond({128, 80}), line->beyond({132, 80}));
  EXPECT_EQ(line->beyond({60, 55}), line->beyond({120, 105}));
}

TEST(SplitterTest, LeavesAStripedBoxWhole) {
  Patch patch;
  patch.fill({50, 50, 60, 60}, {150, 120, 90});
  patch.fill({110, 50, 15, 60}, {190, 170, 120});
  patch.fill({125, 50, 60, 60}, {150, 120, 90});
  Splitter splitter;
  splitter.prepare(patch.view);
  EXPECT_FALSE(splitter.by_colour(patch.view, patch.cells));
}

TEST(SplitterTest, LeavesAShadedCurveWhole) {
  Patch patch;
  for (int i = 0; i < 100; ++i) {
    const auto shade = static_cast<std::uint8_t>(100 + i);
    patch.fill({50 + i, 50, 1, 60}, {shade, shade, shade});
  }
  Splitter splitter;
  splitter.prepare(patch.view);
  EXPECT_FALSE(splitter.by_colour(patch.view, patch.cells));
}

TEST(SplitterTest, CutsAnAngleIntoItsTwoRectangles) {
  Patch patch;
  patch.fill({50, 50, 100, 40}, {150, 120, 90});
  patch.fill({50, 90, 40, 60}, {150, 120, 90});
  Splitter splitter;
  splitter.prepare(patch.view);
  const auto line = splitter.by_outline(patch.cells);
  ASSERT_TRUE(line);
  EXPECT_NE(line->beyond({145, 55}), line->beyond({55, 145}));
  EXPECT_TRUE(splitter.by_outline(patch.cells, 35));
  EXPECT_FALSE(splitter.by_outline(patch.cells, 45));
}

// Lit from one side, a box is brighter along one edge: no reason to cut along it.
TEST(SplitterTest, CutsBetweenTheLabelsOfTwoAlikeWhereTheirCornersAre) {
  Patch patch;
  patch.fill({50, 50, 100, 50}, {150, 120, 90});
  patch.fill({150, 55, 60, 50}, {150, 120, 90});
  for (int column = 50; column < 150; ++column) patch.view.colour(51, column) = {190, 160, 120};
  Splitter splitter;
  splitter.prepare(patch.view);
  const auto line = splitter.between(patch.view, patch.cells, {{70, 64}, {195, 90}, 10});
  ASSERT_TRUE(line);
  EXPECT_NE(line->beyond({145, 75}), line->beyond({155, 75}));
  EXPECT_EQ(line->beyond({52, 52}), line->beyond({145, 97}));
}

// Their paper differs much, and explains what varies; but nothing changes where one thing would end.
TEST(SplitterTest, LeavesOneWholeWhoseLabelsDifferInPaper) {
  Patch patch;
  patch.fill({50, 50, 100, 50}, {150, 120, 90});
  for (int row = 60; row < 84; ++row) {
    for (int column = 54; column < 75; ++column) patch.view.colour(row, column) = {205, 175, 145};
  }
  Splitter splitter;
  splitter.prepare(patch.view);
  EXPECT_FALSE(splitter.between(patch.view, patch.cells, {{64, 72}, {138, 74}, 21}));
}

// Speckled, so that the little that one is higher explains little of the variance.
TEST(SplitterTest, CutsFlushOnesWhereOneIsALittleHigher) {
  Patch patch;
  patch.fill({50, 50, 136, 40}, {});
  for (const cv::Point& cell : patch.cells) {
    const auto shade = static_cast<std::uint8_t>((cell.x + cell.y) % 2 == 0 ? 100 : 156);
    patch.view.colour(cell) = {shade, shade, shade};
    if (cell.x >= 90) patch.view.height(cell) = TopView::steps(0.108);
  }
  Splitter splitter;
  splitter.prepare(patch.view);
  const auto line = splitter.between(patch.view, patch.cells, {{70, 70}, {150, 70}, 10});
  ASSERT_TRUE(line);
  EXPECT_NE(line->beyond({86, 70}), line->beyond({94, 70}));
}

TEST(SplitterTest, LeavesOneWholeThatNothingButTwoLabelsSaysIsTwo) {
  Patch patch;
  patch.fill({50, 50, 100, 50}, {150, 120, 90});
  Splitter splitter;
  splitter.prepare(patch.view);
  EXPECT_FALSE(splitter.between(patch.view, patch.cells, {{70, 70}, {130, 80}, 10}));
}

TEST(SplitterTest, LeavesRectanglesAndEllipsesWhole) {
  Patch rectangle;
  rectangle.fill({50, 50, 100, 40}, {150, 120, 90});
  Splitter splitter;
  splitter.prepare(rectangle.view);
  EXPECT_FALSE(splitter.by_outline(rectangle.cells));
  EXPECT_GT(rectangle_fill(rectangle.cells), 0.99);

  std::vector<cv::Point> ellipse;
  for (int y = -50; y <= 50; ++y) {
    for (int x = -80; x <= 80; ++x) {
      if (x * x / 6400.0 + y * y / 2500.0 <= 1) ellipse.emplace_back(x + 100, y + 100);
    }
  }
  EXPECT_FALSE(splitter.by_outline(ellipse));
}

}  // namespace
}  // namespace pons::perception
