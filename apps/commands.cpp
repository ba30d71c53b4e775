#include "apps/commands.hpp"

#include <fmt/format.h>

#include <charconv>
#include <system_error>

namespace pons::apps {

// fmt::print throws where nobody reads: what a command comes to must not depend on that.
void say(std::FILE* out, const std::string& text) { (void)std::fputs(text.c_str(), out); }

CLI::Validator whole_number(std::uint64_t most) { return whole_number(0, most); }

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return CLI::Validator(
      [least, most](const std::string& text) {
        std::uint64_t number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error == std::errc() && end == text.data() + text.size() && least <= number && number <= most)
          return std::string();
        return fmt::format("'{}' is not a whole number from {} to {}", text, least, most);
      },
      "");
}

int bad_input(const Error& error) {
  say(stderr, fmt::format("pons: {}\n", error.line()));
  return kExitBadInput;
}

int bad_run(const Error& error) {
  say(stderr, fmt::format("pons: {}\n", error.line()));
  return kExitBadRun;
}

}  // namespace pons::apps
