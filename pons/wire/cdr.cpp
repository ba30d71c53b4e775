#include "pons/wire/cdr.hpp"

#include <fmt/format.h>

namespace pons::wire {
namespace {

constexpr const char* kMend = "the sender's type or its version may be another: compare the type hashes";

}  // namespace

const char* const CdrReader::kTooLong = "it tells of more than the bytes that are left can hold";

CdrReader::CdrReader(std::span<const std::byte> bytes) {
  if (bytes.size() < kEncapsulation) {
    fail_with("there is no encapsulation header");
    return;
  }
  // The last two bytes are options, of which plain CDR needs none.
  const auto kind = std::to_integer<unsigned>(bytes[0]) << 8U | std::to_integer<unsigned>(bytes[1]);
  if (kind > 1) fail_with("its encapsulation is not plain CDR");
  swapped_ = kind == 0;
  bytes_ = bytes.subspan(kEncapsulation);
}

const std::byte* CdrReader::bytes(std::size_t count, std::size_t alignment) {
  const std::size_t start = detail::aligned(at_, alignment);
  if (start > bytes_.size() || count > bytes_.size() - start) {
    fail_with("the bytes end before it does");
    return nullptr;
  }
  at_ = start + count;
  return bytes_.data() + start;
}

std::size_t CdrReader::length() {
  const std::size_t most = std::exchange(most_, kAny);
  std::uint32_t count = 0;
  take(count);
  if (count > left()) fail_with(kTooLong);
  if (count > most) fail_with("it is longer than its type allows");
  return failed() ? 0 : count;
}

void CdrReader::take(bool& value) {
  std::uint8_t byte = 0;
  take(byte);
  if (byte > 1) fail_with("it is neither true nor false");
  value = byte == 1;
}

// Its length counts the zero at its end. Some writers send an empty one without.
void CdrReader::take(std::string& text) {
  const std::size_t most = std::exchange(most_, kAny);
  const std::size_t count = length();
  const std::byte* const from = bytes(count, 1);
  if (from == nullptr || failed()) return;
  if (count == 0) return text.clear();
  if (from[count - 1] != std::byte{0}) return fail_with("no zero ends it");
  if (count - 1 > most) return fail_with("it is longer than its type allows");
  text.assign(reinterpret_cast<const char*>(from), count - 1);
}

void CdrReader::end() {
  if (failed()) return;
  field_ = {};
  if (left() > kPadding) fail_with("more bytes follow than it has fields for");
}

Error CdrReader::error(std::string_view type) const {
  std::string where = fmt::format("{} at byte {}", type, at_ + kEncapsulation);
  if (!field_.empty()) where = fmt::format("{}, field '{}'", where, field_);
  return {problem_, std::move(where), kMend};
}

}  // namespace pons::wire
