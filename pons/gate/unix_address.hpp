// Names of Unix-domain sockets, and a descriptor that closes itself.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "pons/core/error.hpp"

namespace pons::gate {

class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }

  [[nodiscard]] int get() const { return value_; }
  [[nodiscard]] explicit operator bool() const { return value_ >= 0; }

 private:
  int value_;
};

// Error: the path is empty or longer than the system takes (107 bytes).
[[nodiscard]] Expected<sockaddr_un> unix_address(const std::filesystem::path& path);

// A stream socket that does not block and is not inherited.
[[nodiscard]] Descriptor unix_socket();

// 0 or errno.
[[nodiscard]] int connect_to(const Descriptor& socket, const sockaddr_un& address);

}  // namespace pons::gate
