#include "pons/gate/request.hpp"

#include <gtest/gtest.h>

namespace pons::gate {
namespace {

TEST(AskedFrom, ReadsWhatMayBeAsked) {
  const auto submit = asked_from(R"({"op":"submit","task":{"id":"a","steps":[]}})");
  ASSERT_TRUE(submit) << submit.error().line();
  EXPECT_EQ(submit->operation, Operation::kSubmit);
  EXPECT_EQ(submit->task, R"({"id":"a","steps":[]})");
  EXPECT_EQ(asked_from(R"({"op":"list"})")->operation, Operation::kList);
  const auto show = asked_from(R"({"op":"show","id":"a"})");
  EXPECT_EQ(show->operation, Operation::kShow);
  EXPECT_EQ(show->task, "a");
  EXPECT_EQ(asked_from(R"({"op":"robot"})")->operation, Operation::kRobot);
  EXPECT_EQ(asked_from(R"({"op":"stop"})")->operation, Operation::kStop);
  EXPECT_EQ(asked_from(R"({"op":"emergency_stop"})")->operation, Operation::kEmergencyStop);
  EXPECT_EQ(asked_from(R"({"op":"reset"})")->operation, Operation::kReset);
  EXPECT_EQ(asked_from(R"({"op":"arm"})")->operation, Operation::kArm);
}

TEST(AskedFrom, RefusesEverythingElse) {
  for (const char* text :
       {"", "{}", "[]", "null", R"({"op":"halt"})", R"({"op":"submit"})", R"({"op":"submit","task":1})",
        R"({"op":"list","id":"a"})", R"({"op":"stop","id":"a"})", R"({"op":"show"})", R"({"op":"show","id":""})",
        R"({"op":"show","id":"a","task":{}})", R"({"op":"list","op":"show"})", R"({"op":"list"} x)"}) {
    const auto asked = asked_from(text);
    ASSERT_FALSE(asked) << text;
    EXPECT_EQ(refusal(asked.error()).at("ok"), false);
    EXPECT_EQ(refusal(asked.error()).at("error"), asked.error().line());
  }
}

}  // namespace
}  // namespace pons::gate
