#include "pons/gate/request.hpp"

#include <gtest/gtest.h>

namespace pons::gate {
namespace {

TEST(AskedFrom, ReadsEachQuestion) {
  const auto submit = asked_from(R"({"op":"submit","task":{"id":"a","steps":[]}})");
  ASSERT_TRUE(submit) << submit.error().line();
  EXPECT_EQ(submit->operation, Operation::kSubmit);
  EXPECT_EQ(submit->task, R"({"id":"a","steps":[]})");
  const auto list = asked_from(R"({"op":"list"})");
  EXPECT_EQ(list->operation, Operation::kList);
  EXPECT_EQ(list->which, Which::kOpen);
  EXPECT_EQ(list->limit, 100);
  EXPECT_EQ(list->after, 0);
  const auto ended = asked_from(R"({"op":"list","which":"ended","limit":1000,"after":117})");
  EXPECT_EQ(ended->which, Which::kEnded);
  EXPECT_EQ(ended->limit, 1000);
  EXPECT_EQ(ended->after, 117);
  const auto show = asked_from(R"({"op":"show","id":"a"})");
  EXPECT_EQ(show->operation, Operation::kShow);
  EXPECT_EQ(show->task, "a");
  const auto history = asked_from(R"({"op":"history","id":"a"})");
  EXPECT_EQ(history->operation, Operation::kHistory);
  EXPECT_EQ(history->task, "a");
  const auto watch = asked_from(R"({"op":"watch","id":"a","after":117})");
  EXPECT_EQ(watch->operation, Operation::kWatch);
  EXPECT_EQ(watch->after, 117);
  EXPECT_EQ(asked_from(R"({"op":"watch","id":"a"})")->after, 0);
  const auto all = asked_from(R"({"op":"watch","after":117})");
  ASSERT_TRUE(all) << all.error().line();
  EXPECT_EQ(all->operation, Operation::kWatch);
  EXPECT_EQ(all->task, "");
  const auto pause = asked_from(R"({"op":"pause","id":"a","reason":"lunch"})");
  EXPECT_EQ(pause->operation, Operation::kPause);
  EXPECT_EQ(pause->task, "a");
  EXPECT_EQ(pause->reason, "lunch");
  EXPECT_EQ(asked_from(R"({"op":"resume","id":"a"})")->operation, Operation::kResume);
  EXPECT_EQ(asked_from(R"({"op":"cancel","id":"a"})")->operation, Operation::kCancel);
  EXPECT_EQ(asked_from(R"({"op":"halt","id":"a","reason":""})")->operation, Operation::kHalt);
  EXPECT_EQ(asked_from(R"({"op":"robot"})")->operation, Operation::kRobot);
  EXPECT_EQ(asked_from(R"({"op":"health"})")->operation, Operation::kHealth);
  EXPECT_EQ(asked_from(R"({"op":"axes"})")->operation, Operation::kAxes);
  EXPECT_EQ(asked_from(R"({"op":"base"})")->operation, Operation::kBase);
  EXPECT_EQ(asked_from(R"({"op":"stop"})")->operation, Operation::kStop);
  EXPECT_EQ(asked_from(R"({"op":"emergency_stop"})")->operation, Operation::kEmergencyStop);
  EXPECT_EQ(asked_from(R"({"op":"reset"})")->operation, Operation::kReset);
  EXPECT_EQ(asked_from(R"({"op":"arm"})")->operation, Operation::kArm);
  EXPECT_EQ(asked_from(R"({"op":"rest"})")->operation, Operation::kRest);
  EXPECT_EQ(asked_from(R"({"op":"go_on"})")->operation, Operation::kGoOn);
  EXPECT_EQ(asked_from(R"({"op":"end"})")->operation, Operation::kEnd);
  EXPECT_EQ(asked_from(R"({"op":"observe"})")->operation, Operation::kObserve);
}

TEST(AskedFrom, ReadsWhereTheArmShallBe) {
  const auto asked = asked_from(R"({"op":"servo","positions":[0.5,-1]})");
  ASSERT_TRUE(asked) << asked.error().line();
  EXPECT_EQ(asked->operation, Operation::kServo);
  ASSERT_EQ(asked->positions.size(), 2);
  EXPECT_EQ(asked->positions[1], -1);
  EXPECT_FALSE(asked_from(R"({"op":"servo"})"));
  EXPECT_FALSE(asked_from(R"({"op":"servo","positions":[]})"));
  EXPECT_FALSE(asked_from(R"({"op":"servo","positions":["a"]})"));
  EXPECT_TRUE(asked_from(R"({"op":"servo","positions":[1,2,3,4,5,6,7,8]})"));
  EXPECT_FALSE(asked_from(R"({"op":"servo","positions":[1,2,3,4,5,6,7,8,9]})")) << "more than any robot has";
  EXPECT_FALSE(asked_from(R"({"op":"axes","positions":[1]})"));
}

TEST(AskedFrom, ReadsHowToDrive) {
  const auto asked = asked_from(R"({"op":"drive","ahead_m_s":0.25,"turn_rad_s":-1})");
  ASSERT_TRUE(asked) << asked.error().line();
  EXPECT_EQ(asked->operation, Operation::kDrive);
  EXPECT_EQ(asked->ahead_m_s, 0.25);
  EXPECT_EQ(asked->turn_rad_s, -1);
  EXPECT_EQ(asked_from(R"({"op":"drive","ahead_m_s":0})").error().where, "/turn_rad_s");
  EXPECT_EQ(asked_from(R"({"op":"drive","ahead_m_s":1e9,"turn_rad_s":0})").error().where, "/ahead_m_s");
  EXPECT_FALSE(asked_from(R"({"op":"stop","ahead_m_s":0})"));
}

TEST(AskedFrom, ReadsAChunk) {
  const auto asked =
      asked_from(R"({"op":"chunk","stream":3,"observed":17.25,"period_ms":50,"actions":[[0,0.5],[1,-2]],"last":true})");
  ASSERT_TRUE(asked) << asked.error().line();
  EXPECT_EQ(asked->operation, Operation::kChunk);
  EXPECT_EQ(asked->stream, 3u);
  EXPECT_EQ(asked->chunk.observed, 17.25);
  EXPECT_EQ(asked->chunk.period, std::chrono::milliseconds(50));
  ASSERT_EQ(asked->chunk.actions.size(), 2u);
  EXPECT_EQ(asked->chunk.actions[1], Eigen::Vector2d(1, -2));
  EXPECT_TRUE(asked->chunk.last);
  const auto large =
      asked_from(R"({"op":"chunk","stream":3,"observed":0,"period_ms":50,"actions":[[0,0,0,0,0,0,0,0,0]]})");
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().where, "chunk_size");
}

TEST(AskedFrom, RefusesEverythingElse) {
  for (const char* text : {"",
                           "{}",
                           "[]",
                           "null",
                           R"({"op":"halt"})",
                           R"({"op":"resume","id":"a","reason":"why not"})",
                           R"({"op":"watch","id":"a","after":-1})",
                           R"({"op":"show","id":"a","after":1})",
                           R"({"op":"submit"})",
                           R"({"op":"submit","task":1})",
                           R"({"op":"list","id":"a"})",
                           R"({"op":"list","limit":0})",
                           R"({"op":"list","limit":1001})",
                           R"({"op":"list","limit":"all"})",
                           R"({"op":"list","which":"all"})",
                           R"({"op":"list","after":-1})",
                           R"({"op":"show","id":"a","limit":1})",
                           R"({"op":"stop","id":"a"})",
                           R"({"op":"health","id":"a"})",
                           R"({"op":"show"})",
                           R"({"op":"history"})",
                           R"({"op":"history","id":"a","stream":1})",
                           R"({"op":"show","id":""})",
                           R"({"op":"show","id":"a","task":{}})",
                           R"({"op":"chunk"})",
                           R"({"op":"observe","stream":1})",
                           R"({"op":"chunk","stream":1,"observed":0,"period_ms":50,"actions":[[null]]})",
                           R"({"op":"chunk","stream":1,"observed":"0","period_ms":50,"actions":[[0]]})",
                           R"({"op":"chunk","stream":1,"observed":-1,"period_ms":50,"actions":[[0]]})",
                           R"({"op":"chunk","stream":1,"observed":0,"period_ms":50,"actions":[[1e999]]})",
                           R"({"op":"chunk","stream":1,"observed":0,"period_ms":50,"actions":[0]})",
                           R"({"op":"list","op":"show"})",
                           R"({"op":"list"} x)"}) {
    const auto asked = asked_from(text);
    ASSERT_FALSE(asked) << text;
    EXPECT_EQ(refusal(asked.error()).at("ok"), false);
    EXPECT_EQ(refusal(asked.error()).at("error"), asked.error().line());
  }
}

TEST(AsksToStop, KnowsBothStopsAndNothingElse) {
  for (const char* text : {R"({"op":"stop"})", R"( {"op" : "emergency_stop"} )"})
    EXPECT_TRUE(asks_to_stop(text)) << text;
  for (const char* text :
       {"", "stop", R"({"op":"reset"})", R"({"op":"stop","id":"a"})", R"({"op":"cancel","id":"stop"})"})
    EXPECT_FALSE(asks_to_stop(text)) << text;
}

TEST(SubmissionIn, TellsWhatWasToBeATaskFromQuestions) {
  for (const char* text :
       {R"({"op":"list","id":"a"})", R"({"op":"show","id":"a)", R"({"op":"dance","id":"a"})", R"({"op":"stop"}x)"})
    EXPECT_FALSE(submission_in(text)) << text;
  const std::string deep(500, '[');
  for (const std::string& text :
       {R"({"op":"submit","task":{"id":"a","steps":)" + deep,
        std::string(R"({"op":"submit","task":{"id":"a"},"by":"Kim"})"),
        std::string(R"({"op":"dance","task":{"id":"a"}})"), std::string(R"({"task":{"id":"a"},"op":"list"})"),
        std::string(R"({"id":"a","steps":[]})")})
    EXPECT_EQ(submission_in(text), "a") << text;
  for (const char* text : {"", "hello", "[]", "{}", R"({"op":"submit"})", R"({"op":"submit","id":"a"})",
                           R"({"op":"submit","tasks":[{"id":"a"},7]})", R"({"op":"submit","task":{"id":"a b"}})",
                           R"({"op":"submit","task":{"id":7}})"})
    EXPECT_EQ(submission_in(text), "") << text;
}

}  // namespace
}  // namespace pons::gate
