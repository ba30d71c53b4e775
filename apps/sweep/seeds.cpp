#include "apps/sweep/seeds.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <set>

namespace pons::apps {
namespace {

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Expected<std::vector<std::uint64_t>> seeds_of(std::string_view text) {
  const std::string where = fmt::format("--seeds {}", text);
  std::vector<std::uint64_t> seeds;
  std::set<std::uint64_t> known;
  for (std::size_t at = 0; at <= text.size();) {
    const std::string_view part = text.substr(at, text.find(',', at) - at);
    at += part.size() + 1;
    const std::size_t dash = part.find('-');
    const auto first = number(part.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : number(part.substr(dash + 1));
    if (!first || !last)
      return fail(fmt::format("'{}' is neither a seed nor a range of seeds", part), where,
                  "write whole numbers of 0 or more and ranges of them, as in 1-20,31");
    if (*last < *first)
      return fail(fmt::format("'{}' goes down", part), where, fmt::format("write {}-{}", *last, *first));
    if (*last - *first >= kMostRuns - seeds.size())
      return fail(fmt::format("these are more than {} seeds", kMostRuns), where, "make several sweeps");
    for (std::uint64_t i = 0; i <= *last - *first; ++i) {
      if (!known.insert(*first + i).second)
        return fail(fmt::format("seed {} is named twice", *first + i), where, "name each seed once");
      seeds.push_back(*first + i);
    }
  }
  return seeds;
}

}  // namespace pons::apps
