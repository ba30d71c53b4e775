#include "apps/sweep/launch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "apps/sweep/children.hpp"
#include "pons/record/sweep.hpp"

namespace pons::apps {
namespace {

// The first word that is no NAME=value; empty where only a shell could tell.
std::string program_of(std::string_view launch) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+";
  while (true) {
    launch.remove_prefix(std::min(launch.find_first_not_of(" \t"), launch.size()));
    const std::string_view word = launch.substr(0, launch.find_first_of(" \t"));
    if (word.empty() || word.find_first_of("'\"$`\\") != std::string_view::npos) return {};
    if (word.find('=') == std::string_view::npos)
      return word.find_first_not_of(kPlain) == std::string_view::npos ? std::string(word) : std::string();
    launch.remove_prefix(word.size());
  }
}

}  // namespace

std::string filled(std::string_view launch, const Start& start) {
  const std::string line = record::shell_line(start.command);
  const std::array<std::pair<std::string_view, std::string>, 4> values{{{"{}", line},
                                                                        {"{quoted}", record::shell_word(line)},
                                                                        {"{number}", fmt::format("{}", start.number)},
                                                                        {"{slot}", fmt::format("{}", start.slot)}}};
  std::string text;
  while (!launch.empty()) {
    const auto* const found =
        std::ranges::find_if(values, [&](const auto& value) { return launch.starts_with(value.first); });
    text += found == values.end() ? std::string(launch.substr(0, 1)) : found->second;
    launch.remove_prefix(found == values.end() ? 1 : found->first.size());
  }
  return text;
}

Expected<void> check_launch(const std::string& launch) {
  const std::string where = fmt::format("--launch '{}'", launch);
  if (!launch.contains("{}") && !launch.contains("{quoted}"))
    return fail("does not say where the run's command goes", where, "write {} there, as in 'srun -n1 {}'");
  const std::string program = program_of(launch);
  if (program.empty()) return {};
  auto child = Child::start({.words = {"/bin/sh", "-c", "command -v \"$1\"", "sh", program}, .output = "/dev/null"});
  if (!child) return std::unexpected(child.error());
  if (child->wait().code == 0) return {};
  return fail(fmt::format("there is no '{}'", program), where, "install it, or name it with its path");
}

}  // namespace pons::apps
