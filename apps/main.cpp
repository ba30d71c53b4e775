// The command line: composes, parses, and runs what was chosen.

#include <fmt/format.h>
#include <fmt/ranges.h>
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
#include "pons/task/spelling.hpp"

namespace pons::apps {
namespace {

// What was asked for: the last command among the words, and all of its name.
struct Asked {
  const CLI::App* command;
  std::string name = "pons";
};
Asked asked_for(const CLI::App& app) {
  Asked asked{&app};
  while (!asked.command->get_subcommands().empty()) {
    asked.command = asked.command->get_subcommands().front();
    asked.name += " " + asked.command->get_name();
  }
  return asked;
}

std::string help_of(const Asked& asked) { return asked.name + " --help shows what there is"; }

std::string hint(const std::string& word, const std::vector<std::string>& known) {
  const std::string meant = task::nearest(word, known);
  return meant.empty() ? "" : fmt::format("; did you mean {}?", meant);
}

// CLI11 says no more than that a command is missing where it knows none of the words.
Error without_command(const CLI::App& app, const CLI::RequiredError& error) {
  const Asked asked = asked_for(app);
  if (asked.command->get_require_subcommand_min() == 0) return {error.what(), asked.name, help_of(asked)};
  std::vector<std::string> names;
  for (const CLI::App* each : asked.command->get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(each->get_name());
  const std::vector<std::string> words = asked.command->remaining();
  const std::string what = words.empty() ? "no command is named"
                                         : fmt::format("no command '{}'{}", words.front(), hint(words.front(), names));
  if (asked.command == &app) return {what, "", help_of(asked)};
  return {what, asked.name, fmt::format("there are {}: {} --help", fmt::join(names, ", "), asked.name)};
}

// It lists words that it does not know last to first, with the values that it takes for words of their own.
Error with_unknown_words(const CLI::App& app) {
  const Asked asked = asked_for(app);
  std::vector<std::string> words = app.remaining(true);
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with("-"); });
  if (option == words.end())
    return {fmt::format("'{}' is one word too many", words.empty() ? "" : words.front()), "", help_of(asked)};
  const std::string name = option->substr(0, option->find('='));
  std::vector<std::string> known;
  for (const CLI::Option* each : asked.command->get_options()) {
    for (const std::string& longer : each->get_lnames()) known.push_back("--" + longer);
  }
  return {"there is no such option" + hint(name, known), name, help_of(asked)};
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
  } catch (const CLI::ExtrasError&) {
    return bad_input(with_unknown_words(app));
  } catch (const CLI::ParseError& error) {
    return bad_input({error.what(), "", help_of(asked_for(app))});
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
