// What a running tree remembers by name. How much that is, and how much of it is handled in one tick, is bounded: all
// that a tree remembers is written down with each checkpoint and with its outcome, and a bridge's tick is short.
//
// What counts are the bytes of texts, lists and objects; single numbers do not, for there are kMaxSlots at most.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "pons/bridge/tree/value.hpp"
#include "pons/core/error.hpp"

namespace pons::bridge::tree {

// One entry. `writes` counts every assignment, of the same value, too. -1: a constant that nothing has written over,
// which counts as written once, as there.
struct Slot {
  Value value;
  std::int64_t writes = 0;
  bool exists = false;
};

class Blackboard {
 public:
  // All entries that were written and all queues together: as much as a whole task.
  static constexpr std::size_t kMaxBytes = 64 * 1024;
  // Read, joined and written in one tick: 256 of the longest texts, which take about a millisecond.
  static constexpr std::size_t kMaxBytesATick = 4 * 1024 * 1024;

  // What the slots hold now are the tree's own constants, which count when they are written anew.
  explicit Blackboard(std::vector<Slot> slots) : slots_(std::move(slots)) {}

  [[nodiscard]] const Slot& operator[](std::int32_t slot) const { return slots_[static_cast<std::size_t>(slot)]; }
  [[nodiscard]] const std::vector<Slot>& slots() const { return slots_; }

  // It exists from now on, though nothing may have been written to it.
  void make(std::int32_t slot) { slots_[static_cast<std::size_t>(slot)].exists = true; }
  // As if it had never existed.
  void unset(std::int32_t slot);
  // One more write. Error: too much is remembered, or was handled in this tick; nothing was written.
  [[nodiscard]] Expected<void> write(std::int32_t slot, Value value);
  // As it was in another process. Error: as of write().
  [[nodiscard]] Expected<void> put(std::int32_t slot, Slot as);
  // What a tree keeps beside its entries, instead of what it kept there `before`. Error: as of write().
  [[nodiscard]] Expected<void> keep(std::size_t bytes, std::size_t before);

  // That much is about to be read. Error: that is too much for one tick.
  [[nodiscard]] Expected<void> handle(std::size_t bytes);
  [[nodiscard]] std::size_t handled() const { return handled_; }
  void begin_tick() { handled_ = 0; }

 private:
  std::vector<Slot> slots_;
  std::size_t bytes_ = 0, handled_ = 0;
};

}  // namespace pons::bridge::tree
