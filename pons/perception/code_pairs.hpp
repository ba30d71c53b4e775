// Codes that were read on one outline: two objects taken for one, or one that bears two labels.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "pons/core/time.hpp"

namespace pons::perception {

class CodePairs {
 public:
  void read_together(const std::string& one, const std::string& other) { other_[one] = other, other_[other] = one; }
  // What bears that code was taken away; frames up to `until` may not show it yet.
  void taken(std::string_view code, Time until) {
    if (other_.contains(code)) taken_.insert_or_assign(std::string(code), until);
  }
  // What bears that code was seen as it ever was: if its pair was taken away before, they were two.
  void stays(std::string_view code, Time stamp) {
    const auto pair = other_.find(code);
    if (pair == other_.end()) return;
    const auto away = taken_.find(pair->second);
    if (away == taken_.end() || stamp <= away->second) return;
    other_.erase(away->first);
    other_.erase(pair);
    taken_.erase(away);
  }
  // The code that may be on the same object; nullptr: none.
  [[nodiscard]] const std::string* other(std::string_view code) const {
    const auto pair = other_.find(code);
    return pair == other_.end() ? nullptr : &pair->second;
  }

 private:
  std::map<std::string, std::string, std::less<>> other_;
  std::map<std::string, Time, std::less<>> taken_;
};

}  // namespace pons::perception
