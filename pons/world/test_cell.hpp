// For this module's tests: a cell that is whole, with one section of its world's file written otherwise.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "pons/world/test_folder.hpp"
#include "pons/world/world.hpp"

namespace pons::world {

class CellTest : public ::testing::Test {
 protected:
  // "review", …
  explicit CellTest(std::string section) : section_(std::move(section)) {}

  void SetUp() override {
    folder_.write("cell/scene.xml", "<mujoco/>");
    folder_.write("robots/ur5e/ur5e.urdf", "<robot/>");
    folder_.write("robots/suction4/gripper.xml", "<mujoco/>");
    std::ifstream stream("worlds/parcel_cell/world.yaml", std::ios::binary);
    rest_.assign(std::istreambuf_iterator<char>(stream), {});
    const std::size_t from = rest_.find("\n" + section_ + ":"), to = rest_.find("\n\n", from);
    if (from == std::string::npos) return;  // the cell has none
    ASSERT_LT(from, to);
    rest_.erase(from, to - from);
  }
  [[nodiscard]] Expected<World> with(const std::string& text) const {
    folder_.write("cell/world.yaml", rest_ + "\n" + section_ + ":\n" + text);
    return load(folder_.path(), "cell");
  }
  [[nodiscard]] std::string error(const std::string& text) const {
    const auto world = with(text);
    return world ? "no error" : world.error().line();
  }
  // That of `text` after its first `from` has become `to`.
  [[nodiscard]] std::string changed(std::string text, std::string_view from, std::string_view to) const {
    const std::size_t at = text.find(from);
    return at == std::string::npos ? "the text to change is not there" : error(text.replace(at, from.size(), to));
  }

  const TestFolder folder_;

 private:
  std::string section_, rest_;
};

}  // namespace pons::world
