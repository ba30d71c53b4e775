// CDR as ROS 2 nodes exchange it: OMG's "plain" XCDR version 1 (DDS-XTYPES 1.3, 7.4), final types without keys, little
// endian when written, either when read. Bytes in, bytes out; any thread.
//
// A message is a struct that tools/ros_codecs made of a ROS 2 interface file: it shows its fields, in order, to a
// visitor, and all that is here are visitors.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::wire {

template <typename T>
concept Message = requires {
  { T::kName } -> std::convertible_to<std::string_view>;
};

template <typename T>
concept Number = std::is_arithmetic_v<T>;

// An array of a type that is known only when the program runs (pons/wire/dynamic.hpp): as many elements as it has.
template <typename T>
struct Fixed : std::vector<T> {
  using std::vector<T>::vector;
};

namespace detail {

template <typename T>
inline constexpr bool kIsArray = false;
template <typename T, std::size_t kCount>
inline constexpr bool kIsArray<std::array<T, kCount>> = true;
template <typename T>
inline constexpr bool kIsArray<Fixed<T>> = true;

}  // namespace detail

template <typename T>
concept Array = detail::kIsArray<T>;

template <typename T>
concept Sequence = !Array<T> && std::derived_from<T, std::vector<typename T::value_type>>;

// What a sequence grows by.
template <Sequence T>
[[nodiscard]] typename T::value_type blank_of(const T& sequence) {
  if constexpr (requires { sequence.blank(); }) {
    return sequence.blank();
  } else {
    return {};
  }
}

// That many elements or characters at most.
struct AtMost {
  std::size_t count;
};

inline constexpr std::size_t kEncapsulation = 4;  // bytes before the first field, of which two say how it is encoded
inline constexpr std::size_t kPadding = 3;        // bytes that some writers append, to end at a multiple of four

namespace detail {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

constexpr std::size_t aligned(std::size_t at, std::size_t to) { return (at + to - 1) / to * to; }

// Visits what CDR is made of: numbers, strings, sequences and structs, down to `sink.number`, `sink.numbers` and
// `sink.text`.
template <typename Sink>
class Encoding {
 public:
  explicit Encoding(Sink& sink) : sink_(sink) {}
  template <typename T>
  void operator()(std::string_view /*name*/, const T& value) {
    put(value);
  }
  template <typename T>
  void operator()(std::string_view /*name*/, const T& value, AtMost most) {
    if (value.size() > most.count) sink_.fits = false;
    put(value);
  }

 private:
  void put(const std::string& text) {
    sink_.number(static_cast<std::uint32_t>(text.size() + 1));
    sink_.text(text);
  }
  template <Number T>
  void put(T value) {
    sink_.number(value);
  }
  template <Message T>
  void put(const T& message) {
    T::each_field(message, *this);
  }
  template <Array T>
  void put(const T& values) {
    elements(values);
  }
  template <Sequence T>
  void put(const T& values) {
    sink_.number(static_cast<std::uint32_t>(values.size()));
    elements(values);
  }
  template <typename Values>
  void elements(const Values& values) {
    using T = typename Values::value_type;
    if constexpr (Number<T> && !std::same_as<T, bool>) {
      if (!values.empty()) sink_.numbers(values.data(), values.size());
    } else {
      for (const auto& value : values) put(static_cast<const T&>(value));
    }
  }

  Sink& sink_;
};

// How long it becomes.
struct Length {
  std::size_t at = 0;  // after the encapsulation
  bool fits = true;    // within the bounds of its type
  template <Number T>
  void number(T) {
    at = aligned(at, sizeof(T)) + sizeof(T);
  }
  template <Number T>
  void numbers(const T*, std::size_t count) {
    at = aligned(at, sizeof(T)) + count * sizeof(T);
  }
  void text(const std::string& value) { at += value.size() + 1; }
};

// Into room that is large enough. Gaps are zero.
struct Bytes {
  std::byte* begin;
  std::size_t at = 0;
  bool fits = true;
  template <Number T>
  void number(T value) {
    numbers(&value, 1);
  }
  template <Number T>
  void numbers(const T* values, std::size_t count) {
    const std::size_t start = aligned(at, sizeof(T));
    std::memset(begin + at, 0, start - at);
    std::memcpy(begin + start, values, count * sizeof(T));
    at = start + count * sizeof(T);
  }
  void text(const std::string& value) {
    std::memcpy(begin + at, value.c_str(), value.size() + 1);
    at += value.size() + 1;
  }
};

}  // namespace detail

// Of the whole message, encapsulation included; 0: something in it is longer than its type allows, or 4 GiB.
template <Message T>
[[nodiscard]] std::size_t encoded_size(const T& message) {
  detail::Length length;
  detail::Encoding<detail::Length> visit(length);
  T::each_field(message, visit);
  return length.fits && length.at <= 0xFFFF'FFFF ? kEncapsulation + length.at : 0;
}

