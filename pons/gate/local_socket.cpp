#include "pons/gate/local_socket.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <thread>

#include "pons/gate/line_server.hpp"
#include "pons/gate/unix_address.hpp"

namespace pons::gate {
namespace {

constexpr std::size_t kMaxAnswer = 64UL * 1024 * 1024;

// Makes room for a new socket at `path`, or says why not.
Expected<void> clear_stale(const std::filesystem::path& path, const sockaddr_un& address) {
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0) return {};
  if (!S_ISSOCK(status.st_mode)) return fail("this file is not a socket", path.string(), "choose another path");
  const int error = connect_to(unix_socket(), address);
  if (error != ECONNREFUSED) {
    return fail(error == EACCES ? "this socket belongs to another user" : "this socket is in use", path.string(),
                "end the program that listens on it, or choose another path");
  }
  if (::unlink(path.c_str()) == 0) return {};
  return fail(fmt::format("the stale socket cannot be removed: {}", std::strerror(errno)), path.string(), "remove it");
}

}  // namespace

std::string dump_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n'; }

struct LocalSocket::Server {
  std::filesystem::path path;
  struct stat file{};  // as we made it
  std::shared_ptr<Mailbox> mailbox;
  std::unique_ptr<LineServer> lines;
  std::thread thread;
};

Expected<std::unique_ptr<LocalSocket>> LocalSocket::listen(const std::filesystem::path& path, SocketLimits limits) {
  const auto address = unix_address(path);
  if (!address) return std::unexpected(address.error());
  if (auto clear = clear_stale(path, *address); !clear) return std::unexpected(clear.error());

  const auto refused = [&path](const char* doing) {
    const std::string why = std::strerror(errno);
    return fail(fmt::format("cannot {}: {}", doing, why), path.string(),
                "check that its folder exists and may be written");
  };
  Descriptor listener = unix_socket();
  if (!listener) return refused("make a socket");
  // On the socket, not on the file: there is no moment in which somebody else may connect.
  if (::fchmod(listener.get(), 0600) != 0) return refused("protect the socket");
  if (::bind(listener.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    return refused("make the socket's file");
  }
  auto server = std::make_unique<Server>();
  server->path = path;
  if (::lstat(path.c_str(), &server->file) != 0) return refused("see the socket's file");
  Descriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake || ::listen(listener.get(), 16) != 0) return refused("listen");
  server->mailbox = std::make_shared<Mailbox>(std::move(wake));
  server->lines = std::make_unique<LineServer>(std::move(listener), limits, server->mailbox);
  server->thread = std::thread([lines = server->lines.get()] { lines->run(); });
  return std::unique_ptr<LocalSocket>(new LocalSocket(std::move(server)));
}

LocalSocket::LocalSocket(std::unique_ptr<Server> server) : server_(std::move(server)) {}

LocalSocket::~LocalSocket() {
  server_->lines->stop();
  server_->thread.join();
  // Somebody may have put another socket there meanwhile.
  struct stat status{};
  const bool ours = ::lstat(server_->path.c_str(), &status) == 0 && status.st_ino == server_->file.st_ino &&
                    status.st_dev == server_->file.st_dev;
  if (ours) (void)::unlink(server_->path.c_str());
}

std::vector<Request> LocalSocket::poll() {
  std::vector<Request> requests;
  for (Line& line : server_->mailbox->take_lines()) {
    requests.push_back({std::move(line.text),
                        [mailbox = server_->mailbox, name = line.name](const Json& answer) {
                          mailbox->answer(name, dump_line(answer));
                        },
                        std::move(line.refused)});
  }
  return requests;
}

// ---- the other end ----

namespace {

using Clock = std::chrono::steady_clock;

// False when the time is over.
bool wait_for(const Descriptor& socket, short events, Clock::time_point until) {
  for (;;) {
    const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
    if (rest < 0) return false;
    pollfd polled{socket.get(), events, 0};
    const int ready = ::poll(&polled, 1, static_cast<int>(rest) + 1);
    if (ready > 0) return true;
    if (ready == 0 || errno != EINTR) return false;
  }
}

// 0 or errno; EAGAIN once the time is over and as many as the other side lets wait still wait before us.
int connect_until(const Descriptor& socket, const sockaddr_un& address, Clock::time_point until) {
  for (;;) {
    const int error = connect_to(socket, address);
    if (error != EAGAIN || Clock::now() >= until) return error;
    (void)::poll(nullptr, 0, 1);  // the kernel tells nobody when there is room
  }
}

std::unexpected<Error> gone(const std::filesystem::path& path) {
  return fail("the connection ended before the answer", path.string(), "see whether the run still goes on");
}

std::unexpected<Error> silent(const std::filesystem::path& path) {
  return fail("no answer in time", path.string(), "see whether the run still goes on");
}

Expected<void> send_all(const Descriptor& socket, std::string_view text, Clock::time_point until,
                        const std::filesystem::path& path) {
  while (!text.empty()) {
    if (!wait_for(socket, POLLOUT, until)) return silent(path);
    const ssize_t sent = ::send(socket.get(), text.data(), text.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      text.remove_prefix(static_cast<std::size_t>(sent));
    } else if (errno != EAGAIN && errno != EINTR) {
      // It may have told us why before it closed: read on.
      return {};
    }
  }
  return {};
}

Expected<std::string> receive_line(const Descriptor& socket, Clock::time_point until,
                                   const std::filesystem::path& path) {
  std::string text;
  std::array<char, 16UL * 1024> buffer;
  while (text.size() <= kMaxAnswer) {
    if (!wait_for(socket, POLLIN, until)) return silent(path);
    const ssize_t got = ::recv(socket.get(), buffer.data(), buffer.size(), 0);
    if (got == 0) return gone(path);
    if (got < 0) {
      if (errno == EAGAIN || errno == EINTR) continue;
      return gone(path);
    }
    const std::size_t before = text.size();
    text.append(buffer.data(), static_cast<std::size_t>(got));
    if (const auto end = text.find('\n', before); end != text.npos) return text.substr(0, end);
  }
  return fail("the answer has no end", path.string(), "see who listens there");
}

}  // namespace

Expected<Json> ask(const std::filesystem::path& path, const Json& request, std::chrono::milliseconds patience) {
  const auto address = unix_address(path);
  if (!address) return std::unexpected(address.error());
  const auto until = Clock::now() + patience;
  const Descriptor socket = unix_socket();
  if (!socket) return fail("no descriptor left", path.string(), "raise the limit on open files");
  if (const int error = connect_until(socket, *address, until); error != 0) {
    if (error == EAGAIN) return silent(path);
    const bool nobody = error == ENOENT || error == ECONNREFUSED || error == ENOTSOCK;
    return fail(nobody ? std::string("nobody listens there") : fmt::format("cannot connect: {}", std::strerror(error)),
                path.string(), "start a run, or name the socket of the one that goes on");
  }
  if (auto sent = send_all(socket, dump_line(request), until, path); !sent) return std::unexpected(sent.error());
  const auto line = receive_line(socket, until, path);
  if (!line) return std::unexpected(line.error());
  Json answer = Json::parse(*line, nullptr, false);
  if (answer.is_discarded()) return fail("the answer is not JSON", path.string(), "see who listens there");
  return answer;
}

}  // namespace pons::gate
