#include "pons/world/outside.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/world/test_cell.hpp"

namespace pons::world {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kNavigate = R"(
  - name: navigate_to
    action: /navigate_to_pose
    type: nav2_msgs/action/NavigateToPose
    arguments:
      x: {type: number, minimum: -50, maximum: 50}
      y: number
      yaw: {type: number, default: 0}
      map: {type: text, choices: [map, odom], default: map}
    goal:
      pose:
        header: {frame_id: "{map}"}
        pose: {position: {x: "{x}", y: "{y}", z: 0}, orientation: "{quaternion(yaw)}"}
      behavior_tree: "for {x}, {{{y}}}"
    resources: [arm]
    timeout_s: 120
    feedback: [distance_remaining]
    reason: error_msg
)";

class OutsideSection : public CellTest {
 protected:
  OutsideSection() : CellTest("skills") {}
  [[nodiscard]] std::string changed(std::string_view from, std::string_view to) const {
    return CellTest::changed(kNavigate, from, to);
  }
};

TEST_F(OutsideSection, SaysWhoServesASkillAndHowItIsAsked) {
  const auto world = with(kNavigate);
  ASSERT_TRUE(world) << world.error().line();
  ASSERT_EQ(world->outside_skills.size(), 1U);
  const OutsideSkill& skill = world->outside_skills[0];
  EXPECT_EQ(skill.name, "navigate_to");
  EXPECT_EQ(skill.kind, OutsideSkill::Kind::kAction);
  EXPECT_EQ(skill.server.text, "/navigate_to_pose");
  EXPECT_EQ(skill.summary, "Asks the action /navigate_to_pose");
  EXPECT_THAT(skill.type.where, AllOf(HasSubstr("cell/world.yaml:"), HasSubstr(":skills[0].type")));
  ASSERT_EQ(skill.arguments.size(), 4U);
  EXPECT_EQ(skill.arguments[0].minimum, -50);
  EXPECT_EQ(std::get<double>(*skill.arguments[2].preset), 0);
  EXPECT_THAT(skill.arguments[3].choices, ElementsAre("map", "odom"));
  EXPECT_THAT(skill.resources, ElementsAre("arm"));
  EXPECT_EQ(skill.timeout, std::chrono::seconds(120));
  EXPECT_EQ(skill.server_wait, std::chrono::seconds(5));
  ASSERT_TRUE(skill.told);
  EXPECT_EQ(skill.told->at(0).text, "distance_remaining");
  const Filling& pose = skill.message.parts.at(0).parts.at(1);
  EXPECT_THAT(pose.where, HasSubstr("skills[0].goal.pose.pose"));
  const Filling& x = pose.parts.at(0).parts.at(0);
  ASSERT_EQ(x.pieces.size(), 1U);
  EXPECT_EQ(x.pieces[0].kind, Piece::Kind::kArgument);
  EXPECT_EQ(pose.parts.at(0).parts.at(2).word, "0");
  EXPECT_EQ(pose.parts.at(1).pieces.at(0).kind, Piece::Kind::kQuaternion);
  std::vector<std::string> words;
  for (const Piece& piece : skill.message.parts.at(1).pieces) words.push_back(piece.text);
  EXPECT_THAT(words, ElementsAre("for ", "x", ", {", "y", "}"));
}

