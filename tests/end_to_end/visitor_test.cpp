// What a visitor with a socket may ask of a run, and what it must not do to the run's own work.

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/unix_address.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Visitor : public ::testing::Test {
 protected:
  // While it sorts: the first line of progress comes as it begins.
  void during_a_run(const std::function<void()>& visit, const std::string& world = "small_cell") {
    const Finished run = run_pons_and({"run", world, "--parcels", "8", "--seed", "3", "--lockstep", "--socket",
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

TEST_F(Visitor, HearsWhereItsTreeRunsOtherwiseAndTheJournalHowManyWereRefused) {
  const nlohmann::json tree{
      {"id", "slow"},
      {"tree", {{"xml", R"(<root BTCPP_format="4"><BehaviorTree ID="t"><Sleep msec="10"/></BehaviorTree></root>)"}}}};
  during_a_run([&] {
    EXPECT_THAT(submit(tree.dump()).out,
                AllOf(HasSubstr("slow: accepted\n  other than BehaviorTree.CPP: "), HasSubstr("time stands while")));
    EXPECT_NE(submit(R"({"id":"x","steps":[]})").code, 0);
  });
  const auto journal = bridge::Journal::open_to_read(folder_ / "j.db");
  ASSERT_TRUE(journal) << journal.error().line();
  const auto notes = (*journal)->notes();
  ASSERT_TRUE(notes) << notes.error().line();
  const auto closed = std::ranges::find(*notes, "closed", &bridge::Event::kind);
  ASSERT_NE(closed, notes->end());
  EXPECT_EQ(closed->detail.at("refused"), 1);
}

// What comes back for those bytes, whatever they are; the sender says that no more will come.
std::string answer_to(const std::string& socket_path, const std::string& bytes) {
  const gate::Descriptor socket = gate::unix_socket();
  EXPECT_EQ(gate::connect_to(socket, gate::unix_address(socket_path).value()), 0);
  EXPECT_EQ(::fcntl(socket.get(), F_SETFL, 0), 0) << "it waits";
  EXPECT_EQ(::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), std::ssize(bytes));
  EXPECT_EQ(::shutdown(socket.get(), SHUT_WR), 0);
  std::string answer;
  char buffer[4096];
  for (ssize_t got = 0; (got = ::recv(socket.get(), buffer, sizeof buffer, 0)) > 0;)
    answer.append(buffer, static_cast<std::size_t>(got));
  return answer;
}

// Whatever it is that keeps a submission from becoming a task. Questions leave nothing.
TEST_F(Visitor, FindsInTheJournalWhatWasRefusedAndHowItBegan) {
  during_a_run([&] {
    const auto told = [&](const std::string& bytes) { return answer_to(folder_ / "s", bytes); };
    EXPECT_THAT(told(R"({"op":"submit","task":{"id":"cut","steps":[)"), HasSubstr("not JSON"));
    EXPECT_THAT(told(R"({"op":"submit","task":{"id":"deep","x":)" + std::string(100, '[')), HasSubstr("deeper"));
    EXPECT_THAT(told(R"({"op":"sumbit","task":{"id":"odd"}})"), HasSubstr("/op: not one of the choices"));
    EXPECT_THAT(told(R"({"op":"submit","task":{"id":"form","steps":[],"colour":1}})"), HasSubstr("'colour'"));
    EXPECT_THAT(told(R"({"op":"submit","task":{"id":"long","x":")" + std::string(70'000, 'x')), HasSubstr("at most"));
    EXPECT_THAT(told("hello"), HasSubstr("not JSON"));
    EXPECT_THAT(told(R"({"op":"list","colour":1})"), HasSubstr("'colour'"));
    EXPECT_THAT(told(R"({"op":"sing"})"), HasSubstr("/op: not one of the choices"));
  });
  const auto history = [&](const std::string& id) {
    return run_pons({"task", "history", id, "--journal", folder_ / "j.db"}).out;
  };
  EXPECT_THAT(history("cut"), AllOf(HasSubstr("refused       not JSON in UTF-8 at byte 44"),
                                    HasSubstr(R"(; sent: {"op":"submit","task":{"id":"cut","steps":[)")));
  EXPECT_THAT(history("deep"), HasSubstr("nested deeper than 16 levels"));
  EXPECT_THAT(history("odd"), HasSubstr("sumbit"));
  EXPECT_THAT(history("form"), HasSubstr("'colour' does not belong there"));
  EXPECT_THAT(history("long"), HasSubstr("a line has at most 65536 bytes"));
  const std::string all = run_pons({"journal", "refused", folder_ / "j.db"}).out;
  EXPECT_THAT(all, AllOf(HasSubstr("cut"), HasSubstr("deep"), HasSubstr("sent: hello\n"), Not(HasSubstr("sing"))));
  EXPECT_EQ(std::ranges::count(all, '\n'), 6) << all;
  EXPECT_LT(all.size(), 3000U);
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
}

// The ids of all pages of two, gone through as each says.
std::vector<std::string> pages(const std::string& which, std::vector<std::string> from) {
  std::vector<std::string> ids;
  from.insert(from.end(), {"--limit", "2"});
  std::vector<std::string> command = from;
  for (bool more = true; more && ids.size() < 100;) {
    std::vector<std::string> line{"task", "list", "--" + which};
    line.insert(line.end(), command.begin(), command.end());
    const Finished page = run_pons(line);
    EXPECT_EQ(page.code, 0) << page.err;
    more = false;
    std::istringstream rows(page.out);
    for (std::string row; std::getline(rows, row);) {
      const std::size_t hint = row.find("pons task list --" + which + " --after ");
      more = more || hint != std::string::npos;
      if (hint == std::string::npos) {
        ids.push_back(row.substr(0, row.find(' ')));
      } else {
        command = from;
        command.insert(command.end(), {"--after", std::to_string(std::stoll(row.substr(row.find("--after ") + 8)))});
      }
    }
  }
  return ids;
}

TEST_F(Visitor, ListsTasksPageByPageOpenOnesFirst) {
  using ::testing::IsSupersetOf;
  const std::vector<std::string> homes{"home-1", "home-2", "home-3", "home-4", "home-5"};
  during_a_run([&] {
    EXPECT_EQ(robot("stop").code, 0);  // it starts nothing
    for (const std::string& id : homes)
      EXPECT_EQ(submit(R"({"id":")" + id + R"(","steps":[{"skill":"move_to","arguments":{"place":"home"}}]})").code, 0);
    const std::vector<std::string> run{"--socket", folder_ / "s"};
    const auto open = pages("open", run);
    EXPECT_THAT(open, IsSupersetOf(homes));
    EXPECT_THAT(std::vector<std::string>(open.end() - 5, open.end()), ::testing::ElementsAreArray(homes));
    const std::string some = run_pons({"task", "list", "--limit", "1", "--socket", folder_ / "s"}).out;
    EXPECT_THAT(some, HasSubstr(fmt::format("{} more open: pons task list --open --after ", open.size() - 1)));
    EXPECT_THAT(some, HasSubstr(" --limit 1 --socket " + (folder_ / "s").string() + "\n")) << "to be sent as it stands";
    EXPECT_EQ(robot("reset").code, 0);
    EXPECT_EQ(robot("arm").code, 0);
  });
  const std::vector<std::string> journal{"--journal", folder_ / "j.db"};
  auto ended = pages("ended", journal);
  EXPECT_EQ(ended.size(), std::set<std::string>(ended.begin(), ended.end()).size());
  EXPECT_THAT(ended, IsSupersetOf(homes));
  EXPECT_LT(std::ranges::find(ended, "home-5"), std::ranges::find(ended, "home-1")) << "the last accepted first";
  EXPECT_EQ(pages("open", journal), std::vector<std::string>{});
  const std::string all = run_pons({"task", "list", "--journal", folder_ / "j.db"}).out;
  EXPECT_EQ(std::ranges::count(all, '\n'), std::ssize(ended)) << all;
  const Finished which = run_pons({"task", "list", "--after", "3", "--journal", folder_ / "j.db"});
  EXPECT_EQ(which.code, 2);
  EXPECT_THAT(which.err, HasSubstr("say --open or --ended, too"));
  EXPECT_EQ(run_pons({"task", "list", "--limit", "1001", "--journal", folder_ / "j.db"}).code, 2);
}

// From what was seen to what became of it, over the socket as from the journal.
TEST_F(Visitor, ReadsTheStoryOfAParcel) {
  std::string early;
  during_a_run([&] {
    for (int i = 0; i < 2000 && early.empty(); ++i)
      early = run_pons({"task", "history", "P000001", "--socket", folder_ / "s"}).out;
  });
  EXPECT_THAT(early, AllOf(HasSubstr("seen"), HasSubstr("accepted")));
  const Finished told = run_pons({"task", "history", "P000001", "--journal", folder_ / "j.db"});
  EXPECT_EQ(told.code, 0) << told.err;
  std::size_t at = 0;
  for (const char* what :
       {" seen ", "± ", " accepted ", R"(pick {"object":"P000001"})", " started ", "step 0, pick, try 1",
        "take it at (", "ticks ", "the cups hold P000001", "step 0, pick, try 1: succeeded", "step 1, place, try 1",
        "carry 0.", " ended ", "SUCCEEDED"}) {
    at = told.out.find(what, at);
    ASSERT_NE(at, std::string::npos) << what << " is not there, or not in order:\n" << told.out;
  }
  const Finished raw = run_pons({"task", "history", "P000001", "--json", "--journal", folder_ / "j.db"});
  EXPECT_EQ(nlohmann::json::parse(raw.out).front().at("kind"), "seen");
  const Finished unknown = run_pons({"task", "history", "P9", "--journal", folder_ / "j.db"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("nothing is known of 'P9'"));
}

TEST_F(Visitor, TellsATaskWhatToDoAndHearsWhatCameOfIt) {
  const auto task = [&](const std::vector<std::string>& words) {
    std::vector<std::string> line{"task"};
    line.insert(line.end(), words.begin(), words.end());
    line.insert(line.end(), {"--socket", folder_ / "s"});
    return run_pons(line);
  };
  during_a_run([&] {
    const char* const steps = R"("steps":[{"skill":"detect","arguments":{"object":"nobody","within_s":60}}])";
    EXPECT_EQ(submit(fmt::format(R"({{"id":"lookout",{}}})", steps)).code, 0);
    const Finished paused = task({"pause", "lookout", "--reason", "lunch"});
    EXPECT_EQ(paused.code, 0) << paused.err;
    EXPECT_THAT(paused.out, AllOf(HasSubstr("pausing       lunch"), HasSubstr("paused        standstill CONFIRMED")));
    const Finished resumed = task({"resume", "lookout"});
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_THAT(resumed.out, HasSubstr("continued"));
    EXPECT_EQ(task({"resume", "lookout"}).code, 2);
    const Finished cancelled = task({"cancel", "lookout"});
    EXPECT_EQ(cancelled.code, 0) << cancelled.err;
    EXPECT_THAT(cancelled.out, HasSubstr("CANCELLED: asked for over the socket (cancelled); standstill CONFIRMED"));
    const Finished late = task({"halt", "lookout"});
    EXPECT_EQ(late.code, 2);
    EXPECT_THAT(late.err, HasSubstr("there is no open task 'lookout'"));
    const Finished watched = task({"watch", "lookout"});
    EXPECT_EQ(watched.code, 0) << watched.err;
    EXPECT_THAT(watched.out, AllOf(HasSubstr("accepted"), HasSubstr("paused"), HasSubstr("CANCELLED")));
    EXPECT_THAT(task({"watch", "P9"}).err, HasSubstr("nothing is known of 'P9'"));
    EXPECT_EQ(submit(fmt::format(R"({{"id":"again",{}}})", steps)).code, 0);
    const Finished halted = task({"halt", "again", "--no-wait"});
    EXPECT_EQ(halted.code, 0) << halted.err;
    EXPECT_EQ(halted.out, "");
  });
  EXPECT_THAT(show("again").out, HasSubstr("CANCELLED  asked for over the socket (halted)"));
  EXPECT_EQ(report_["parcels"]["lost"], 0);
}

TEST_F(Visitor, ChecksAndShortensTheJournalAfterwards) {
  during_a_run([] {});
  const auto journal = [&](const std::vector<std::string>& words) {
    std::vector<std::string> line{"journal"};
    line.insert(line.end(), words.begin(), words.end());
    return run_pons(line);
  };
  const Finished whole = journal({"check", folder_ / "j.db"});
  EXPECT_EQ(whole.code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("whole: "));
  EXPECT_EQ(journal({"compact", folder_ / "j.db", "--keep", "1"}).code, 0);
  EXPECT_EQ(journal({"check", folder_ / "j.db"}).code, 0);
  EXPECT_THAT(show("P000001").out, AllOf(HasSubstr("SUCCEEDED"), Not(HasSubstr("attempt"))));
  EXPECT_EQ(journal({"upgrade", folder_ / "j.db"}).code, 0);
  for (const char* word : {"check", "compact", "upgrade", "end"}) {
    const Finished missing = journal({word, folder_ / "none.db"});
    EXPECT_EQ(missing.code, 2) << word;
    EXPECT_THAT(missing.err, HasSubstr("there is no such journal")) << word;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "none.db")) << word;
  }
  EXPECT_EQ(journal({"compact", folder_ / "j.db", "--keep", "-1"}).code, 2);
}

// Until the disk is full. Told is what is there, and nothing else.
TEST_F(Visitor, HearsAcceptedOnlyOfWhatTheDiskHas) {
  std::vector<std::string> told;
  std::string refusal;
  const Finished run = run_pons_and(
      {"run", "small_cell", "--parcels", "8", "--seed", "3", "--lockstep", "--socket", folder_ / "s", "--journal",
       folder_ / "j.db", "--keep-free", "0"},
      1, [&](pid_t run_id) {
        // Stopped, it starts nothing: what is written is what is submitted.
        EXPECT_EQ(robot("stop").code, 0);
        const rlimit full{std::filesystem::file_size(folder_ / "j.db-wal") + 200'000, RLIM_INFINITY};
        ASSERT_EQ(::prlimit(run_id, RLIMIT_FSIZE, &full, nullptr), 0);
        for (int i = 0; i < 1000 && refusal.empty(); ++i) {
          const std::string id = fmt::format("home-{}", i);
          const auto answer = gate::ask(
              folder_ / "s",
              {{"op", "submit"},
               {"task", {{"id", id}, {"steps", {{{"skill", "move_to"}, {"arguments", {{"place", "home"}}}}}}}}});
          if (answer && answer->value("ok", false)) {
            told.push_back(id);
          } else {
            refusal = answer ? answer->value("error", std::string{}) : answer.error().line();
          }
        }
      });
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.err, HasSubstr("no space is left for the journal"));
  EXPECT_FALSE(refusal.empty());
  ASSERT_GT(told.size(), 1U);
  for (const std::string& id : told) EXPECT_EQ(show(id).code, 0) << id;
  EXPECT_EQ(show(fmt::format("home-{}", told.size())).code, 2) << "was refused";
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
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
    EXPECT_THAT(submit(R"({"id":"far","priority":90,"steps":[
      {"skill":"move_to","arguments":{"place":"exception","path":"line"}}]})")
                    .err,
                HasSubstr("/steps/0: the robot cannot do that: exception is out of reach"));
    EXPECT_THAT(submit(R"({"id":"x","steps":[{"skill":"move_to","arguments":{"place":"home","path":"arc"}}]})").err,
                HasSubstr("/steps/0/arguments/path"));
  });
  const std::string told = show("line").out;
  EXPECT_THAT(told, HasSubstr("SUCCEEDED"));
  EXPECT_THAT(told, HasSubstr(R"("path":"line")"));
  EXPECT_EQ(report_["limits"]["violations"], 0);
}

