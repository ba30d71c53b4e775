#include "pons/wire/known_types.hpp"

#include <array>

#include "pons/wire/schema.hpp"
#include "pons/wire/types/all_types.hpp"

namespace pons::wire {
namespace {

template <Message T>
Expected<Json> decoded(std::span<const std::byte> cdr) {
  T message;
  if (auto taken = decode(cdr, message); !taken) return std::unexpected(taken.error());
  return to_json(message);
}

template <typename... Each>
constexpr auto listed(Types<Each...>) {
  return std::array<KnownType, sizeof...(Each)>{KnownType{Each::kName, Each::kHash, &decoded<Each>}...};
}

constexpr auto kKnown = listed(AllTypes{});

}  // namespace

std::vector<const KnownType*> known_types(std::string_view name) {
  std::vector<const KnownType*> found;
  for (const KnownType& each : kKnown) {
    if (wire::wire_name(each.name) == name) found.push_back(&each);
  }
  return found;
}

}  // namespace pons::wire
