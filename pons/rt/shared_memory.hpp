// One object that two processes share under a name: the owner makes it, one user at a time opens it, and each can see
// whether the other lives.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>

#include "pons/core/error.hpp"

namespace pons::rt {

// The memory itself. An object appears under its name only when it is whole: whoever opens the name sees all of it or
// nothing. It disappears with its owner; a user that has it open keeps its pages. Locks of the operating system tell
// who lives: they go with their process, however it ends. No thread may wait in it, so no lock is needed inside a tick.
class SharedMemory {
 public:
  // What must be equal on both sides; else the other is of another version.
  struct Layout {
    std::size_t bytes = 0;
    std::uint64_t version = 0;  // changes whenever the meaning of the bytes does
  };
  enum class Role : std::uint8_t { kOwner, kUser };

  SharedMemory() = default;
  SharedMemory(SharedMemory&& other) noexcept { swap(other); }
  SharedMemory& operator=(SharedMemory&& other) noexcept {
    swap(other);
    return *this;
  }
  ~SharedMemory();

  // Zeroed memory that nobody sees before publish(). Names hold letters, digits, '-', '_' and '.'.
  // Errors: a bad name, a living owner of that name, another user's, no room. Of two that make one name at the same
  // moment, one is seen; the other's publish() may fail.
  [[nodiscard]] static Expected<SharedMemory> make(const std::string& name, const Layout& layout);
  // The owner, once, when the object in it is whole.
  [[nodiscard]] Expected<void> publish();
  // Errors: a bad name, nobody owns it, its owner has died, another process uses it, it belongs to another user, is of
  // another version, or not whole.
  [[nodiscard]] static Expected<SharedMemory> open(const std::string& name, const Layout& layout);

  // Error: a bad name.
  [[nodiscard]] static Expected<void> check_name(const std::string& name);
  // Whether a living owner has published something under that name: open() may still refuse it.
  [[nodiscard]] static bool is_owned(const std::string& name);

  [[nodiscard]] std::byte* data() const { return bytes_; }
  // Whether the other side lives and has it open. A system call: not inside a tick.
  [[nodiscard]] bool other_lives() const;

 private:
  void swap(SharedMemory& other) noexcept;

  Role role_ = Role::kUser;
  std::string name_;
  int file_ = -1;
  std::size_t mapped_ = 0;
  std::byte* bytes_ = nullptr;
};

// T in shared memory, made by its owner. T holds no pointer into its own process and needs no destructor; T::kVersion
// changes whenever its meaning does.
template <typename T>
class Shared {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  // The object is made from `arguments` before anybody sees it.
  template <typename... Arguments>
  [[nodiscard]] static Expected<Shared> make(const std::string& name, const Arguments&... arguments) {
    auto memory = SharedMemory::make(name, layout());
    if (!memory) return std::unexpected(memory.error());
    Shared shared(std::move(*memory), nullptr);
    shared.object_ = std::construct_at(reinterpret_cast<T*>(shared.memory_.data()), arguments...);
    if (auto published = shared.memory_.publish(); !published) return std::unexpected(published.error());
    return shared;
  }
  [[nodiscard]] static Expected<Shared> open(const std::string& name) {
    auto memory = SharedMemory::open(name, layout());
    if (!memory) return std::unexpected(memory.error());
    T* object = reinterpret_cast<T*>(memory->data());
    return Shared(std::move(*memory), object);
  }

  [[nodiscard]] T& operator*() const { return *object_; }
  [[nodiscard]] T* operator->() const { return object_; }
  [[nodiscard]] bool other_lives() const { return memory_.other_lives(); }

 private:
  Shared(SharedMemory memory, T* object) : memory_(std::move(memory)), object_(object) {}
  static SharedMemory::Layout layout() { return {sizeof(T), T::kVersion}; }

  SharedMemory memory_;
  T* object_;
};

}  // namespace pons::rt
