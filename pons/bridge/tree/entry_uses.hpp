// Which entries of the blackboards something sets, and where the others are read.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pons/bridge/tree/script.hpp"

namespace pons::bridge::tree {

class EntryUses {
 public:
  void read(std::int32_t slot, const std::string& where);
  void set(std::int32_t slot) { set_.insert(slot); }
  // What runs `script` there does both.
  void by(const Script& script, const std::string& where);

  // Those that are read and never set, by slot, and where they are read first.
  [[nodiscard]] std::vector<std::pair<std::int32_t, std::string>> unset() const;

 private:
  std::vector<std::pair<std::int32_t, std::string>> read_;  // each slot once, in the order of the first readings
  std::set<std::int32_t> known_, set_;                      // those in there; and those that are set
};

}  // namespace pons::bridge::tree
