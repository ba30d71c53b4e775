// What a person does with a journal and an order book in a database.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <functional>

#include "tests/end_to_end/run_pons.hpp"
#include "tests/postgres/server.hpp"

namespace pons::tests {
namespace {

using testing::HasSubstr;
using testing::Not;

class CommandLine : public testing::Test {
 protected:
  // Whatever it prints, it prints no password.
  static Finished pons(const std::vector<std::string>& arguments) {
    const Finished finished = run_pons(arguments);
    EXPECT_THAT(finished.out + finished.err, Not(HasSubstr(PostgresServer::kPassword)));
    return finished;
  }

  PostgresServer& server_ = PostgresServer::instance();
  std::string place_ = server_.place(server_.make_database());
  Folder folder_;
};

TEST_F(CommandLine, ARunTakesOrdersAndItsJournalIsReadAsAFileIs) {
  write_text(folder_ / "home.json", R"({"id":"home","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})");
  write_text(folder_ / "fly.json", R"({"id":"odd","steps":[{"skill":"fly"}]})");
  EXPECT_EQ(pons({"book", "submit", place_, folder_ / "home.json"}).out, "home: taken\n");
  EXPECT_EQ(pons({"book", "submit", place_, folder_ / "home.json"}).out, "home: already taken\n");
  EXPECT_EQ(pons({"book", "submit", place_, folder_ / "fly.json"}).code, 0) << "no sender knows every robot's skills";
  EXPECT_THAT(pons({"book", "list", place_, "--open"}).out, HasSubstr("waiting"));

  const std::vector<std::string> command{"run", "small_cell", "--parcels", "2", "--quiet", "--journal", place_};
  const Finished run = pons(command);
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("#small_cell\n")) << "named after its world";
  const std::string orders = pons({"book", "list", place_}).out;
  EXPECT_THAT(orders, testing::ContainsRegex("home +50 .* SUCCEEDED +small_cell"));
  EXPECT_THAT(orders, testing::ContainsRegex("odd +50 .* FAILED +small_cell +/steps/0/skill: there is no skill 'fly'"));
  EXPECT_EQ(pons({"book", "list", place_, "--open"}).out, "");
  const Finished again = pons(command);
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, HasSubstr("holds an earlier run"));

  const std::string journal = place_ + "#small_cell";
  EXPECT_THAT(pons({"journal", "check", journal}).out, HasSubstr("whole: 3 tasks (3 succeeded"));
  EXPECT_THAT(pons({"task", "list", "--journal", journal}).out, HasSubstr("home"));
  EXPECT_THAT(pons({"task", "list", "--limit", "2", "--journal", journal}).out,
              HasSubstr("1 more ended: pons task list"));
  EXPECT_THAT(pons({"task", "show", "home", "--journal", journal}).out, HasSubstr("attempt"));
  EXPECT_THAT(pons({"task", "history", "odd", "--journal", journal}).out, HasSubstr(" refused "));
  EXPECT_THAT(pons({"journal", "compact", journal}).out, HasSubstr("events dropped"));
  EXPECT_EQ(pons({"journal", "upgrade", journal}).code, 0);
  EXPECT_EQ(pons({"journal", "check", journal}).code, 0);
}

