#include "apps/commands.hpp"

#include <fmt/format.h>

#include <charconv>
#include <system_error>

#include "pons/world/csv.hpp"

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

std::string plain(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const auto lead = static_cast<unsigned char>(text.front());
    const std::string_view one = text.substr(0, lead < 0x80 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4);
    const bool whole = world::is_utf8(one);
    const bool later = lead == 0xC2 && whole && static_cast<unsigned char>(one.back()) < 0xA0;  // U+0080 to U+009F
    const bool shows = whole && lead >= 0x20 && lead != 0x7F && !later;
    shown += shows ? one : "?";
    text.remove_prefix(whole ? one.size() : 1);
  }
  return shown;
}

int bad_input(const Error& error) {
  say(stderr, fmt::format("pons: {}\n", plain(error.line())));
  return kExitBadInput;
}

int bad_run(const Error& error) {
  say(stderr, fmt::format("pons: {}\n", plain(error.line())));
  return kExitBadRun;
}

}  // namespace pons::apps
