// A brain that lies, contradicts itself, asks for what people must allow, and asks too often, beside a run's own work;
// and senders of more than a run takes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/gate/local_socket.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class HostileBrain : public ::testing::Test {
 protected:
  HostileBrain() {
    std::filesystem::copy(PONS_WORLDS_SOURCE, folder_ / "worlds", std::filesystem::copy_options::recursive);
    const auto file = folder_ / "worlds" / "small_cell" / "world.yaml";
    std::string text = read_text(file);
    const auto insert = [&](const std::string& before, const std::string& line) {
      const auto at = text.find(before);
      ASSERT_NE(at, std::string::npos) << before;
      text.insert(at, line);
    };
    insert("    - {name: hard_press", "    - {name: lookout, skills: [detect], approve: operator}\n");
    insert("    - {name: one_way", "    - {name: one_path, skills: [move_to], same: [place], differ: [path]}\n");
    insert("    - {name: senders", "    - {name: lookouts, skills: [detect], at_most: 1, per_s: 3600}\n");
    write_text(file, text);
  }
  void during_a_run(const std::function<void()>& visit) {
    const Finished run = run_pons_and({"run", "small_cell", "--parcels", "8", "--seed", "3", "--lockstep", "--socket",
                                       folder_ / "s", "--journal", folder_ / "j.db", "--report", folder_ / "r.json"},
                                      1, [&](pid_t) { visit(); }, {"PONS_WORLDS=" + (folder_ / "worlds").string()});
    EXPECT_EQ(run.code, 0) << run.err;
  }
  Finished submit(const std::string& task) {
    write_text(folder_ / "task.json", task);
    return run_pons({"task", "submit", folder_ / "task.json", "--socket", folder_ / "s"});
  }
  Finished task(const std::string& verb, const std::string& id, const std::vector<std::string>& more = {}) {
    std::vector<std::string> line{"task", verb};
    if (!id.empty()) line.push_back(id);
    line.insert(line.end(), more.begin(), more.end());
    line.insert(line.end(), {"--socket", folder_ / "s"});
    return run_pons(line);
  }
  std::string story(const std::string& id) {
    return run_pons({"task", "history", id, "--journal", folder_ / "j.db"}).out;
  }
  static std::string place(const std::string& id, const std::string& object, const std::string& where) {
    return fmt::format(R"({{"id":"{}","steps":[{{"skill":"place","arguments":{{"object":"{}","place":"{}"}}}}]}})", id,
                       object, where);
  }

  Folder folder_;
};

TEST_F(HostileBrain, IsRefusedInWordsThatItCanActOn) {
  during_a_run([&] {
    int refused = 0;
    for (const char* const chute : {"north", "south", "east"}) {
      const Finished lie = submit(place(fmt::format("lie-{}", chute), "P000008", chute));
      if (lie.err.find("(ordered_place): it is ordered elsewhere") != std::string::npos) ++refused;
    }
    EXPECT_GE(refused, 2) << "one of them is right";
    const auto home = [](const std::string& id, const std::string& path) {
      return fmt::format(R"({{"id":"{}","steps":[{{"skill":"move_to","arguments":{{"place":"home","path":"{}"}}}}]}})",
                         id, path);
    };
    const Finished reply = submit(fmt::format(R"({{"tasks":[{},{}]}})", home("a", "joints"), home("b", "line")));
    EXPECT_EQ(reply.code, 2);
    EXPECT_THAT(reply.err, AllOf(HasSubstr("/tasks/1/steps/0: against the rules of this world (one_path)"),
                                 HasSubstr("leave it out, or cancel the other task")));
    EXPECT_THAT(submit(place("nobody", "X", "north")).err, HasSubstr("(ordered_place): it is ordered elsewhere"));
    EXPECT_EQ(submit(fmt::format(R"({{"tasks":[{},{}]}})",
                                 R"({"id":"c","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})",
                                 R"({"id":"d","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})"))
                  .out,
              "c: accepted\nd: accepted\n");
  });
  EXPECT_EQ(run_pons({"task", "show", "a", "--journal", folder_ / "j.db"}).code, 2);
  EXPECT_THAT(story("b"), HasSubstr("refused")) << "the journal knows";
  EXPECT_THAT(story("d"), HasSubstr("SUCCEEDED"));
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
  const nlohmann::json report = read_json(folder_ / "r.json");
  EXPECT_EQ(report["parcels"]["missorted"], 0);
  EXPECT_EQ(report["parcels"]["lost"], 0);
}

