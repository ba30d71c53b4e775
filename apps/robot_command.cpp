// pons robot: what the arm of a running bridge does, and a person's words to it: stop, reset, arm.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "pons/gate/local_socket.hpp"

namespace pons::apps {
namespace {

using gate::Json;

// How long a person waits for what was asked to show, and how often it is looked for.
constexpr auto kPatience = std::chrono::seconds(3);
constexpr auto kLook = std::chrono::milliseconds(20);

struct RobotOptions {
  std::filesystem::path socket;
  bool emergency = false;
};

Expected<Json> ask(const RobotOptions& options, std::string_view operation) {
  const auto socket = options.socket.empty() ? default_socket() : options.socket;
  auto answer = gate::ask(socket, {{"op", operation}});
  if (!answer) return answer;
  if (!answer->value("ok", false)) return fail(answer->value("error", std::string("refused without a reason")));
  return answer->at("robot");
}

int show(const Json& robot) {
  for (const char* field : {"state", "cause", "standstill"})
    fmt::print("{:<11} {}\n", field, robot.value(field, std::string{}));
  fmt::print("{:<11} {}\n", "epoch", robot.value("epoch", 0U));
  if (const auto needs = robot.value("needs", std::string{}); !needs.empty()) fmt::print("{:<11} {}\n", "needs", needs);
  return kExitGood;
}

// Asks, and then looks until the arm is in one of `states`; what it is then is printed.
int ask_and_wait(const RobotOptions& options, std::string_view operation,
                 std::initializer_list<std::string_view> states) {
  auto robot = ask(options, operation);
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (robot) {
    const auto state = robot->value("state", std::string{});
    if (std::ranges::find(states, state) != states.end()) return show(*robot);
    if (std::chrono::steady_clock::now() > until) {
      return bad_input({"the arm's state is still: " + state, std::string(operation),
                        "it needs: " + robot->value("needs", std::string{})});
    }
    std::this_thread::sleep_for(kLook);
    robot = ask(options, "robot");
  }
  return bad_input(robot.error());
}

int stop(const RobotOptions& options) {
  return options.emergency ? ask_and_wait(options, "emergency_stop", {"emergency stop"})
                           : ask_and_wait(options, "stop", {"protective stop", "emergency stop"});
}

}  // namespace

void add_robot(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<RobotOptions>();
  CLI::App* robot = app.add_subcommand("robot", "Look at the arm of a running bridge, stop it, reset and arm it");
  robot->require_subcommand(1);
  const auto add = [&, options](const char* name, const char* what, std::function<int()> work) {
    CLI::App* command = robot->add_subcommand(name, what);
    command->add_option("--socket", options->socket, "Where the run listens (its --socket)");
    command->callback([work = std::move(work), &chosen] { chosen = work; });
    return command;
  };
  add("show", "What it does, and what it waits for", [options] {
    const auto seen = ask(*options, "robot");
    return seen ? show(*seen) : bad_input(seen.error());
  });
  add("stop", "Stop it; it holds what it carries, and does not move again before a person has reset and armed it",
      [options] { return stop(*options); })
      ->add_flag("--emergency", options->emergency, "An emergency stop: the power is taken off when it stands");
  add("reset", "Leave a stop that needs a person; nothing moves",
      [options] { return ask_and_wait(*options, "reset", {"disarmed"}); });
  add("arm", "Let it move again", [options] { return ask_and_wait(*options, "arm", {"operational", "recovery"}); });
}

}  // namespace pons::apps
