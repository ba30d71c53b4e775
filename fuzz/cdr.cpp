// A ROS 2 message as anybody on the wire may send it: the first two bytes say which type it is taken for, the rest is
// any bytes. What is refused is refused in one readable line; what is taken is written and read again as the same. A
// type that is read of its interface file takes what the struct takes, and makes the same of it.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "pons/wire/cdr.hpp"
#include "pons/wire/interface_types.hpp"
#include "pons/wire/known_types.hpp"
#include "pons/wire/schema.hpp"
#include "pons/wire/types/all_types.hpp"

namespace {

using namespace pons;

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_cdr: %s\n", what.c_str());
  std::abort();
}

// A message's own definition: others' parts have none.
void take_as_read(const std::string& name, std::span<const std::byte> bytes) {
  static wire::InterfaceTypes types([](const std::string& interface) -> Expected<wire::InterfaceText> {
    return wire::InterfaceText{std::string(wire::definition(interface)), interface};
  });
  if (name.find("/msg/") == name.npos || wire::wire_name(name) != name) return;
  const auto read = types.type(name);
  if (!read) found(read.error().line());
  const auto wanted = wire::known_type(name)->to_json(bytes), got = read->to_json(bytes);
  if (wanted.has_value() != got.has_value()) found(name + " is taken by one of both");
  if (wanted ? *got != *wanted : got.error().line() != wanted.error().line()) found(name + " is read as another");
}

// Numbers that are none are equal to nothing, so what is compared is bytes.
template <wire::Message T>
void take(std::span<const std::byte> bytes) {
  take_as_read(std::string(T::kName), bytes);
  T message, again;
  if (const auto taken = wire::decode(bytes, message); !taken) {
    const std::string line = taken.error().line();
    if (line.empty() || line.size() > 300 || line.find('\n') != line.npos)
      found("an error that cannot be read: " + line);
    return;
  }
  std::vector<std::byte> written, rewritten;
  if (const auto kept = wire::encode(message, written); !kept) found(kept.error().line());
  // An empty string may have come without its zero, which ends in a gap then.
  if (written.size() > 2 * bytes.size() + wire::kPadding) found("it has grown");
  if (const auto taken = wire::decode(written, again); !taken) found(taken.error().line());
  if (!wire::encode(again, rewritten) || rewritten != written) found(std::string(T::kName) + " comes back as another");
}

template <typename... Each>  // clang takes no more than 256 with a concept
void take_as(std::size_t which, std::span<const std::byte> bytes, wire::Types<Each...>) {
  using Take = void (*)(std::span<const std::byte>);
  static constexpr Take kTakes[] = {&take<Each>...};
  kTakes[which % sizeof...(Each)](bytes);
}

}  // namespace

// libFuzzer calls it so: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t which = data[0] + std::size_t{256} * data[1];
  take_as(which, std::as_bytes(std::span(data, size)).subspan(2), wire::AllTypes{});
  return 0;
}
