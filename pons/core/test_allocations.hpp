// How often a piece of code allocates with operator new. For tests: include it in one source of a test program, whose
// global operators it replaces. What runs inside a tick is watched by the guard instead (pons/rt/guard.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace pons::test_allocations {

// Counted on the thread that asks, while it asks; the program's other tests are not affected.
inline thread_local bool counting = false;
inline thread_local std::uint64_t count = 0;

inline void* counted(std::size_t size) {
  if (counting) ++count;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}

// While `code` runs. Give it one that allocates, too, to see that it would be seen.
template <typename Code>
[[nodiscard]] std::uint64_t allocations_in(Code code) {
  count = 0;
  counting = true;
  code();
  counting = false;
  return count;
}

}  // namespace pons::test_allocations

// NOLINTBEGIN: replacing the global operators is how allocations are seen. None is inlined: GCC would find a free() of
// what it knows to come from operator new.
void* operator new(std::size_t size) { return pons::test_allocations::counted(size); }
void* operator new[](std::size_t size) { return pons::test_allocations::counted(size); }
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
// NOLINTEND
