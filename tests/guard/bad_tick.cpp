// A tick that does what its argument says, most of it forbidden; known_bad_test.cpp says what must come of it. Without
// a guard each of them ends, and with code 0.
#include <fcntl.h>
#include <linux/futex.h>
#include <malloc.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <thread>
#include <vector>

#include "pons/core/realtime.hpp"
#include "pons/rt/guard.hpp"

namespace {

using pons::rt::InTick;

constexpr auto kSoon = std::chrono::milliseconds(1);

// Where results go, so that the compiler leaves nothing out.
void* volatile kept;
volatile std::int64_t number;

template <typename Work>
void tick(Work work) PONS_NONBLOCKING {
  const InTick in_tick;
  work();
}

void good() {
  for (int i = 0; i < 1000; ++i) tick([] { number = number + 1; });
}

void nested() {
  tick([] { tick([] { number = number + 1; }); });
  kept = std::malloc(8);
  std::free(kept);
}

void after_nested() {
  tick([] {
    tick([] { number = number + 1; });
    kept = std::malloc(8);
  });
}

void outside() {
  for (int i = 0; i < 10; ++i) {
    tick([] { number = number + 1; });
    kept = new int(i);
    const std::vector<int> many(1'000'000, i);
    delete static_cast<int*>(kept);
  }
}

// Another thread does what it likes while this one is inside a tick.
void second_thread() {
  std::atomic<int> state{0};
  std::jthread other([&] {
    while (state != 1) {
    }
    std::mutex mutex;
    const std::lock_guard lock(mutex);
    kept = std::malloc(8);
    std::free(kept);
    number = getppid();
    state = 2;
  });
  tick([&] {
    state = 1;
    while (state != 2) {
    }
  });
}

// The handler's return is a system call, though not the tick's.
void interrupted() {
  static std::atomic<bool> rang{false};
  std::signal(SIGALRM, [](int) { rang = true; });
  constexpr timeval kOften{.tv_sec = 0, .tv_usec = 1'000};
  const itimerval timer{.it_interval = kOften, .it_value = kOften}, off{};
  setitimer(ITIMER_REAL, &timer, nullptr);
  tick([] {
    rang = false;
    while (!rang) {
    }
  });
  setitimer(ITIMER_REAL, &off, nullptr);
}

void clock_read() {
  tick([] {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    number = now.tv_nsec;
  });
}

void grows() {
  void* memory = std::malloc(8);
  kept = memory;
  tick([&] { kept = std::realloc(memory, 800); });
}

void aligns() {
  void* memory = nullptr;
  tick([&] { number = posix_memalign(&memory, 64, 64); });
  kept = memory;
}

void frees() {
  kept = std::malloc(8);
  tick([] { std::free(kept); });
}

void fills_a_vector() {
  std::vector<int> many;
  tick([&] { many.push_back(1); });
  number = many[0];
}

void throws() {
  tick([] {
    try {
      throw 1;
    } catch (int thrown) {
      number = thrown;
    }
  });
}

void mutex() {
  std::mutex mutex;
  tick([&] { const std::lock_guard lock(mutex); });
}

void contended() {
  std::timed_mutex mutex;
  const std::lock_guard held(mutex);
  std::jthread([&] { tick([&] { number = mutex.try_lock_for(kSoon); }); }).join();
}

void shared_mutex() {
  std::shared_mutex mutex;
  tick([&] { const std::shared_lock lock(mutex); });
}

void condition() {
  std::mutex mutex;
  std::condition_variable condition;
  std::unique_lock lock(mutex);
  tick([&] { number = static_cast<int>(condition.wait_for(lock, kSoon)); });
}

void spin() {
  pthread_spinlock_t lock{};
  pthread_spin_init(&lock, PTHREAD_PROCESS_PRIVATE);
  tick([&] { pthread_spin_lock(&lock); });
}

void semaphore() {
  sem_t one;
  sem_init(&one, 0, 1);
  tick([&] { sem_wait(&one); });
}

// Each waits for nothing, or for a moment that has passed.
constexpr timespec kPast{.tv_sec = 0, .tv_nsec = 0};

template <typename Take>
void locks_mutex(Take take) {
  pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
  tick([&] { number = take(&lock); });
}

template <typename Take>
void locks_rwlock(Take take) {
  pthread_rwlock_t lock = PTHREAD_RWLOCK_INITIALIZER;
  tick([&] { number = take(&lock); });
}

template <typename Wait>
void waits_for_semaphore(Wait wait) {
  sem_t one;
  sem_init(&one, 0, 1);
  tick([&] { number = wait(&one); });
}

template <typename Wait>
void waits_for_condition(Wait wait) {
  pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
  pthread_cond_t condition = PTHREAD_COND_INITIALIZER;
  pthread_mutex_lock(&lock);
  std::jthread other([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) pthread_cond_broadcast(&condition);
  });
  tick([&] { number = wait(&condition, &lock); });
}

void barrier() {
  pthread_barrier_t barrier;
  pthread_barrier_init(&barrier, nullptr, 1);
  tick([&] { number = pthread_barrier_wait(&barrier); });
}

void grows_array() {
  void* memory = std::malloc(8);
  kept = memory;
  tick([&] { kept = reallocarray(memory, 100, 8); });
}

void joins() {
  std::thread other([] {});
  tick([&] { other.join(); });
}

void reads() {
  const int zero = open("/dev/zero", O_RDONLY | O_CLOEXEC);
  std::array<char, 8> bytes{};
  tick([&] { number = read(zero, bytes.data(), bytes.size()); });
}

void writes() {
  tick([] { number = write(STDOUT_FILENO, "written\n", 8); });
}

void sleeps() {
  constexpr timespec kShort{.tv_sec = 0, .tv_nsec = 1'000};
  tick([&] { clock_nanosleep(CLOCK_MONOTONIC, 0, &kShort, nullptr); });
}

void futex() {
  static std::uint32_t word = 0;
  tick([] { number = syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0); });
}

// Past the C library, which a sanitizer's own would stand in for.
void raw() {
  tick([] {
    std::int64_t result = SYS_getppid;
    asm volatile("syscall" : "+a"(result) : : "rcx", "r11", "memory");
    number = result;
  });
}

void faults() {
  good();  // past the warm-up, and past the locking of what memory there is
  const auto bytes = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* page = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  tick([&] { *static_cast<volatile char*>(page) = 1; });
}

const std::map<std::string, void (*)()> kCases{
    {"good", good},
    {"nested", nested},
    {"after_nested", after_nested},
    {"outside", outside},
    {"second_thread", second_thread},
    {"clock", clock_read},
    {"interrupted", interrupted},
    {"malloc", [] { tick([] { kept = std::malloc(8); }); }},
    {"calloc", [] { tick([] { kept = std::calloc(1, 8); }); }},
    {"realloc", grows},
    {"aligned_alloc", [] { tick([] { kept = std::aligned_alloc(64, 64); }); }},
    {"posix_memalign", aligns},
    {"memalign", [] { tick([] { kept = memalign(64, 64); }); }},
    {"valloc", [] { tick([] { kept = valloc(8); }); }},
    {"pvalloc", [] { tick([] { kept = pvalloc(8); }); }},
    {"reallocarray", grows_array},
    {"free", frees},
    {"new", [] { tick([] { kept = new int(1); }); }},
    {"vector", fills_a_vector},
    {"exception", throws},
    {"mutex", mutex},
    {"contended", contended},
    {"shared_mutex", shared_mutex},
    {"condition", condition},
    {"spin", spin},
    {"timed_mutex", [] { locks_mutex([](auto* lock) { return pthread_mutex_timedlock(lock, &kPast); }); }},
    {"write_lock", [] { locks_rwlock([](auto* lock) { return pthread_rwlock_wrlock(lock); }); }},
    {"timed_read_lock", [] { locks_rwlock([](auto* lock) { return pthread_rwlock_timedrdlock(lock, &kPast); }); }},
    {"timed_write_lock", [] { locks_rwlock([](auto* lock) { return pthread_rwlock_timedwrlock(lock, &kPast); }); }},
    {"clock_read_lock",
     [] { locks_rwlock([](auto* lock) { return pthread_rwlock_clockrdlock(lock, CLOCK_MONOTONIC, &kPast); }); }},
    {"clock_write_lock",
     [] { locks_rwlock([](auto* lock) { return pthread_rwlock_clockwrlock(lock, CLOCK_MONOTONIC, &kPast); }); }},
    {"untimed_condition", [] { waits_for_condition(pthread_cond_wait); }},
    {"timed_condition",
     [] { waits_for_condition([](auto* of, auto* lock) { return pthread_cond_timedwait(of, lock, &kPast); }); }},
    {"barrier", barrier},
    {"semaphore", semaphore},
    {"timed_semaphore", [] { waits_for_semaphore([](auto* one) { return sem_timedwait(one, &kPast); }); }},
    {"clock_semaphore",
     [] { waits_for_semaphore([](auto* one) { return sem_clockwait(one, CLOCK_MONOTONIC, &kPast); }); }},
    {"join", joins},
    {"read", reads},
    {"write", writes},
    {"sleep", sleeps},
    {"futex", futex},
    {"raw", raw},
    {"fault", faults},
};

}  // namespace

int main(int argc, char** argv) {
  const auto found = argc == 2 ? kCases.find(argv[1]) : kCases.end();
  if (found == kCases.end()) {
    std::fputs("usage: bad_tick CASE, one of:\n", stderr);
    for (const auto& [name, work] : kCases) std::fprintf(stderr, "  %s\n", name.c_str());
    return 2;
  }
  found->second();
  return 0;
}
