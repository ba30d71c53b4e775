#include "pons/gate/unix_address.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace pons::gate {

Expected<sockaddr_un> unix_address(const std::filesystem::path& path) {
  const std::string name = path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.empty() || name.size() >= sizeof address.sun_path) {
    return fail(fmt::format("a socket's path has 1 to {} bytes, this one {}", sizeof address.sun_path - 1, name.size()),
                name, "choose another path");
  }
  std::memcpy(address.sun_path, name.data(), name.size());
  return address;
}

Descriptor unix_socket() { return Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)); }

int connect_to(const Descriptor& socket, const sockaddr_un& address) {
  const auto* name = reinterpret_cast<const sockaddr*>(&address);
  return ::connect(socket.get(), name, sizeof address) == 0 ? 0 : errno;
}

}  // namespace pons::gate
