// What a visitor with a socket may ask of a run, and what it must not do to the run's own work.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Visitor : public ::testing::Test {
 protected:
  // While it sorts: the first line of progress comes as it begins.
  void during_a_run(const std::function<void()>& visit) {
    const Finished run = run_pons_and({"run", "small_cell", "--parcels", "8", "--seed", "3", "--lockstep", "--socket",
                                       folder_ / "s", "--journal", folder_ / "j.db", "--report", folder_ / "r.json"},
                                      1, [&](pid_t) { visit(); });
    EXPECT_EQ(run.code, 0) << run.err;
    report_ = read_json(folder_ / "r.json");
  }
  Finished submit(const std::string& task) {
    write_text(folder_ / "task.json", task);
    return run_pons({"task", "submit", folder_ / "task.json", "--socket", folder_ / "s"});
  }
  Finished robot(const std::string& word, const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"robot", word, "--socket", folder_ / "s"};
    line.insert(line.end(), more.begin(), more.end());
    return run_pons(line);
  }
  Finished show(const std::string& id) { return run_pons({"task", "show", id, "--journal", folder_ / "j.db"}); }

  Folder folder_;
  nlohmann::json report_;
};

TEST_F(Visitor, SubmitsAndReadsWhatBecameOfIt) {
  const std::string home =
      R"({"id":"home-1","priority":90,"steps":[{"skill":"move_to","arguments":{"place":"home"}}]})";
  during_a_run([&] {
    EXPECT_EQ(submit(home).out, "home-1: accepted\n");
    EXPECT_EQ(submit(home).out, "home-1: already accepted\n");
    EXPECT_THAT(run_pons({"task", "list", "--socket", folder_ / "s"}).out, HasSubstr("home-1"));
  });
  EXPECT_THAT(show("home-1").out, HasSubstr("SUCCEEDED"));
  EXPECT_EQ(report_["parcels"]["lost"], 0);
}

TEST_F(Visitor, HearsOfANameThatIsNotThere) {
  during_a_run([&] {
    const Finished nowhere = submit(R"({"id":"x","steps":[{"skill":"move_to","arguments":{"place":"atlantis"}}]})");
    EXPECT_EQ(nowhere.code, 2);
    EXPECT_THAT(nowhere.err, HasSubstr("/steps/0/arguments/place"));
    EXPECT_THAT(nowhere.err, HasSubstr("\"home\""));
  });
}

// Straight through the air, there and back; what cannot be gone straight is told.
TEST_F(Visitor, HasTheToolGoAlongALine) {
  during_a_run([&] {
    EXPECT_EQ(submit(R"({"id":"line","priority":90,"steps":[
      {"skill":"move_to","arguments":{"place":"home"}},
      {"skill":"move_to","arguments":{"place":"north","path":"line"}},
      {"skill":"move_to","arguments":{"place":"home","path":"line"}}]})")
                  .out,
              "line: accepted\n");
    EXPECT_EQ(submit(R"({"id":"far","priority":90,"steps":[
      {"skill":"move_to","arguments":{"place":"exception","path":"line"}}]})")
                  .out,
              "far: accepted\n");
    EXPECT_THAT(submit(R"({"id":"x","steps":[{"skill":"move_to","arguments":{"place":"home","path":"arc"}}]})").err,
                HasSubstr("/steps/0/arguments/path"));
  });
  const std::string told = show("line").out;
  EXPECT_THAT(told, HasSubstr("SUCCEEDED"));
  EXPECT_THAT(told, HasSubstr(R"("path":"line")"));
  EXPECT_THAT(show("far").out, HasSubstr("FAILED"));
  EXPECT_EQ(report_["limits"]["violations"], 0);
}

// A stop that a person asked for lasts until that person resets and arms; meanwhile nothing rides by, for the belt
// stands, too.
TEST_F(Visitor, StopsResetsAndArmsTheArm) {
  during_a_run([&] {
    EXPECT_THAT(robot("arm").err, HasSubstr("only a disarmed arm is armed"));
    EXPECT_THAT(robot("reset").err, HasSubstr("only a stop that needs a person"));
    EXPECT_THAT(robot("stop").out, AllOf(HasSubstr("protective stop"), HasSubstr("commanded")));
    EXPECT_THAT(robot("show").out, HasSubstr("a person who resets it"));
    EXPECT_THAT(robot("arm").err, HasSubstr("pons robot reset"));
    EXPECT_THAT(robot("reset").out, AllOf(HasSubstr("disarmed"), HasSubstr("a person who arms it")));
    EXPECT_THAT(robot("arm").out, HasSubstr("operational"));

    EXPECT_THAT(robot("stop", {"--emergency"}).out, AllOf(HasSubstr("emergency stop"), HasSubstr("epoch       2")));
    EXPECT_THAT(robot("reset").out, HasSubstr("disarmed"));
    EXPECT_THAT(robot("arm").out, HasSubstr("operational"));
  });
  EXPECT_EQ(report_["parcels"]["lost"], 0) << report_.dump(2);
  EXPECT_EQ(report_["parcels"]["missorted"], 0);
  EXPECT_EQ(report_["parcels"]["exceptions"]["undeserved"], 0) << "nothing has ridden by";
}

// The brain asks for its parcels under their own names. One that is taken costs it a try, not the parcel.
TEST_F(Visitor, MayTakeAnIdThatTheBrainWantedItself) {
  during_a_run([&] {
    for (int parcel = 8; parcel >= 1; --parcel) {
      const std::string id = "P00000" + std::to_string(parcel);
      const Finished taken = submit(R"({"id":")" + id +
                                    R"(","steps":[{"skill":"detect","arguments":{"object":"nothing","within_s":1}}]})");
      EXPECT_TRUE(taken.code == 0 || taken.code == 2) << taken.err;  // the brain may have been there first
    }
  });
  EXPECT_EQ(report_["parcels"]["lost"], 0) << report_.dump(2);
  EXPECT_EQ(report_["parcels"]["missorted"], 0);
  EXPECT_GE(report_["parcels"]["sorted"], 7);
  EXPECT_THAT(show("P000008.2").out, HasSubstr("SUCCEEDED"));
}

}  // namespace
}  // namespace pons::tests
