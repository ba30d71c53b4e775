#include "pons/sim/check_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace pons::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// What is said of the world's scene when the world is changed and the scene is not.
std::string said(const char* name, const std::function<void(world::World&)>& change) {
  auto world = world::load("worlds", name);
  EXPECT_TRUE(world) << world.error().line();
  change(*world);
  const auto cell = compose(*world);
  return cell ? "" : cell.error().line();
}

TEST(CheckScene, TheWorldsAgreeWithTheirScenes) {
  for (const std::string& name : world::list("worlds")) {
    if (world::load("worlds", name)->base) continue;  // no arm, no mouths: base_simulation_test.cpp looks at it
    EXPECT_EQ(said(name.c_str(), [](world::World&) {}), "");
  }
}

TEST(CheckScene, AChuteThatWasMovedInOneFileOnly) {
  EXPECT_THAT(said("parcel_cell", [](world::World& world) { world.places[0].center_m.x() += 0.05; }),
              AllOf(HasSubstr("scene.xml"), HasSubstr("the mouth of 'chute_1' is not in the scene")));
  EXPECT_THAT(said("parcel_cell", [](world::World& world) { world.places[0].center_m.x() += 0.025; }),
              HasSubstr("something without a name is 0.00 m below its rim"));
  EXPECT_THAT(said("parcel_cell", [](world::World& world) { world.places[0].size_m.z() *= 3; }),
              HasSubstr("'chute_1_floor' is 0.45 m below its rim, not 1.35"));
  EXPECT_THAT(said("parcel_cell", [](world::World& world) { world.places[0].center_m.x() += 30; }),
              HasSubstr("there is nothing"));
}

TEST(CheckScene, ABeltThatIsElsewhere) {
  EXPECT_THAT(said("small_cell", [](world::World& world) { world.belt.x_end_m += 0.1; }), HasSubstr("x_end_m"));
  EXPECT_THAT(said("small_cell", [](world::World& world) { world.belt.width_m += 0.1; }), HasSubstr("width_m"));
}

}  // namespace
}  // namespace pons::sim
