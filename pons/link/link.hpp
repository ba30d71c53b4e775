// The link, inside one process or in memory that two share: the only way from the bridge to the cerebellum. Commands go
// down through a ring (all of them, in order), states come up through a triple buffer (the newest), and one word stops
// everything.
#pragma once

#include <atomic>
#include <cstddef>

#include "pons/core/realtime.hpp"
#include "pons/link/message.hpp"
#include "pons/rt/ring.hpp"
#include "pons/rt/triple_buffer.hpp"
#include "pons/rt/wake_word.hpp"

namespace pons::link {

// Some 600 KiB: keep it on the heap. Outlives both ends. No pointer is in it, and either side may be killed at any
// instant: the other sees whole commands and states only.
class Link {
 public:
  static constexpr std::size_t kCommands = 1024;

  // Latches an emergency stop and wakes the loop for it. Any thread, signal handlers too. No command lifts it.
  void raise_emergency_stop() { emergency_.set(1); }
  // Lets go of the word, as a person does who unlocks the button. The stop itself stays until kReset.
  void clear_emergency_stop() { emergency_.set(0); }
  [[nodiscard]] bool emergency_stop_raised() const PONS_NONBLOCKING { return emergency_.value() != 0; }

 private:
  friend class BridgeEnd;
  friend class CerebellumEnd;
  rt::SpscRing<Command, kCommands> commands_;
  std::atomic<std::size_t> first_{0};  // command of the present bridge's end; what stands before is a dead one's
  rt::TripleBuffer<State> states_;
  rt::WakeWord emergency_;
};

// The bridge's end. One thread, and one at a time: what the one before it had sent and the cerebellum has not yet taken
// in, is never taken in.
class BridgeEnd {
 public:
  explicit BridgeEnd(Link& link) : link_(link) {
    link_.first_.store(link_.commands_.take_over(), std::memory_order_release);
  }

  // False when the ring is full (the cerebellum does not take commands): nothing was sent.
  [[nodiscard]] bool send(const Command& command) PONS_NONBLOCKING { return link_.commands_.push(command); }
  // How many commands send() is sure to take now: look before sending the pieces of a motion, which are useless in
  // part.
  [[nodiscard]] std::size_t room() const PONS_NONBLOCKING { return link_.commands_.free(); }
  // The newest state; a default one (epoch 0) before the first tick. Valid until the next call.
  [[nodiscard]] const State& latest() PONS_NONBLOCKING { return link_.states_.read(); }
  void latest(State& state) PONS_NONBLOCKING { state = link_.states_.read(); }
  void raise_emergency_stop() { link_.raise_emergency_stop(); }
  void clear_emergency_stop() { link_.clear_emergency_stop(); }

 private:
  Link& link_;
};

// The cerebellum's end. One thread.
class CerebellumEnd {
 public:
  explicit CerebellumEnd(Link& link) : link_(link) {}
  // Instead of a loop that is no more, before the first receive(): what was sent to that one is never taken in.
  void take_over() PONS_NONBLOCKING { link_.commands_.drop_all(); }

  // False when there is none.
  [[nodiscard]] bool receive(Command& command) PONS_NONBLOCKING {
    link_.commands_.drop_before(link_.first_.load(std::memory_order_acquire));
    return link_.commands_.pop(command);
  }
  void publish(const State& state) PONS_NONBLOCKING { link_.states_.write(state); }
  [[nodiscard]] bool emergency_stop_raised() const PONS_NONBLOCKING { return link_.emergency_stop_raised(); }
  // What the loop sleeps on: it changes with raise_ and clear_emergency_stop().
  [[nodiscard]] const rt::WakeWord& emergency_word() const { return link_.emergency_; }

 private:
  Link& link_;
};

}  // namespace pons::link
