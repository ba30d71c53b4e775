#include "pons/sim/unseen.hpp"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>

namespace pons::sim {
namespace {

// A camera looks straight down, from 2 m, on a table of 1.2 m by 2 m, 1 m high, over a floor.
class Unseen : public testing::Test {
 protected:
  void add(const std::string& name, const char* geom) { xml_ += "<geom name='" + name + "' " + geom + "/>"; }

  // What of it is still drawn.
  std::set<std::string> drawn(const char* camera = "pos='0 0 2' fovy='40'") {
    const std::string scene = "<mujoco><worldbody><light pos='0 0 3'/><camera name='eye' " + std::string(camera) +
                              "/>" + xml_ + "</worldbody></mujoco>";
    char error[200] = "";
    const SpecPtr spec(mj_parseXMLString(scene.c_str(), nullptr, error, sizeof error));
    if (!spec) throw std::runtime_error(error);
    const ModelPtr model(mj_compile(spec.get(), nullptr));
    const DataPtr data(mj_makeData(model.get()));
    mj_forward(model.get(), data.get());
    mjvScene shown;
    mjv_defaultScene(&shown);
    mjv_makeScene(model.get(), &shown, 100);
    mjvOption option;
    mjv_defaultOption(&option);
    mjvCamera view;
    mjv_defaultCamera(&view);
    view.type = mjCAMERA_FIXED;
    view.fixedcamid = 0;
    mjv_updateScene(model.get(), data.get(), &option, nullptr, &view, mjCAT_ALL, &shown);
    leave_out_unseen(model.get(), mjv_averageCamera(shown.camera, shown.camera + 1), 1, shown);
    std::set<std::string> left;
    for (int i = 0; i < shown.ngeom; ++i) {
      if (shown.geoms[i].objtype != mjOBJ_GEOM) continue;
      left.insert(mj_id2name(model.get(), mjOBJ_GEOM, shown.geoms[i].objid));
    }
    mjv_freeScene(&shown);
    return left;
  }

 private:
  std::string xml_;
};

constexpr const char* kTable = "type='box' pos='0 0 0.98' size='1 0.6 0.02'";

TEST_F(Unseen, WhatLiesOutsideOfThePictureIsLeftOut) {
  add("inside", "type='sphere' pos='0.3 0 1' size='0.05'");
  add("at_the_border", "type='sphere' pos='0.40 0 1' size='0.05'");
  add("outside", "type='sphere' pos='0.6 0 1' size='0.05'");
  EXPECT_EQ(drawn(), (std::set<std::string>{"inside", "at_the_border"}));
}

TEST_F(Unseen, WhatStandsUnderATableIsLeftOut) {
  add("table", kTable);
  add("box", "type='box' pos='0.1 0.1 0.5' size='0.2 0.2 0.2'");
  add("ball", "type='sphere' pos='0.2 -0.2 0.6' size='0.1'");
  EXPECT_EQ(drawn(), (std::set<std::string>{"table"}));
}

TEST_F(Unseen, WhatStandsOnATableOrThroughItIsDrawn) {
  add("table", kTable);
  add("on_it", "type='box' pos='0.1 0.1 1.1' size='0.05 0.05 0.1'");
  add("through_it", "type='box' pos='-0.1 0.1 1' size='0.05 0.05 0.1'");
  EXPECT_EQ(drawn(), (std::set<std::string>{"on_it", "table", "through_it"}));
}

TEST_F(Unseen, WhatReachesOutFromUnderATableIsDrawn) {
  // Seen from 2 m, the edge 0.6 m off the middle hides what is less than 0.9 m off it, half a metre above the floor.
  add("table", kTable);
  add("under", "type='box' pos='0 0.25 0.45' size='0.1 0.6 0.05'");
  add("beyond", "type='box' pos='0 0.35 0.45' size='0.1 0.6 0.05'");
  EXPECT_EQ(drawn("pos='0 0 2' fovy='80'"), (std::set<std::string>{"beyond", "table"}));
}

TEST_F(Unseen, AFloorIsLeftOutWhereATableFillsThePicture) {
  add("floor", "type='plane' size='5 5 0.1'");
  add("table", kTable);
  EXPECT_EQ(drawn(), (std::set<std::string>{"table"}));
}

TEST_F(Unseen, AFloorThatShowsBesideATableIsDrawn) {
  add("floor", "type='plane' size='5 5 0.1'");
  add("table", kTable);
  EXPECT_EQ(drawn("pos='0 0.4 2' fovy='40'"), (std::set<std::string>{"floor", "table"}));
}

TEST_F(Unseen, WhatIsTransparentHidesNothing) {
  add("table", "type='box' pos='0 0 0.98' size='1 0.6 0.02' rgba='1 1 1 0.5'");
  add("ball", "type='sphere' pos='0.2 -0.2 0.6' size='0.1'");
  EXPECT_EQ(drawn(), (std::set<std::string>{"ball", "table"}));
}

TEST_F(Unseen, FromTheSideATableHidesNothingBelowIt) {
  add("table", kTable);
  add("ball", "type='sphere' pos='0 0 0.6' size='0.1'");
  EXPECT_EQ(drawn("pos='0 -2 0.8' xyaxes='1 0 0 0 0 1' fovy='40'"), (std::set<std::string>{"ball", "table"}));
}

}  // namespace
}  // namespace pons::sim
