// The subcommands of `pons`. Each adds itself to the parser; what a person chose runs after parsing.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::apps {

inline constexpr int kExitGood = 0;
inline constexpr int kExitBadRun = 1;    // parcels lost or missorted, a limit broken, a part failed
inline constexpr int kExitBadInput = 2;  // what was asked cannot be done: one line says why
inline constexpr int kExitBodyGone = 3;  // pons bridge: its body has died or was ended
inline constexpr int kExitNoResult = 4;  // pons sweep: a run has no result, and none is bad
inline constexpr int kExitInterrupted = 130;

using Chosen = std::function<int()>;  // returns the exit code

void add_run(CLI::App& app, Chosen& chosen);
// `words`: the whole command line after `pons`; `further`: what of it stands after --, which the parser does not see.
void add_sweep(CLI::App& app, Chosen& chosen, const std::vector<std::string>& words,
               const std::vector<std::string>& further);
void add_body(CLI::App& app, Chosen& chosen);
void add_bridge(CLI::App& app, Chosen& chosen);
void add_worlds(CLI::App& app, Chosen& chosen);
void add_skills(CLI::App& app, Chosen& chosen);
void add_trees(CLI::App& app, Chosen& chosen);
void add_task(CLI::App& app, Chosen& chosen);
void add_journal(CLI::App& app, Chosen& chosen);
void add_book(CLI::App& app, Chosen& chosen);
void add_recording(CLI::App& app, Chosen& chosen);
void add_replay(CLI::App& app, Chosen& chosen);
void add_robot(CLI::App& app, Chosen& chosen);
void add_health(CLI::App& app, Chosen& chosen);
void add_doctor(CLI::App& app, Chosen& chosen);
void add_completion(CLI::App& app, Chosen& chosen);

// Whether `pons run WORDS` would begin: all that can be told before anything is built. Errors: what it would say.
[[nodiscard]] Expected<void> check_run(const std::vector<std::string>& words);

// Of an option: a whole number from 0, or `least`, to `most`. The parser's own conversion clamps what does not fit, and
// its own range from 0 on names the largest double there is.
[[nodiscard]] CLI::Validator whole_number(std::uint64_t most = std::numeric_limits<std::uint64_t>::max());
[[nodiscard]] CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);

// A line for a person, on stdout or stderr. Never throws.
void say(std::FILE* out, const std::string& text);

// What came from elsewhere (a file, its name, another program), for a person's terminal: what would tell that what to
// do (control characters, those of ISO 8859 among them, and line feeds) is '?', and so are bytes that are no UTF-8.
[[nodiscard]] std::string plain(std::string_view text);

// Print "pons: <line>" on the error stream, plain.
int bad_input(const Error& error);
int bad_run(const Error& error);

}  // namespace pons::apps