// Places one after the other, straight where that goes; what cannot be reached is told and passed over.
TEST_F(Visitor, HasTheToolGoRoundAsATreeOfTheWorldSays) {
  const auto patrol = [](const std::string& id, const std::string& places) {
    return nlohmann::json{
        {"id", id}, {"priority", 90}, {"tree", {{"name", "patrol"}, {"inputs", {{"places", places}}}}}}
        .dump();
  };
  during_a_run(
      [&] {
        EXPECT_THAT(submit(patrol("round", "chute_1;chute_8")).out, HasSubstr("round: accepted\n"));
        EXPECT_THAT(submit(patrol("far", "chute_2;exception")).out, HasSubstr("far: accepted\n"));
        EXPECT_THAT(submit(patrol("lost", "atlantis")).out, HasSubstr("lost: accepted\n"));
        const Finished unknown = submit(R"({"id":"x","tree":{"name":"parade"}})");
        EXPECT_THAT(unknown.err, HasSubstr("/tree/name: the world has no tree 'parade'; it has patrol, visit"));
        const Finished sent = submit(nlohmann::json{
            {"id", "x"},
            {"tree",
             {{"xml", R"(<root BTCPP_format="4"><BehaviorTree><move_to plaice="home"/></BehaviorTree></root>)"}}}}
                                         .dump());
        EXPECT_THAT(sent.err, HasSubstr("/tree/xml:1: the skill 'move_to' has no port 'plaice'"));
      },
      "parcel_cell");
  const auto told = [&](const std::string& id) {
    return run_pons({"task", "history", id, "--journal", folder_ / "j.db"}).out;
  };
  EXPECT_THAT(told("round"), AllOf(HasSubstr("SUCCEEDED; blackboard"), HasSubstr(R"("seen":2)"),
                                   HasSubstr(R"("way_s")"), Not(HasSubstr("checkpoint"))));
  EXPECT_THAT(told("far"), AllOf(HasSubstr("FAILED"), HasSubstr("the tree has failed at 'all reached'"),
                                 HasSubstr(R"("missed":" exception")"), HasSubstr(R"("seen":1)")));
  EXPECT_THAT(told("lost"), AllOf(HasSubstr("refused"), HasSubstr("atlantis"), HasSubstr("FAILED")));
  EXPECT_EQ(report_["parcels"]["lost"], 0);
  EXPECT_EQ(run_pons({"journal", "check", folder_ / "j.db"}).code, 0);
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

    EXPECT_EQ(submit(R"({"id":"lookout","steps":[{"skill":"detect","arguments":{"object":"x","within_s":60}}]})").code,
              0);
    EXPECT_THAT(robot("stop", {"--emergency"}).out, AllOf(HasSubstr("emergency stop"), HasSubstr("epoch       2")));
    EXPECT_THAT(robot("reset").out, HasSubstr("disarmed"));
    EXPECT_THAT(robot("arm").out, HasSubstr("operational"));
    // Whoever has a task hears of it.
    EXPECT_EQ(run_pons({"task", "cancel", "lookout", "--socket", folder_ / "s"}).code, 0);
  });
  EXPECT_THAT(run_pons({"task", "history", "lookout", "--journal", folder_ / "j.db"}).out,
              AllOf(HasSubstr("held          stopped: emergency stop raised"), HasSubstr("released")));
  EXPECT_EQ(report_["parcels"]["lost"], 0) << report_.dump(2);
  EXPECT_EQ(report_["parcels"]["missorted"], 0);
  EXPECT_EQ(report_["parcels"]["exceptions"]["undeserved"], 0) << "nothing has ridden by";
  EXPECT_EQ(report_["interventions"], 2) << "a stop and an emergency stop, each needed a person";
}

