// A running 64-bit digest (FNV-1a) of what a run did: two runs of one seed must agree to the byte. Not cryptographic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace pons {

class Digest {
 public:
  constexpr void add(std::string_view bytes) {
    for (const char byte : bytes) {
      value_ ^= static_cast<unsigned char>(byte);
      value_ *= 0x100000001b3ULL;
    }
  }
  // The object representation; T must have no padding to hash.
  template <typename T>
    requires std::is_arithmetic_v<T>
  void add(T value) {
    add(std::string_view(reinterpret_cast<const char*>(&value), sizeof value));
  }
  void add(std::span<const double> values) {
    add(std::string_view(reinterpret_cast<const char*>(values.data()), values.size_bytes()));
  }
  [[nodiscard]] constexpr std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace pons
