#include "pons/gate/ros/interface_folders.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "pons/gate/ros/outside_form.hpp"
#include "pons/gate/ros/test_outside.hpp"

namespace pons::gate::ros {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;

constexpr const char* kStow = R"(
  - name: stow
    service: /stow
    type: warehouse_msgs/srv/Stow
    arguments: {shelf: text, z: number}
    request: {shelf: "{shelf}", corners: [{z: "{z}"}, {}]}
    timeout_s: 5
    success: stowed
    reason: where
)";

class InterfaceFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("first/warehouse_msgs/srv/Stow.srv",
                  "string<=16 shelf\ngeometry_msgs/Point[2] corners\n---\nbool stowed\nBin bin\nstring where\n");
    folder_.write("second/warehouse_msgs/srv/Stow.srv", "this is never read");
    folder_.write("second/warehouse_msgs/msg/Bin.msg", "uint16 number 7\n");
  }
  [[nodiscard]] Expected<OutsideForm> form(const std::string& text = kStow) const {
    const auto skills = outside_skills(text);
    if (!skills) return std::unexpected(skills.error());
    wire::InterfaceTypes types = interface_types({folder_.path() / "first", folder_.path() / "second"});
    return OutsideForm::compile(skills->front(), types);
  }
  [[nodiscard]] std::string error(const std::string& text = kStow) const {
    const auto made = form(text);
    return made ? "no error" : made.error().line();
  }
  const world::TestFolder folder_;
};

TEST_F(InterfaceFolders, ASkillMayHaveATypeThatPonsWasNotBuiltWith) {
  const auto made = form();
  ASSERT_TRUE(made) << made.error().line();
  EXPECT_EQ(made->service_types().request, "warehouse_msgs/srv/Stow_Request");
  EXPECT_THAT(std::string(made->service_types().response_hash), testing::StartsWith("RIHS01_"));
  EXPECT_THAT(made->outputs(), testing::ElementsAre("stowed", "bin", "where"));
  EXPECT_TRUE(made->request({{"shelf", "A1"}, {"z", 0.5}}, {}));
  const auto beyond = made->request({{"shelf", "a shelf with a long name"}, {"z", 0.5}}, {});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().line(), "shelf: is 24 long; at most 16 fit");

  // false, a gap, 7, a gap, "no"
  std::vector<std::byte> reply(4 + 4 + 4 + 3);
  reply[1] = reply[4] = std::byte{1};
  reply[6] = std::byte{7};
  reply[8] = std::byte{3};
  reply[12] = std::byte{'n'};
  reply[13] = std::byte{'o'};
  const auto read = made->reply(reply);
  ASSERT_TRUE(read) << read.error().line();
  EXPECT_TRUE(read->success);
  EXPECT_EQ(read->reason, "no");
  EXPECT_EQ(read->result.at("bin").at("number"), 7);
  reply[8] = std::byte{0xFF};
  EXPECT_THAT(made->reply(reply).error().line(),
              AllOf(HasSubstr("warehouse_msgs/srv/Stow_Response at byte"), HasSubstr("field 'where'")));
}

TEST_F(InterfaceFolders, AnActionIsMadeOfItsFile) {
  folder_.write("second/warehouse_msgs/action/Sort.action",
                "int32 order\n---\nint32[] sequence\n---\nint32[] partial\n");
  const auto made = form(R"(
  - name: sort
    action: /sort
    type: warehouse_msgs/action/Sort
    arguments: {order: integer}
    goal: {order: "{order}"}
    timeout_s: 5
    feedback: [partial]
)");
  ASSERT_TRUE(made) << made.error().line();
  EXPECT_EQ(made->action_types().feedback, "warehouse_msgs/action/Sort_FeedbackMessage");
  const auto goal = made->request({{"order", 3}}, {1, 2});
  ASSERT_TRUE(goal);
  EXPECT_EQ(goal->size(), kHeaderRoom + 4 + 16 + 4);
  EXPECT_EQ(goal->back(), std::byte{0});
  EXPECT_EQ(goal->at(kHeaderRoom + 4 + 16), std::byte{3});
}

TEST_F(InterfaceFolders, WhatIsNotThereOrCannotBeReadIsNamed) {
  std::string other = kStow;
  other.replace(other.find("Stow"), 4, "Take");
  EXPECT_THAT(error(other),
              AllOf(HasSubstr("cell/world.yaml:"),
                    HasSubstr("skills[0].type: Pons does not know the type "
                              "'warehouse_msgs/srv/Take'"),
                    HasSubstr("there is no warehouse_msgs/srv/Take.srv in " + (folder_.path() / "first").string()),
                    EndsWith((folder_.path() / "second").string())));
  const auto skills = outside_skills(other);
  ASSERT_TRUE(skills);
  wire::InterfaceTypes none = interface_types({});
  EXPECT_THAT(OutsideForm::compile(skills->front(), none).error().line(),
              EndsWith("name a folder with warehouse_msgs/srv/Take.srv in the world's `interfaces`"));
  other = kStow;
  other.replace(other.find("warehouse_msgs"), 14, "../second/warehouse_msgs");
  EXPECT_THAT(error(other), HasSubstr("skills[0].type: '../second/warehouse_msgs/srv/Stow' is no name of a type"));

  folder_.write("second/warehouse_msgs/msg/Bin.msg", "uint16 number 7\nShelf shelf\n");
  EXPECT_THAT(error(), AllOf(HasSubstr("second/warehouse_msgs/msg/Bin.msg:2: Pons does not know the type "
                                       "'warehouse_msgs/msg/Shelf'; there is no warehouse_msgs/msg/Shelf.msg in")));
  folder_.write("second/warehouse_msgs/msg/Bin.msg", "uint16 number seven\n");
  EXPECT_THAT(error(), HasSubstr("second/warehouse_msgs/msg/Bin.msg:1: 'seven' is no value for it"));
  folder_.write("second/warehouse_msgs/msg/Bin.msg", std::string((std::size_t{1} << 20U) + 1, '\n'));
  EXPECT_THAT(error(), HasSubstr("second/warehouse_msgs/msg/Bin.msg: it is longer than 1 MiB"));
}

}  // namespace
}  // namespace pons::gate::ros
