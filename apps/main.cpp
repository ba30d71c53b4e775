// The command line: composes, parses, and runs what was chosen.

#include <fmt/format.h>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "apps/commands.hpp"
#include "apps/memory.hpp"

namespace pons::apps {
namespace {

// Where the options of what was asked for stand.
std::string help_of(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return fmt::format("pons {}{}--help shows what there is", chosen.empty() ? "" : chosen.front()->get_name(),
                     chosen.empty() ? "" : " ");
}

// CLI11 says no more than that a command is missing where it knows none of the words.
Error without_command(const CLI::App& app, const CLI::RequiredError& error) {
  const CLI::App* at = &app;
  std::string where = "pons";
  while (!at->get_subcommands().empty()) {
    at = at->get_subcommands().front();
    where += " " + at->get_name();
  }
  if (at->get_require_subcommand_min() == 0) return {error.what(), "", help_of(app)};
  const std::vector<std::string> words = at->remaining();
  const std::string what = words.empty() ? "no command is named" : fmt::format("no command '{}'", words.front());
  if (at == &app) return {what, "", help_of(app)};
  std::string names;
  for (const CLI::App* each : at->get_subcommands([](const CLI::App*) { return true; }))
    names += (names.empty() ? "" : ", ") + each->get_name();
  return {what, where, fmt::format("there are {}: {} --help", names, where)};
}

// Of pons sweep, what stands after -- is for its runs: taken out of `words`.
std::vector<std::string> taken_further(std::vector<std::string>& words) {
  const auto dashes = std::ranges::find(words, "--");
  if (words.empty() || words.front() != "sweep" || dashes == words.end()) return {};
  std::vector<std::string> further(dashes + 1, words.end());
  words.erase(dashes, words.end());
  return further;
}

int run_command_line(int argc, char** argv) {
  CLI::App app{"Pons: the bridge between a robot's brain and its body.", "pons"};
  app.set_version_flag("--version", PONS_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::help);
  app.footer("Start with: pons run parcel_cell");
  Chosen chosen;
  add_run(app, chosen);
  std::vector<std::string> words(argv + 1, argv + argc);
  const std::vector<std::string> all = words, further = taken_further(words);
  add_sweep(app, chosen, all, further);
  add_body(app, chosen);
  add_bridge(app, chosen);
  add_worlds(app, chosen);
  add_skills(app, chosen);
  add_trees(app, chosen);
  add_task(app, chosen);
  add_journal(app, chosen);
  add_book(app, chosen);
  add_recording(app, chosen);
  add_replay(app, chosen);
  add_robot(app, chosen);
  add_health(app, chosen);
  add_doctor(app, chosen);
  add_completion(app, chosen);
  try {
    std::ranges::reverse(words);  // as the parser takes them
    app.parse(std::move(words));
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForVersion& version) {
    return app.exit(version);
  } catch (const CLI::RequiredError& error) {
    return bad_input(without_command(app, error));
  } catch (const CLI::ParseError& error) {
    return bad_input({error.what(), "", help_of(app)});
  }
  return chosen();
}

// A full disk below a redirection is an error; a reader that has seen enough (head) is not.
bool said_all() { return std::fflush(stdout) == 0 || errno == EPIPE; }

}  // namespace
}  // namespace pons::apps

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that leaves must not stop a robot,
  std::signal(SIGXFSZ, SIG_IGN);  // nor a file that may grow no more: who writes it hears of that
  pons::apps::keep_large_blocks_off_the_heap();
  try {
    const int code = pons::apps::run_command_line(argc, argv);
    if (pons::apps::said_all()) return code;
    std::fprintf(stderr, "pons: cannot write to the standard output; is the disk full?\n");
    return code == pons::apps::kExitGood ? pons::apps::kExitBadRun : code;
  } catch (const std::exception& error) {
    // Whatever a person can cause has an error of its own: this is a fault of the program, or memory ran out.
    std::fprintf(stderr, "pons: internal error: %s\n", error.what());
    return pons::apps::kExitBadRun;
  }
}
