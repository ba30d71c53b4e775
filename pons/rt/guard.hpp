// Marks the part of a thread that must not allocate, lock, make a system call or fault a page, so that a guard can
// prove it. docs/real_time.md says which guards there are, and what each of them cannot see.
#pragma once

#include "pons/core/realtime.hpp"

extern "C" {
// The guard's, when one is preloaded; otherwise null. Once a tick each, on the tick's own thread; they nest.
[[gnu::weak]] void pons_tick_begin() noexcept PONS_NONBLOCKING;
[[gnu::weak]] void pons_tick_end() noexcept PONS_NONBLOCKING;
}

namespace pons::rt {

// From its making to its end, the calling thread is inside a tick. Any thread may be, each for itself; scopes nest, and
// the outermost counts. Without a guard it does nothing but see that there is none.
class InTick {
 public:
  InTick() noexcept PONS_NONBLOCKING {
    if (pons_tick_begin != nullptr) pons_tick_begin();
  }
  ~InTick() noexcept PONS_NONBLOCKING {
    if (pons_tick_end != nullptr) pons_tick_end();
  }
  InTick(const InTick&) = delete;
  InTick& operator=(const InTick&) = delete;
};

}  // namespace pons::rt
