// The functions that the guard stands in for: they say that they were called inside a tick, and do what they always do.
#include <dlfcn.h>
#include <malloc.h>
#include <pthread.h>
#include <semaphore.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <ctime>

#include "tests/guard/watch.hpp"

namespace {

using pons::guard::Kind;

void allocates(const char* function) {
  if (pons::guard::watch.watching) pons::guard::found(Kind::kAllocation, function);
}

void* next(std::atomic<void*>& known, const char* function) {
  void* address = known.load(std::memory_order_relaxed);
  if (address != nullptr) return address;
  const pons::guard::Pause pause;
  address = dlsym(RTLD_NEXT, function);
  known.store(address, std::memory_order_relaxed);
  return address;
}

}  // namespace

// glibc's own, under names that nobody stands in for: dlsym itself would allocate.
// NOLINTBEGIN(bugprone-reserved-identifier, readability-identifier-naming)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* __libc_valloc(std::size_t size);
void* __libc_pvalloc(std::size_t size);
void __libc_free(void* memory);
}
// NOLINTEND(bugprone-reserved-identifier, readability-identifier-naming)

extern "C" {

void* malloc(std::size_t size) noexcept {
  allocates("malloc");
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  allocates("calloc");
  return __libc_calloc(count, size);
}

void* realloc(void* old, std::size_t size) noexcept {
  allocates("realloc");
  return __libc_realloc(old, size);
}

void* reallocarray(void* old, std::size_t count, std::size_t size) noexcept {
  allocates("reallocarray");
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(old, bytes);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  allocates("memalign");
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  allocates("aligned_alloc");
  return __libc_memalign(alignment, size);
}

void* valloc(std::size_t size) noexcept {
  allocates("valloc");
  return __libc_valloc(size);
}

void* pvalloc(std::size_t size) noexcept {
  allocates("pvalloc");
  return __libc_pvalloc(size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  allocates("posix_memalign");
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0) return EINVAL;
  void* got = __libc_memalign(alignment, size);
  if (got == nullptr) return ENOMEM;
  *memory = got;
  return 0;
}

void free(void* memory) noexcept {
  if (memory != nullptr) allocates("free");
  __libc_free(memory);
}

// What takes a lock or waits. An uncontended lock makes no system call, so nothing else would see it.
// NOLINTBEGIN(bugprone-macro-parentheses)
#define PONS_GUARD_LOCK(name, parameters, arguments)                          \
  int name parameters {                                                       \
    static constinit std::atomic<void*> known{nullptr};                       \
    if (pons::guard::watch.watching) pons::guard::found(Kind::kLock, #name);  \
    return reinterpret_cast<int(*) parameters>(next(known, #name)) arguments; \
  }
// NOLINTEND(bugprone-macro-parentheses)

PONS_GUARD_LOCK(pthread_mutex_lock, (pthread_mutex_t * mutex), (mutex))
PONS_GUARD_LOCK(pthread_mutex_timedlock, (pthread_mutex_t * mutex, const timespec* until), (mutex, until))
PONS_GUARD_LOCK(pthread_mutex_clocklock, (pthread_mutex_t * mutex, clockid_t clock, const timespec* until),
                (mutex, clock, until))
PONS_GUARD_LOCK(pthread_rwlock_rdlock, (pthread_rwlock_t * lock), (lock))
PONS_GUARD_LOCK(pthread_rwlock_wrlock, (pthread_rwlock_t * lock), (lock))
PONS_GUARD_LOCK(pthread_rwlock_timedrdlock, (pthread_rwlock_t * lock, const timespec* until), (lock, until))
PONS_GUARD_LOCK(pthread_rwlock_timedwrlock, (pthread_rwlock_t * lock, const timespec* until), (lock, until))
PONS_GUARD_LOCK(pthread_rwlock_clockrdlock, (pthread_rwlock_t * lock, clockid_t clock, const timespec* until),
                (lock, clock, until))
PONS_GUARD_LOCK(pthread_rwlock_clockwrlock, (pthread_rwlock_t * lock, clockid_t clock, const timespec* until),
                (lock, clock, until))
PONS_GUARD_LOCK(pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* mutex), (condition, mutex))
PONS_GUARD_LOCK(pthread_cond_timedwait, (pthread_cond_t * condition, pthread_mutex_t* mutex, const timespec* until),
                (condition, mutex, until))
PONS_GUARD_LOCK(pthread_cond_clockwait,
                (pthread_cond_t * condition, pthread_mutex_t* mutex, clockid_t clock, const timespec* until),
                (condition, mutex, clock, until))
PONS_GUARD_LOCK(pthread_spin_lock, (pthread_spinlock_t * lock), (lock))
PONS_GUARD_LOCK(pthread_barrier_wait, (pthread_barrier_t * barrier), (barrier))
PONS_GUARD_LOCK(pthread_join, (pthread_t thread, void** result), (thread, result))
PONS_GUARD_LOCK(sem_wait, (sem_t * semaphore), (semaphore))
PONS_GUARD_LOCK(sem_timedwait, (sem_t * semaphore, const timespec* until), (semaphore, until))
PONS_GUARD_LOCK(sem_clockwait, (sem_t * semaphore, clockid_t clock, const timespec* until), (semaphore, clock, until))
}