TEST_F(HostileBrain, WaitsForPeopleAndIsKeptToItsRates) {
  const std::string look = R"("steps":[{"skill":"detect","arguments":{"object":"nobody","within_s":0.1}}])";
  during_a_run([&] {
    EXPECT_EQ(submit(fmt::format(R"({{"id":"first",{}}})", look)).code, 0);
    EXPECT_EQ(submit(fmt::format(R"({{"id":"second",{}}})", look)).code, 0);
    EXPECT_THAT(task("list", "").out, HasSubstr("asks a person"));
    EXPECT_THAT(task("approve", "first", {"--as", "cleaner"}).err, HasSubstr("people are operator, supervisor"));
    const Finished allowed = task("approve", "first", {"--as", "supervisor", "--by", "Kim"});
    EXPECT_EQ(allowed.out, "first: allowed\n") << allowed.err;
    EXPECT_EQ(task("watch", "first").code, 0);
    EXPECT_EQ(task("approve", "second", {"--as", "operator"}).code, 0);
    EXPECT_EQ(task("watch", "second").code, 0);
    EXPECT_EQ(task("approve", "second", {"--as", "operator"}).code, 2);
  });
  EXPECT_THAT(story("first"), AllOf(HasSubstr("asked         for leave: operator (lookout: detect {"),
                                    HasSubstr("allowed       by Kim, supervisor"), HasSubstr("step 0, detect, try 1")));
  EXPECT_THAT(story("second"), HasSubstr("FAILED: against the rules of this world (lookouts): at most 1 in 3600 s"));
}

// A task of 60 KB that would remember a hundred megabytes, write them down as its outcome, and hold up the run.
TEST_F(HostileBrain, RemembersNoMoreThanATaskMaySay) {
  std::string script = "s := '0123456789abcdef'";
  for (int i = 0; i < 10; ++i) script += "; s += s";
  for (int i = 0; i < 4000; ++i) script += fmt::format("; a{} := s", i);
  const nlohmann::json tree{
      {"xml", fmt::format(R"(<root BTCPP_format="4"><BehaviorTree ID="A"><Sequence>)"
                          R"(<Script code="{}"/><Sleep msec="1000"/></Sequence></BehaviorTree></root>)",
                          script)}};
  during_a_run([&] {
    const Finished sent = submit(nlohmann::json{{"id", "greedy"}, {"tree", tree}}.dump());
    EXPECT_EQ(sent.code, 0) << sent.err;
    EXPECT_EQ(task("watch", "greedy").code, 0);
    const Finished told = task("history", "greedy");
    EXPECT_THAT(told.out, HasSubstr("FAILED: blackboard: its texts and lists would have more than 65536 bytes"))
        << told.err;
  });
  EXPECT_LT(std::filesystem::file_size(folder_ / "j.db"), 4'000'000u);
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
}

TEST_F(HostileBrain, RulesThatMeanNothingAreErrorsOfTheFile) {
  const auto file = folder_ / "worlds" / "small_cell" / "world.yaml";
  std::string text = read_text(file);
  const std::string right = "place != object.destination";
  ASSERT_NE(text.find(right), std::string::npos);
  write_text(file, text.replace(text.find(right), right.size(), "place != object.desitnation"));
  const Finished run = run_pons({"run", "small_cell", "--parcels", "1", "--journal", folder_ / "none.db"},
                                {"PONS_WORLDS=" + (folder_ / "worlds").string()});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("world.yaml:"), HasSubstr("review.rules[0]: nothing has a 'desitnation'"),
                             HasSubstr("of things may be known: kind, destination")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "none.db"));
}

// What is sent to an arm that somebody has stopped waits.
class SendersReview : public ::testing::Test {
 protected:
  static constexpr int kAtOnce = 64;  // tasks in a reply, at most
  static constexpr const char* kLimit = "  limits:\n    - {name: senders, at_most: 200, per_s: 1}\n";

