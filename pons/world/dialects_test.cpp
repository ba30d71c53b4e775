#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/world/dialect.hpp"
#include "pons/world/test_cell.hpp"

namespace pons::world {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

constexpr const char* kDialects = R"(
  - dialect: agent
    status: /agent/state
  - dialect: brain
    topic: /hall/command
    commands:
      PICK:
        - {skill: pick, arguments: {object: "{0}"}}
        - {skill: place, arguments: {place: "chute_{1}", object: "{0}"}}
      HOME: [{skill: move_to, arguments: {place: home}}]
      CANCEL: cancel
  - dialect: universal
    skills:
      lean: [{skill: press, arguments: {at: ["{x}", 0.5], note: "{{as is}}"}}]
  - dialect: motion
    feedback: /arm/motion
  - dialect: high_level
    steps: [{skill: place, arguments: {place: "{destination}"}}]
)";

class DialectsSection : public CellTest {
 protected:
  DialectsSection() : CellTest("dialects") {}
  [[nodiscard]] std::string changed(std::string_view from, std::string_view to) const {
    return CellTest::changed(kDialects, from, to);
  }
};

TEST_F(DialectsSection, SaysWhatIsHeardWhereAndWhatItMeans) {
  const auto world = with(kDialects);
  ASSERT_TRUE(world) << world.error().line();
  ASSERT_EQ(world->dialects.size(), 5U);
  const Dialect& agent = world->dialects[0];
  EXPECT_EQ(agent.topic.text, "/agent/task");
  EXPECT_EQ(agent.feedback.text, "/bridge/feedback");
  EXPECT_EQ(agent.status->text, "/agent/state");
  EXPECT_TRUE(agent.phrases.empty());

  const Dialect& brain = world->dialects[1];
  EXPECT_EQ(brain.topic.text, "/hall/command");
  EXPECT_THAT(brain.topic.where, AllOf(HasSubstr("world.yaml:"), HasSubstr("dialects[1].topic")));
  EXPECT_EQ(brain.feedback.text, "/brain/task_feedback");
  ASSERT_EQ(brain.phrases.size(), 3U);
  const Phrase& pick = brain.phrases[0];
  EXPECT_EQ(pick.word, "PICK");
  EXPECT_THAT(pick.where, HasSubstr("dialects[1].commands.PICK"));
  EXPECT_THAT(pick.parameters, ElementsAre("0", "1"));
  ASSERT_EQ(pick.steps.size(), 2U);
  EXPECT_EQ(pick.steps[1].skill.text, "place");
  const Filling& place = pick.steps[1].arguments.parts.at(0);
  ASSERT_EQ(place.pieces.size(), 2U);
  EXPECT_EQ(place.pieces[0].text, "chute_");
  EXPECT_EQ(place.pieces[1].kind, Piece::Kind::kArgument);
  EXPECT_EQ(brain.phrases[1].steps[0].arguments.parts.at(0).word, "home");
  EXPECT_EQ(brain.phrases[2].verb, "cancel");

  const Phrase& lean = world->dialects[2].phrases.at(0);
  EXPECT_THAT(lean.parameters, ElementsAre("x"));
  EXPECT_EQ(lean.steps[0].arguments.parts.at(0).parts.at(1).word, "0.5");
  EXPECT_EQ(lean.steps[0].arguments.parts.at(1).pieces.at(0).text, "{as is}");
  EXPECT_EQ(world->dialects[3].topic.text, "/cerebellum/motion_trajectory");
  EXPECT_EQ(world->dialects[3].feedback.text, "/arm/motion");
  EXPECT_EQ(world->dialects[4].topic.text, "/high_level_tasks");
  EXPECT_THAT(world->dialects[4].phrases.at(0).parameters, ElementsAre("destination"));
}

TEST_F(DialectsSection, AreInTheWorldsThatComeAlong) {
  for (const char* const world : {"parcel_cell", "small_cell", "rounds"}) {
    const auto loaded = load("worlds", world);
    ASSERT_TRUE(loaded) << loaded.error().line();
    std::vector<std::string_view> names;
    for (const Dialect& each : loaded->dialects) names.push_back(name(each.kind));
    const bool has_arm = !loaded->base;
    for (const char* const of_arms : {"motion", "set_points"})
      EXPECT_EQ(std::erase(names, of_arms), has_arm ? 1U : 0U) << world << " " << of_arms;
    EXPECT_THAT(names, UnorderedElementsAre("agent", "brain", "universal", "high_level")) << world;
  }
}

TEST_F(DialectsSection, EachMistakeIsNamed) {
  EXPECT_EQ(changed("HOME", "PARK"), "no error");
  EXPECT_THAT(changed("dialect: agent", "dialect: argot"),
              AllOf(HasSubstr("dialects[0].dialect: there is no dialect 'argot'"),
                    HasSubstr("agent, brain, universal, high_level, motion, set_points")));
  EXPECT_THAT(changed("dialect: agent\n    status: /agent/state", "dialect: brain\n    commands: {A: cancel}"),
              HasSubstr("dialects[1]: 'brain' is there twice"));
  EXPECT_THAT(changed("    status: /agent/state", "    steps: []"),
              HasSubstr("dialects[0].steps: is not for the dialect agent"));
  EXPECT_THAT(changed("topic: /hall/command", "status: /hall/state"),
              HasSubstr("dialects[1].status: is not for the dialect brain"));
  EXPECT_THAT(changed("    steps: [{skill: place, arguments: {place: \"{destination}\"}}]\n", ""),
              HasSubstr("dialects[4]: has no steps"));
  EXPECT_THAT(changed("CANCEL: cancel", "CANCEL: forget"),
              AllOf(HasSubstr("commands.CANCEL: 'forget' is no verb"), HasSubstr("pause, resume, cancel, halt")));
  EXPECT_THAT(changed("CANCEL: cancel", "HOME: cancel"), HasSubstr("commands.HOME: the key is there twice"));
  EXPECT_THAT(changed("\"{0}\"", "\"{object}\""), HasSubstr("commands.PICK[0].arguments.object: there is no parameter "
                                                            "'object'; a brain's have places"));
  EXPECT_THAT(changed("chute_{1}", "chute_{2}"), HasSubstr("commands.PICK: names other parameters, and not {1}"));
  EXPECT_THAT(changed("chute_{1}", "chute_{1"), HasSubstr("a brace without its other"));
  EXPECT_THAT(changed("{destination}", "{target}"),
              AllOf(HasSubstr("dialects[4].steps[0].arguments.place: there is no parameter 'target'"),
                    HasSubstr("task_id, object_id, destination, priority")));
  EXPECT_THAT(changed("\"{destination}\"", "{destination}"), HasSubstr("write \"{destination}\", in quotes"));
  EXPECT_THAT(changed("\"{x}\"", "\"{}\""), HasSubstr("a parameter without a name"));
  EXPECT_THAT(changed("skill: press", "skill: Press"), HasSubstr("'Press' is not a name"));
  EXPECT_THAT(changed("{skill: press, arguments:", "{skill: press, params:"), HasSubstr("unknown key"));
}

}  // namespace
}  // namespace pons::world
