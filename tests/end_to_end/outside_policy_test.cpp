// A policy in a process of its own: the example, beside a run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <future>
#include <string>

#include "pons/gate/local_socket.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class OutsidePolicy : public ::testing::Test {
 protected:
  void during_a_run(const std::string& how, const std::function<void()>& visit) {
    const Finished run = run_pons_and({"run", "small_cell", "--parcels", "2", "--seed", "3", "--" + how, "--socket",
                                       folder_ / "s", "--journal", folder_ / "j.db", "--report", folder_ / "r.json"},
                                      1, [&](pid_t) { visit(); });
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(read_json(folder_ / "r.json")["limits"]["violations"], 0);
    EXPECT_EQ(read_json(folder_ / "r.json")["parcels"]["lost"], 0);
  }
  Finished example(const std::string& id) { return run_program(PONS_PYTHON, {PONS_EXAMPLE, folder_ / "s", id}); }
  // What its task came to.
  json told(const std::string& id) {
    const Finished shown = run_pons({"task", "show", id, "--journal", folder_ / "j.db"});
    EXPECT_THAT(shown.out, HasSubstr("SUCCEEDED"));
    const auto at = shown.out.find("{\"attempt\"", shown.out.find("attempt_ended"));
    return at == std::string::npos ? json()
                                   : json::parse(shown.out.substr(at, shown.out.find('\n', at) - at))["detail"];
  }
  json ask(const json& question) {
    const auto answer = gate::ask(folder_ / "s", question);
    return answer ? *answer : json{{"error", answer.error().line()}};
  }

  Folder folder_;
};

TEST_F(OutsidePolicy, MovesTheArm) {
  during_a_run("lockstep", [&] {
    const Finished ran = example("sway");
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("chunks sent"));
  });
  const json detail = told("sway");
  EXPECT_EQ(detail["executed"], 120) << detail;
  EXPECT_EQ(detail["refused"], 0) << detail;
  EXPECT_GE(detail["chunks"], 10) << detail;
}

// A person stops the arm in the middle, and again when all has been sent, and sends it on each time.
TEST_F(OutsidePolicy, GoesOnAfterAStop) {
  during_a_run("lockstep", [&] {
    auto running = std::async(std::launch::async, [&] { return example("sway"); });
    for (const double stop_at : {30.0, 108.0}) {
      // On a busy computer the end may pass unseen.
      while (running.wait_for(std::chrono::seconds(0)) != std::future_status::ready &&
             ask({{"op", "observe"}}).value("executed", 0.0) < stop_at) {
      }
      for (const char* operation : {"stop", "reset", "arm"}) {
        while (ask({{"op", operation}})["ok"] != true) {
        }
      }
    }
    const Finished ran = running.get();
    EXPECT_EQ(ran.code, 0) << ran.err;
  });
  const json detail = told("sway");
  std::printf("stopped twice: %s\n", detail.dump().c_str());
  EXPECT_EQ(detail["executed"], 120) << detail;
}

// By the clock its chunks come as late as this computer makes them, and a policy within runs on a thread of its own.
TEST_F(OutsidePolicy, MovesTheArmInRealTimeAsOneWithinDoes) {
  during_a_run("realtime", [&] {
    const Finished ran = example("sway");
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ask({{"op", "submit"},
                   {"task",
                    {{"id", "hover"},
                     {"priority", 90},
                     {"steps",
                      {{{"skill", "follow_policy"},
                        {"arguments", {{"policy", "hover"}, {"seconds", 3}, {"latency_s", 0.3}}}}}}}}})["ok"],
              true);
  });
  for (const char* id : {"sway", "hover"}) {
    const json detail = told(id);
    std::printf("%s in real time: %s\n", id, detail.dump().c_str());
    EXPECT_GE(detail["executed"], 50);
    EXPECT_LE(detail["starved_ticks"], 300);
  }
}

TEST_F(OutsidePolicy, HearsWhatIsWrongWithAChunk) {
  during_a_run("lockstep", [&] {
    const auto error_of = [&](const json& question) { return ask(question).value("error", std::string("none")); };
    const json row = json::array({0, -0.2067, 0, -2.3596, 0, 2.1529, 0});
    json chunk{{"op", "chunk"}, {"stream", 1}, {"observed", 0}, {"period_ms", 50}, {"actions", {row, row}}};
    EXPECT_THAT(error_of({{"op", "observe"}}), StartsWith("chunk_stream"));
    EXPECT_THAT(error_of(chunk), StartsWith("chunk_stream"));
    ask({{"op", "submit"},
         {"task",
          {{"id", "hear"},
           {"priority", 90},
           {"steps", {{{"skill", "follow_policy"}, {"arguments", {{"policy", "outside"}, {"seconds", 1}}}}}}}}});
    json seen;
    do seen = ask({{"op", "observe"}});
    while (!seen.value("ok", false));
    EXPECT_EQ(seen["position"].size(), 7);
    const auto with = [&](const char* member, const json& value) {
      json changed = chunk;
      changed[member] = value;
      return error_of(changed);
    };
    // Until the arm stands still no motion is taken.
    while (error_of(chunk).starts_with("chunk_stopped")) {
    }
    EXPECT_THAT(with("stream", 7), StartsWith("chunk_stream"));
    EXPECT_THAT(with("observed", 900), StartsWith("chunk_future"));
    EXPECT_THAT(with("period_ms", 5), StartsWith("chunk_period"));
    EXPECT_THAT(with("actions", json::array()), StartsWith("chunk_empty"));
    EXPECT_THAT(with("actions", json::array({row, {0, 0, 0, 0, 0, 0}})), StartsWith("chunk_size"));
    EXPECT_THAT(with("actions", json(200, row)), StartsWith("chunk_long"));
    EXPECT_THAT(with("actions", json::array({{9, 0, 0, -1, 0, 1, 0}})), StartsWith("chunk_position"));
    EXPECT_THAT(with("actions", "all"), HasSubstr("/actions"));
    // The two actions of the first one are executed soon; then a chunk of the same is of the past.
    while (ask({{"op", "observe"}}).value("executed", 2.0) < 1.999) {
    }
    EXPECT_THAT(error_of(chunk), StartsWith("chunk_past"));
  });
}

}  // namespace
}  // namespace pons::tests