  void during_a_run(const std::function<void()>& visit, const std::vector<std::string>& environment = {}) {
    const Finished run = run_pons_and(
        {"run", "small_cell", "--parcels", "1", "--lockstep", "--stay", "--socket", folder_ / "s", "--journal",
         folder_ / "j.db"},
        1,
        [&](pid_t run_id) {
          EXPECT_EQ(ask({{"op", "stop"}}).value("ok", false), true);
          visit();
          kill(run_id, SIGINT);
        },
        environment);
    EXPECT_EQ(run.code, 130) << run.err;
    EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
  }
  nlohmann::json ask(const nlohmann::json& question) {
    const auto answer = gate::ask(folder_ / "s", question);
    EXPECT_TRUE(answer) << answer.error().line();
    return answer.value_or(nlohmann::json::object());
  }
  // So many tasks in one reply, under names of their own.
  nlohmann::json send(int tasks, int priority = 50) {
    nlohmann::json reply = nlohmann::json::array();
    for (int i = 0; i < tasks; ++i) {
      reply.push_back({{"id", fmt::format("t{}", ++sent_)},
                       {"priority", priority},
                       {"steps", {{{"skill", "move_to"}, {"arguments", {{"place", "home"}}}}}}});
    }
    return ask({{"op", "submit"}, {"task", {{"tasks", reply}}}});
  }
  static bool taken(const nlohmann::json& answer) { return answer.value("ok", false); }

  Folder folder_;
  int sent_ = 0;
};

TEST_F(SendersReview, ToldThatEnoughIsOpenTheyAreTakenAgainWhenSomethingHasEnded) {
  std::filesystem::copy(PONS_WORLDS_SOURCE, folder_ / "worlds", std::filesystem::copy_options::recursive);
  const auto file = folder_ / "worlds" / "small_cell" / "world.yaml";
  std::string text = read_text(file);
  ASSERT_NE(text.find(kLimit), std::string::npos);
  write_text(file, text.replace(text.find(kLimit), std::string_view(kLimit).size(), ""));
  constexpr int kMost = bridge::kMaxOpen;
  during_a_run(
      [&] {
        while (sent_ + kAtOnce <= kMost && !HasFailure()) EXPECT_TRUE(taken(send(kAtOnce))) << sent_;
        EXPECT_TRUE(taken(send(kMost - sent_))) << "as many as may be, and not one less";
        const std::string told = "10000 tasks are open already; submit it again later";
        EXPECT_EQ(send(1).value("error", ""), told);
        EXPECT_EQ(send(2).value("error", ""), "/tasks/0: " + told) << "nor part of a reply";
        EXPECT_EQ(run_pons({"task", "cancel", "t7", "--socket", folder_ / "s"}).code, 0);
        EXPECT_EQ(send(2).value("error", ""), "/tasks/1: 10000 tasks are open already; submit it again later");
        EXPECT_TRUE(taken(send(1)));
        EXPECT_EQ(send(1).value("error", ""), told);
        EXPECT_TRUE(taken(send(1, 95))) << "no crowd keeps out what is urgent";
      },
      {"PONS_WORLDS=" + (folder_ / "worlds").string()});
}

// In the run's time, which each answer tells.
TEST_F(SendersReview, AreKeptToTheRateOfTheWorldAsItComes) {
  constexpr int kRate = 200;
  std::vector<std::pair<double, int>> sent;  // and taken
  const auto lately = [&](double now_s) {
    int tasks = 0;
    for (const auto& [at_s, some] : sent) tasks += at_s > now_s - 0.995 ? some : 0;
    return tasks;
  };
  const auto until = [&](bool wanted) {
    nlohmann::json answer;
    for (int i = 0; i < 150 && !HasFailure() && (i == 0 || taken(answer) != wanted); ++i) {
      answer = send(kAtOnce);
      const double now_s = answer.value("time_s", 0.0);
      if (taken(answer)) sent.emplace_back(now_s, kAtOnce);
      EXPECT_LE(lately(now_s), kRate);
    }
    EXPECT_EQ(taken(answer), wanted) << answer;
    return answer;
  };
  during_a_run([&] {
    const nlohmann::json refused = until(false);
    const double at_s = refused.value("time_s", 0.0);
    EXPECT_GT(lately(at_s) + kAtOnce, kRate) << "not sooner than it must be";
    const std::string told = refused.value("error", "");
    const std::string words = "against the rules of this world (senders): at most 200 in 1 s; ask again in ";
    ASSERT_EQ(told.substr(0, words.size()), words) << told;
    const double wait_s = std::stod(told.substr(words.size()));
    EXPECT_GT(wait_s, 0);
    const nlohmann::json again = until(true);
    EXPECT_GE(again.value("time_s", 0.0), at_s + wait_s - 0.01);
  });
}

}  // namespace
}  // namespace pons::tests
