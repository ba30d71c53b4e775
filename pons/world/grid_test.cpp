#include "pons/world/grid.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "pons/world/test_folder.hpp"
#include "pons/world/yaml.hpp"

namespace pons::world {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kYaml =
    "image: m.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

// 10 by 8 cells, free but for a block of two columns and three rows, and one unknown cell in the top right corner.
std::string pgm() {
  std::string text = "P5\n# a comment\n10 8\n255\n";
  for (int row = 7; row >= 0; --row) {
    for (int column = 0; column < 10; ++column) {
      const bool block = column >= 4 && column < 6 && row >= 2 && row < 5;
      const bool unknown = column == 9 && row == 7;
      text.push_back(static_cast<char>(block ? 0 : (unknown ? 205 : 254)));
    }
  }
  return text;
}

class GridFile : public ::testing::Test {
 protected:
  std::string error(std::string_view yaml, const std::string& picture) {
    folder_.write("m.pgm", picture);
    try {
      (void)Grid::load(folder_.write("m.yaml", yaml));
    } catch (const LoadError& refused) {
      return refused.error.line();
    }
    return "no error";
  }
  std::string changed(std::string_view from, std::string_view to) {
    std::string text(kYaml);
    return error(text.replace(text.find(from), from.size(), to), pgm());
  }
  TestFolder folder_;
};

TEST_F(GridFile, IsReadAsMapServerDoes) {
  ASSERT_EQ(error(kYaml, pgm()), "no error");
  const Grid grid = Grid::load(folder_.path() / "m.yaml");
  EXPECT_EQ(grid.width(), 10);
  EXPECT_EQ(grid.height(), 8);
  // The picture's last row is the lowest y; the block is from (-0.6, 2.2) to (-0.4, 2.5).
  EXPECT_EQ(grid.ground(Vector2(-0.55, 2.25)), Ground::kOccupied);
  EXPECT_EQ(grid.ground(Vector2(-0.45, 2.45)), Ground::kOccupied);
  EXPECT_EQ(grid.ground(Vector2(-0.45, 2.55)), Ground::kFree);
  EXPECT_EQ(grid.ground(Vector2(-0.65, 2.25)), Ground::kFree);
  EXPECT_EQ(grid.ground(Vector2(-0.05, 2.75)), Ground::kUnknown);
  EXPECT_EQ(grid.ground(Vector2(0.05, 2.75)), Ground::kUnknown) << "outside";
}

TEST_F(GridFile, TellsHowFarItIsToTheNearestEdge) {
  ASSERT_EQ(error(kYaml, pgm()), "no error");
  const Grid grid = Grid::load(folder_.path() / "m.yaml");
  EXPECT_NEAR(grid.distance_m(Vector2(-0.85, 2.35)), 0.25, 1e-6);
  EXPECT_NEAR(grid.distance_m(Vector2(-0.6, 2.35)), 0, 1e-6) << "on the edge itself";
  EXPECT_LT(grid.distance_m(Vector2(-0.55, 2.35)), 0) << "inside";
  const Vector2 uphill = grid.gradient(Vector2(-0.8, 2.35));
  EXPECT_NEAR(uphill.x(), -1, 1e-6);
  EXPECT_NEAR(uphill.y(), 0, 1e-6);
  // Every cell against every other: the transform is exact.
  for (int row = 0; row < grid.height(); ++row) {
    for (int column = 0; column < grid.width(); ++column) {
      double nearest = 1e9;
      const bool occupied = grid.ground(column, row) == Ground::kOccupied;
      for (int r = 0; r < grid.height(); ++r) {
        for (int c = 0; c < grid.width(); ++c) {
          if ((grid.ground(c, r) == Ground::kOccupied) == occupied) continue;
          nearest = std::min(nearest, std::hypot(c - column, r - row));
        }
      }
      const double wanted = 0.1 * (nearest - 0.5) * (occupied ? -1 : 1);
      EXPECT_NEAR(grid.distance_m(column, row), wanted, 1e-6) << column << ", " << row;
    }
  }
}

TEST_F(GridFile, RefusesWhatItCannotRead) {
  EXPECT_THAT(changed("resolution: 0.1", "resolution: 0"), HasSubstr("m.yaml:2"));
  EXPECT_THAT(changed("0.0]", "0.3]"), HasSubstr("is turned"));
  EXPECT_THAT(changed("free_thresh: 0.196", "free_thresh: 0.7"), HasSubstr("not below occupied_thresh"));
  EXPECT_THAT(changed("negate: 0", "negate: 0\nmode: scale"), HasSubstr("not trinary"));
  EXPECT_THAT(changed("image: m.pgm", "image: n.pgm"), HasSubstr("there is no file"));
  EXPECT_THAT(error(kYaml, "P2\n2 2\n255\n0 0 0 0"), HasSubstr("no binary PGM"));
  EXPECT_THAT(error(kYaml, "P5\n2 x"), HasSubstr("head is broken"));
  EXPECT_THAT(error(kYaml, "P5\n9999 2\n255\n"), HasSubstr("9999 by 2 cells"));
  EXPECT_THAT(error(kYaml, "P5\n2 2\n65535\n"), HasSubstr("white is 65535"));
  EXPECT_THAT(error(kYaml, pgm().substr(0, 60)), HasSubstr("ends before its last row"));
  EXPECT_THAT(error(kYaml, "P5\n2 2\n255\n\xfe\xfe\xfe\xfe"), HasSubstr("nothing is occupied"));
}

}  // namespace
}  // namespace pons::world