TEST_F(OutsideSection, EachMistakeIsNamed) {
  EXPECT_EQ(changed("navigate_to", "drive"), "no error");
  EXPECT_THAT(changed("    action: /navigate_to_pose\n", ""), HasSubstr("needs action or service, and not both"));
  EXPECT_THAT(changed("action:", "service: /x\n    action:"), HasSubstr("needs action or service, and not both"));
  EXPECT_THAT(changed("action: /n", "service: /n"), AllOf(HasSubstr("skills[0].goal"), HasSubstr("is for actions")));
  EXPECT_THAT(changed("goal:", "request:"), AllOf(HasSubstr("skills[0].request"), HasSubstr("is for services")));
  EXPECT_THAT(changed("    type: nav2_msgs/action/NavigateToPose\n", ""), HasSubstr("key 'type' is missing"));
  EXPECT_THAT(changed("timeout_s: 120", "timeout_s: 0"), HasSubstr("skills[0].timeout_s"));
  EXPECT_THAT(changed("resources: [arm]", "resources: [base]"),
              AllOf(HasSubstr("skills[0].resources[0]"), HasSubstr("there is no resource 'base'")));
  EXPECT_THAT(changed("y: number", "y: real"),
              AllOf(HasSubstr("skills[0].arguments.y"), HasSubstr("there is no type 'real'")));
  EXPECT_THAT(changed("y: number", "Y: number"), AllOf(HasSubstr("arguments.Y"), HasSubstr("is not a name")));
  EXPECT_THAT(changed("y: number", "x: number"), AllOf(HasSubstr("arguments.x"), HasSubstr("there twice")));
  EXPECT_THAT(changed("minimum: -50", "minimum: 51"), HasSubstr("is above maximum"));
  EXPECT_THAT(changed("{type: number, default: 0}", "{type: number, choices: [1]}"), HasSubstr("is for texts"));
  EXPECT_THAT(changed("default: map", "default: world"), HasSubstr("'world' is none of its choices"));
  EXPECT_THAT(
      changed("x: \"{x}\"", "x: \"{z}\""),
      AllOf(HasSubstr("skills[0].goal.pose.pose.position.x: there is no argument 'z'"), HasSubstr("x, y, yaw")));
  EXPECT_THAT(changed("x: \"{x}\"", "x: {x}"), HasSubstr("write \"{x}\", in quotes"));
  EXPECT_THAT(changed("x: \"{x}\"", "x: \"{x\""), HasSubstr("a brace without its other"));
  EXPECT_THAT(changed("quaternion(yaw)", "quaternion(map)"), HasSubstr("'map' is no number"));
  EXPECT_THAT(changed("\"{quaternion(yaw)}\"", "\"{quaternion(yaw)}!\""), HasSubstr("more beside a quaternion"));
  EXPECT_THAT(changed("\"{quaternion(yaw)}\"", "{w: 1}"),
              AllOf(HasSubstr("skills[0].arguments"), HasSubstr("'yaw' is used nowhere")));
  EXPECT_THAT(changed("goal:", "aim:"), HasSubstr("unknown key"));
}

TEST_F(OutsideSection, FoldersOfInterfaceFilesLieBesideTheWorldsFile) {
  folder_.write("cell/own/warehouse_msgs/srv/Stow.srv", "---");
  const auto world = with(std::string(kNavigate) + "interfaces: [own, ..]\n");
  ASSERT_TRUE(world) << world.error().line();
  EXPECT_THAT(world->interfaces, ElementsAre(folder_.path() / "cell/own", folder_.path() / ""));
  EXPECT_THAT(error(std::string(kNavigate) + "interfaces: [own, mine]\n"),
              AllOf(HasSubstr("cell/world.yaml:"), HasSubstr("interfaces[1]: there is no folder"),
                    HasSubstr("relative to the world's folder")));
  EXPECT_THAT(error(std::string(kNavigate) + "interfaces: own\n"), HasSubstr("interfaces"));
}

TEST_F(OutsideSection, SeveralArmsHaveNone) {
  folder_.write("two/scene.xml", "<mujoco/>");
  std::ifstream stream("worlds/parcel_cell_two_arms/world.yaml", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  folder_.write("two/world.yaml",
                text + "\nskills: [{name: stir, service: /stir, type: std_srvs/srv/Trigger, timeout_s: 5}]\n");
  const auto world = load(folder_.path(), "two");
  ASSERT_FALSE(world);
  EXPECT_THAT(world.error().line(), HasSubstr("several arms run in virtual time"));
}

}  // namespace
}  // namespace pons::world
