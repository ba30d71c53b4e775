// pons health: how each part of a run that goes on fares.

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

using task::Json;

struct HealthOptions {
  std::filesystem::path socket;
  bool json = false;
};

void show(const Json& health, double time_s) {
  for (const Json& part : health.at("parts")) {
    const auto alerts = part.value("alerts", std::int64_t{0});
    const std::string why = task::text_of(part, "why");
    std::string text;
    if (!why.empty()) text = fmt::format("for {:.1f} s: {}", time_s - part.value("since_s", 0.0), why);
    if (alerts > 0) text += fmt::format("{}{} alert{}", text.empty() ? "" : "; ", alerts, alerts == 1 ? "" : "s");
    const std::string name = task::text_of(part, "part");
    fmt::print("{:<5} {}\n", task::text_of(part, "condition"),
               text.empty() ? name : fmt::format("{:<18}{}", name, text));
  }
}

int health(const HealthOptions& options) {
  const auto answer = gate::ask(options.socket.empty() ? default_socket() : options.socket, {{"op", "health"}});
  if (!answer) return bad_input(answer.error());
  if (!answer->value("ok", false)) return bad_input({task::text_of(*answer, "error"), "health", ""});
  const Json& table = answer->at("health");
  if (options.json) {
    fmt::print("{}\n", answer->dump(2));
  } else {
    show(table, answer->value("time_s", 0.0));
  }
  for (const Json& part : table.at("parts")) {
    if (task::text_of(part, "condition") == "bad") return kExitBadRun;
  }
  return kExitGood;
}

}  // namespace

void add_health(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<HealthOptions>();
  CLI::App* command = app.add_subcommand("health", "How each part of a run that goes on fares");
  command->add_option("--socket", options->socket, "Where the run listens (its --socket)");
  command->add_flag("--json", options->json, "All that is known of each");
  command->callback([options, &chosen] { chosen = [options] { return health(*options); }; });
}

}  // namespace pons::apps
