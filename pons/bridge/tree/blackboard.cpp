#include "pons/bridge/tree/blackboard.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <utility>

namespace pons::bridge::tree {
namespace {

std::size_t bytes_of(const Slot& slot) { return slot.writes > 0 ? tree::bytes_of(slot.value) : 0; }

}  // namespace

Expected<void> Blackboard::handle(std::size_t bytes) {
  handled_ += bytes;
  if (handled_ <= kMaxBytesATick) return {};
  return fail(fmt::format("more than {} bytes of texts and lists are handled in one tick", kMaxBytesATick),
              "blackboard", "let the tree sleep in between, or keep shorter texts");
}

Expected<void> Blackboard::keep(std::size_t bytes, std::size_t before) {
  if (auto handled = handle(bytes); !handled) return handled;
  const std::size_t all = bytes_ - before + bytes;
  if (all > kMaxBytes && bytes > before) {
    return fail(fmt::format("its texts and lists would have more than {} bytes together", kMaxBytes), "blackboard",
                "keep shorter ones, or unset what is needed no more");
  }
  bytes_ = all;
  return {};
}

Expected<void> Blackboard::put(std::int32_t slot, Slot as) {
  Slot& to = slots_[static_cast<std::size_t>(slot)];
  if (auto fits = keep(bytes_of(as), bytes_of(to)); !fits) return fits;
  to = std::move(as);
  return {};
}

Expected<void> Blackboard::write(std::int32_t slot, Value value) {
  return put(slot, {std::move(value), std::abs((*this)[slot].writes) + 1, true});
}

void Blackboard::unset(std::int32_t slot) {
  Slot& to = slots_[static_cast<std::size_t>(slot)];
  bytes_ -= bytes_of(to);
  to = {};
}

}  // namespace pons::bridge::tree