// Not only afterwards, from the journal.
TEST_F(Visitor, WhoWatchesATaskHearsOfAnEmergencyStopWhileItLasts) {
  const nlohmann::json waits{
      {"id", "waits"},
      {"tree",
       {{"xml", R"(<root BTCPP_format="4"><BehaviorTree ID="t"><Sleep msec="3600000"/></BehaviorTree></root>)"}}}};
  during_a_run([&] {
    EXPECT_EQ(submit(waits.dump()).code, 0);
    Running watch(folder_.path(), "watch", {"task", "watch", "waits", "--socket", folder_ / "s"});
    const auto so_far = [&] { return read_text(folder_ / "watch.out"); };
    const auto hears = [&](const char* what) {
      for (int i = 0; i < 500 && so_far().find(what) == std::string::npos; ++i) (void)robot("show");
      EXPECT_THAT(so_far(), HasSubstr(what));
    };
    hears("started");
    EXPECT_EQ(robot("stop", {"--emergency"}).code, 0);
    hears("held          stopped: emergency stop raised");
    EXPECT_THAT(so_far(), Not(HasSubstr("released")));
    EXPECT_EQ(robot("reset").code, 0);
    EXPECT_EQ(robot("arm").code, 0);
    hears("released");
    EXPECT_EQ(run_pons({"task", "cancel", "waits", "--socket", folder_ / "s"}).code, 0);
    const Finished watched = watch.wait();
    EXPECT_EQ(watched.code, 0) << watched.err;
    EXPECT_LT(watched.out.find("held "), watched.out.find("released"));
    EXPECT_THAT(watched.out, HasSubstr("CANCELLED"));
  });
  EXPECT_EQ(report_["parcels"]["lost"], 0) << report_.dump(2);
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
