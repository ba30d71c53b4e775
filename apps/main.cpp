// The command line: composes, parses, and runs what was chosen.

#include <fmt/format.h>
#include <cstdio>
#include <exception>

#include "apps/commands.hpp"

namespace pons::apps {

int bad_input(const Error& error) {
  fmt::print(stderr, "pons: {}\n", error.line());
  return kExitBadInput;
}

int bad_run(const Error& error) {
  fmt::print(stderr, "pons: {}\n", error.line());
  return kExitBadRun;
}

namespace {

int run_command_line(int argc, char** argv) {
  CLI::App app{"Pons: the bridge between a robot's brain and its body.", "pons"};
  app.set_version_flag("--version", PONS_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::help);
  app.footer("Start with: pons run parcel_cell");
  Chosen chosen;
  add_run(app, chosen);
  add_worlds(app, chosen);
  add_skills(app, chosen);
  add_task(app, chosen);
  add_doctor(app, chosen);
  add_completion(app, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForVersion& version) {
    return app.exit(version);
  } catch (const CLI::RequiredError& error) {
    // CLI11 says only that a command is missing when it knows none of the words.
    const bool unknown = app.get_subcommands().empty() && argc > 1;
    const std::string what = unknown ? fmt::format("no command '{}'", argv[1]) : error.what();
    fmt::print(stderr, "pons: {}; pons --help shows what there is\n", what);
    return kExitBadInput;
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "pons: {}; pons --help shows what there is\n", error.what());
    return kExitBadInput;
  }
  return chosen();
}

}  // namespace
}  // namespace pons::apps

int main(int argc, char** argv) {
  try {
    return pons::apps::run_command_line(argc, argv);
  } catch (const std::exception& error) {
    // Whatever a person can cause has an error of its own: this is a fault of the program, or memory ran out.
    std::fprintf(stderr, "pons: internal error: %s\n", error.what());
    return pons::apps::kExitBadRun;
  }
}
