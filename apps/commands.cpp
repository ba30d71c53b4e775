#include "apps/commands.hpp"

#include <fmt/format.h>

namespace pons::apps {

// fmt::print throws where nobody reads: what a command comes to must not depend on that.
void say(std::FILE* out, const std::string& text) { (void)std::fputs(text.c_str(), out); }

int bad_input(const Error& error) {
  say(stderr, fmt::format("pons: {}\n", error.line()));
  return kExitBadInput;
}

int bad_run(const Error& error) {
  say(stderr, fmt::format("pons: {}\n", error.line()));
  return kExitBadRun;
}

}  // namespace pons::apps