// Body and bridge are killed while one of their orders goes on and two wait for its arm.
TEST_F(CommandLine, WhatABodyHadClaimedAndNotBegunIsDoneWithTheNextUnderItsName) {
  const std::string link = "test.book." + std::to_string(::getpid());
  write_text(folder_ / "long.json",
             R"({"id":"long","priority":90,"tree":{"xml":"<root BTCPP_format=\"4\"><BehaviorTree ID=\"A\"><Sequence>)"
             R"(<Sleep msec=\"600000\"/><move_to place=\"home\"/></Sequence></BehaviorTree></root>"}})");
  EXPECT_EQ(pons({"book", "submit", place_, folder_ / "long.json"}).out, "long: taken\n");
  for (const char* const id : {"b", "c"}) {
    write_text(folder_ / "home.json",
               fmt::format(R"({{"id":"{}","steps":[{{"skill":"move_to","arguments":{{"place":"home"}}}}]}})", id));
    EXPECT_EQ(pons({"book", "submit", place_, folder_ / "home.json"}).code, 0);
  }
  const auto body = [&](const std::string& of) {
    return std::vector<std::string>{"body", "small_cell", "--parcels", "3", "--link", of, "--quiet"};
  };
  const auto bridge = [&](const std::string& of) {
    return std::vector<std::string>{"bridge",    "small_cell", "--parcels", "3",          "--link", of,  "--quiet",
                                    "--journal", place_,       "--socket",  folder_ / of, "--wait", "60"};
  };
  const auto book = [&] { return pons({"book", "list", place_}).out; };
  const auto eventually = [](const std::function<bool()>& holds) {
    bool held = false;
    for (int i = 0; i < 3000 && !held; ++i) held = holds();
    return held;
  };
  const std::string journal = place_ + "#small_cell";
  Running first_body(folder_.path(), "body", body(link));
  {
    Running first(folder_.path(), "bridge", bridge(link));
    ASSERT_TRUE(eventually([&] {
      return pons({"task", "history", "long", "--journal", journal}).out.find("started") != std::string::npos &&
             pons({"task", "show", "c", "--journal", journal}).code == 0;
    })) << first.err();
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait().code, -SIGKILL);
  }
  {
    Running other_body(folder_.path(), "other", body(link + ".other"));
    const Finished refused = pons(bridge(link + ".other"));
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err, HasSubstr("holds the run of a body that lives (--link " + link + ")"));
    other_body.signal(SIGINT);
    EXPECT_EQ(other_body.wait().code, 130);
  }
  first_body.signal(SIGKILL);
  EXPECT_EQ(first_body.wait().code, -SIGKILL);
  EXPECT_THAT(pons({"run", "small_cell", "--parcels", "1", "--journal", place_}).err,
              HasSubstr("holds an earlier run"));

  Running next_body(folder_.path(), "next_body", body(link));
  Running next(folder_.path(), "next", bridge(link));
  ASSERT_TRUE(eventually([&] { return pons({"book", "list", place_, "--open"}).out.empty(); })) << next.err() << book();
  next_body.signal(SIGINT);
  EXPECT_EQ(next.wait().code, 130) << next.err();
  EXPECT_EQ(next_body.wait().code, 130);
  EXPECT_THAT(book(), testing::ContainsRegex("long +90 .* FAILED +small_cell +its body is gone"));
  EXPECT_THAT(book(), testing::ContainsRegex("b +50 .* SUCCEEDED +small_cell"));
  EXPECT_THAT(book(), testing::ContainsRegex("c +50 .* SUCCEEDED +small_cell"));
  EXPECT_EQ(pons({"journal", "check", journal}).code, 0);
}

// In the middle of a run, which can keep no promise any more.
TEST_F(CommandLine, ADatabaseThatVanishesEndsTheRunAndWhatWasToldIsThereAfterwards) {
  write_text(folder_ / "home.json", R"({"id":"home","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})");
  const std::string journal = place_ + "#small_cell";
  const Finished run = run_pons_and(
      {"run", "small_cell", "--parcels", "20", "--lockstep", "--stay", "--socket", folder_ / "s", "--journal", place_},
      1, [&](pid_t) {
        EXPECT_EQ(pons({"task", "submit", folder_ / "home.json", "--socket", folder_ / "s"}).out, "home: accepted\n");
        server_.stop();
      });
  EXPECT_EQ(run.code, 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("#small_cell: "));
  EXPECT_THAT(run.err, Not(HasSubstr(PostgresServer::kPassword)));
  server_.start();
  EXPECT_THAT(pons({"journal", "check", journal}).out, HasSubstr("whole: "));
  EXPECT_EQ(pons({"task", "show", "home", "--journal", journal}).code, 0);
  EXPECT_THAT(pons({"journal", "end", journal}).out, HasSubstr("; 0 open"));
}

TEST_F(CommandLine, WhatCannotBeIsSaid) {
  EXPECT_THAT(pons({"journal", "check", place_ + "#nobody"}).err, HasSubstr("there is no such journal"));
  EXPECT_THAT(pons({"journal", "compact", place_ + "#nobody"}).err, HasSubstr("there is no such journal"));
  EXPECT_THAT(pons({"journal", "check", place_}).err, HasSubstr("no bridge is named"));
  EXPECT_THAT(pons({"task", "list", "--journal", place_ + "x#cell"}).err, HasSubstr("does not exist"));
  EXPECT_THAT(pons({"book", "list", place_}).err, HasSubstr("there is no order book"));
  EXPECT_THAT(pons({"book", "list", folder_ / "day.db"}).err, HasSubstr("an order book lies in a PostgreSQL database"));
  write_text(folder_ / "late.json", R"({"id":"a","deadline_s":9,"steps":[{"skill":"fly"}]})");
  EXPECT_THAT(pons({"book", "submit", place_, folder_ / "late.json"}).err, HasSubstr("an order has no deadline"));
  // As it stands, it is short enough; with what it leaves out, no bridge takes it.
  write_text(folder_ / "long.json", R"({"id":"a","tree":{"xml":")" + std::string(64 * 1024 - 32, ' ') + R"("}})");
  EXPECT_THAT(pons({"book", "submit", place_, folder_ / "long.json"}).err, HasSubstr("send at most 65536 bytes"));
  EXPECT_THAT(pons({"run", "small_cell", "--parcels", "1", "--journal", place_ + "#No"}).err,
              HasSubstr("no name that a bridge can have"));
}

}  // namespace
}  // namespace pons::tests
