// For tests: of each type its hash, and the bytes of a message that test_fill.hpp fills, as other implementations have
// them (golden.py). golden_test.cpp shows that they are ours, too; whoever needs bytes of each type takes them from
// here.
#pragma once

#include <charconv>
#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pons::wire {

struct Golden {
  std::string name, hash;  // "std_msgs/msg/Header", "RIHS01_..."
  std::vector<std::byte> bytes;
};

// In the order of the names. The working folder is the checkout's.
[[nodiscard]] inline std::vector<Golden> read_golden() {
  std::vector<Golden> all;
  std::ifstream file("pons/wire/golden.txt");
  std::string hexadecimal;
  for (Golden one; file >> one.name >> one.hash >> hexadecimal; all.push_back(std::exchange(one, {}))) {
    for (std::size_t i = 0; i < hexadecimal.size(); i += 2) {
      unsigned byte = 0;
      const char* const digits = hexadecimal.data() + i;
      std::from_chars(digits, digits + 2, byte, 16);
      one.bytes.push_back(static_cast<std::byte>(byte));
    }
  }
  if (all.empty()) throw std::runtime_error("there is no pons/wire/golden.txt here, or nothing in it");
  return all;
}

}  // namespace pons::wire