// Allocates nothing. How many bytes of `room` it takes; 0: they are too few, or something is longer than its type
// allows; then nothing is written.
template <Message T>
[[nodiscard]] std::size_t encode(const T& message, std::span<std::byte> room) {
  const std::size_t size = encoded_size(message);
  if (size == 0 || size > room.size()) return 0;
  constexpr std::array kLittleEndian{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  std::ranges::copy(kLittleEndian, room.begin());
  detail::Bytes bytes{room.data() + kEncapsulation};
  detail::Encoding<detail::Bytes> visit(bytes);
  T::each_field(message, visit);
  return size;
}

// In place of what `bytes` held; they keep their room, so that only longer messages than before allocate.
template <Message T>
[[nodiscard]] Expected<void> encode(const T& message, std::vector<std::byte>& bytes) {
  bytes.resize(encoded_size(message));
  if (!bytes.empty() && encode(message, std::span(bytes)) == bytes.size()) return {};
  return fail("something in it is longer than its type allows", std::string(T::kName),
              "shorten what it holds to the bounds of its interface file");
}

// Reads one message. The first thing that is wrong is kept, and nothing is read after it.
class CdrReader {
 public:
  // `bytes`, the encapsulation included, must outlive it.
  explicit CdrReader(std::span<const std::byte> bytes);

  template <typename T>
  void operator()(std::string_view name, T& value) {
    if (failed()) return;
    field_ = name;
    take(value);
  }
  template <typename T>
  void operator()(std::string_view name, T& value, AtMost most) {
    if (failed()) return;
    field_ = name;
    most_ = most.count;
    take(value);
  }
  [[nodiscard]] bool failed() const { return problem_ != nullptr; }
  // After the last field.
  void end();
  // What is wrong, in which field and at which byte; only if it failed.
  [[nodiscard]] Error error(std::string_view type) const;

 private:
  static constexpr std::size_t kAny = 0xFFFF'FFFF;

  void fail_with(const char* problem) {
    if (!failed()) problem_ = problem;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  // So many aligned bytes; nullptr: there are not so many.
  [[nodiscard]] const std::byte* bytes(std::size_t count, std::size_t alignment);
  // How many elements or characters follow, each of them of at least one byte; no more than `most_`, once.
  [[nodiscard]] std::size_t length();

  template <Number T>
  void take(T& value) {
    numbers(&value, 1);
  }
  void take(bool& value);
  void take(std::string& text);
  template <Message T>
  void take(T& message) {
    T::each_field(message, *this);
  }
  template <Array T>
  void take(T& values) {
    elements(values);
  }
  template <Sequence T>
  void take(T& values) {
    using Element = typename T::value_type;
    const std::size_t count = length();
    if constexpr (Number<Element>) {
      if (count > left() / sizeof(Element)) return fail_with(kTooLong);
      values.resize(count);
      elements(values);
    } else {
      // One by one: what a count promises may not be there.
      if (values.size() > count) values.resize(count);
      for (std::size_t i = 0; i < count && !failed(); ++i)
        take(i < values.size() ? values[i] : values.emplace_back(blank_of(values)));
    }
  }
  // As many as there are.
  template <typename Values>
  void elements(Values& values) {
    using Element = typename Values::value_type;
    if constexpr (std::same_as<Element, bool>) {
      for (std::size_t i = 0; i < values.size() && !failed(); ++i) {
        bool value = false;
        take(value);
        values[i] = value;
      }
    } else if constexpr (Number<Element>) {
      if (!values.empty()) numbers(values.data(), values.size());
    } else {
      for (std::size_t i = 0; i < values.size() && !failed(); ++i) take(values[i]);
    }
  }
  template <Number T>
  void numbers(T* values, std::size_t count) {
    const std::byte* const from = bytes(count * sizeof(T), sizeof(T));
    if (from == nullptr) return;
    std::memcpy(values, from, count * sizeof(T));
    if (!swapped_ || sizeof(T) == 1) return;
    for (std::size_t i = 0; i < count; ++i) {
      auto raw = std::bit_cast<std::array<std::byte, sizeof(T)>>(values[i]);
      std::ranges::reverse(raw);
      values[i] = std::bit_cast<T>(raw);
    }
  }

  static const char* const kTooLong;

  std::span<const std::byte> bytes_;  // after the encapsulation
  std::size_t at_ = 0, most_ = kAny;
  bool swapped_ = false;
  std::string_view field_;
  const char* problem_ = nullptr;
};

// In place of what `message` held; its strings and sequences keep their room. On an error what it holds is valid, and
// means nothing. Needs no more memory than some multiple of the bytes that are there, whatever lengths they tell of.
template <Message T>
[[nodiscard]] Expected<void> decode(std::span<const std::byte> bytes, T& message) {
  CdrReader reader(bytes);
  T::each_field(message, reader);
  reader.end();
  if (reader.failed()) return std::unexpected(reader.error(T::kName));
  return {};
}

}  // namespace pons::wire
