#include "pons/wire/schema.hpp"

#include <algorithm>
#include <ranges>
#include <set>

#include "pons/wire/types/all_schemas.hpp"

namespace pons::wire {
namespace {

constexpr std::string_view kOtherForm = "_humble";

const Definition* find(std::string_view name) {
  const auto found = std::ranges::lower_bound(kDefinitions, name, {}, &Definition::name);
  return found != kDefinitions.end() && found->name == name ? &*found : nullptr;
}

// Depth first, each once, as rosbag2 puts them together.
void add_needed(const Definition& of, std::set<std::string_view>& seen, std::string& text) {
  for (const auto word : std::views::split(of.needs, ' ')) {
    const std::string_view name(word.begin(), word.end());
    const Definition* needed = find(name);
    if (needed == nullptr || !seen.insert(name).second) continue;
    text += '\n' + std::string(80, '=') + "\nMSG: ";
    text += needed->label;
    text += '\n';
    text += needed->text;
    add_needed(*needed, seen, text);
  }
}

}  // namespace

std::string wire_name(std::string_view type) {
  const std::size_t slash = std::min(type.find('/'), type.size());
  std::string_view package = type.substr(0, slash);
  if (package.ends_with(kOtherForm)) package.remove_suffix(kOtherForm.size());
  return std::string(package) + std::string(type.substr(slash));
}

std::string_view definition(std::string_view type) {
  const Definition* const found = find(type);
  return found == nullptr ? std::string_view() : found->text;
}

std::string ros2msg_schema(std::string_view type) {
  const Definition* root = find(type);
  if (root == nullptr) return {};
  std::string text(root->text);
  std::set<std::string_view> seen{root->name};
  add_needed(*root, seen, text);
  return text;
}

}  // namespace pons::wire
