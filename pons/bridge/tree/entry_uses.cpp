#include "pons/bridge/tree/entry_uses.hpp"

#include <algorithm>
#include <iterator>

namespace pons::bridge::tree {

void EntryUses::read(std::int32_t slot, const std::string& where) {
  if (known_.insert(slot).second) read_.emplace_back(slot, where);
}

void EntryUses::by(const Script& script, const std::string& where) {
  for (const std::int32_t slot : script.reads()) read(slot, where);
  for (const std::int32_t slot : script.writes()) set(slot);
}

std::vector<std::pair<std::int32_t, std::string>> EntryUses::unset() const {
  std::vector<std::pair<std::int32_t, std::string>> unset;
  std::ranges::copy_if(read_, std::back_inserter(unset),
                       [this](const auto& each) { return !set_.contains(each.first); });
  return unset;
}

}  // namespace pons::bridge::tree
