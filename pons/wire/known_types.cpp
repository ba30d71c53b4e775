#include "pons/wire/known_types.hpp"

#include <algorithm>

#include "pons/wire/from_json.hpp"
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

template <Message T>
Expected<std::vector<std::byte>> encoded(const Json& json) {
  T message;
  if (auto taken = from_json(json, message); !taken) return std::unexpected(taken.error());
  std::vector<std::byte> bytes;
  if (auto put = encode(message, bytes); !put) return std::unexpected(put.error());
  return bytes;
}

template <Message T>
Json nothing() {
  return to_json(T{});
}

template <typename... Each>
std::vector<KnownType> listed(Types<Each...>) {
  return {
      KnownType{std::string(Each::kName), std::string(Each::kHash), &decoded<Each>, &encoded<Each>, &nothing<Each>}...};
}

const std::vector<KnownType>& known() {
  static const std::vector<KnownType> all = listed(AllTypes{});
  return all;
}

}  // namespace

std::vector<const KnownType*> known_types(std::string_view name) {
  std::vector<const KnownType*> found;
  for (const KnownType& each : known()) {
    if (wire::wire_name(each.name) == name) found.push_back(&each);
  }
  return found;
}

const KnownType* known_type(std::string_view name) {
  const auto found = std::ranges::find(known(), name, &KnownType::name);
  return found == known().end() ? nullptr : &*found;
}

}  // namespace pons::wire
