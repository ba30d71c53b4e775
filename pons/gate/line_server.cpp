#include "pons/gate/line_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "pons/gate/request.hpp"

namespace pons::gate {
namespace {

// When the process has no descriptor left, asking again at once would only spin.
constexpr std::chrono::milliseconds kAcceptPause{100};

std::string refusal_line(std::string_view why) { return Json{{"ok", false}, {"error", why}}.dump() + '\n'; }

bool would_block(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

void Mailbox::deliver(Line line) {
  const bool stops = !line.refused && asks_to_stop(line.text);
  const std::scoped_lock lock(mutex_);
  if (stops) {
    stops_.push_back(std::move(line));
  } else {
    lines_.push_back(std::move(line));
  }
}

std::vector<Line> Mailbox::take_lines() {
  const std::scoped_lock lock(mutex_);
  std::vector<Line> taken = std::exchange(stops_, {});
  for (Portion portion; !lines_.empty() && portion.takes(lines_.front().text.size()); lines_.pop_front())
    taken.push_back(std::move(lines_.front()));
  return taken;
}

void Mailbox::answer(LineName name, std::string text) {
  {
    const std::scoped_lock lock(mutex_);
    answers_.emplace_back(name, std::move(text));
  }
  wake();
}

std::vector<std::pair<LineName, std::string>> Mailbox::take_answers() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(answers_, {});
}

void Mailbox::wake() const { (void)::eventfd_write(wake_.get(), 1); }

void Mailbox::sleep_no_more() const {
  eventfd_t count = 0;
  (void)::eventfd_read(wake_.get(), &count);
}

LineServer::LineServer(Descriptor listener, SocketLimits limits, std::shared_ptr<Mailbox> mailbox)
    : listener_(std::move(listener)), limits_(limits), mailbox_(std::move(mailbox)) {}

void LineServer::stop() {
  stop_ = true;
  mailbox_->wake();
}

void LineServer::run() {
  while (!stop_) {
    wait(Clock::now());
    if (stop_) return;
    const auto now = Clock::now();
    take_answers();
    for (auto client = clients_.begin(); client != clients_.end();) {
      const auto events = events_.find(client->first);
      const bool stays = serve(client->first, client->second, events == events_.end() ? short{0} : events->second, now);
      client = stays ? std::next(client) : clients_.erase(client);
    }
    if (knocking_) accept_clients(now);
  }
}

void LineServer::wait(Clock::time_point now) {
  std::vector<pollfd> polled{{mailbox_->descriptor(), POLLIN, 0}};
  std::vector<std::uint64_t> ids;
  std::optional<Clock::time_point> until = accept_after_;
  for (const auto& [id, client] : clients_) {
    short wanted = 0;
    if (!client.out.empty()) wanted = POLLOUT;
    if (client.out.empty() && !client.waiting && !client.ended) wanted = POLLIN;
    polled.push_back({client.gone ? -1 : client.socket.get(), wanted, 0});
    ids.push_back(id);
    if (client.since)
      until = std::min(until.value_or(*client.since + limits_.patience), *client.since + limits_.patience);
  }
  if (!accept_after_) polled.push_back({listener_.get(), POLLIN, 0});

  int timeout_ms = -1;
  if (until) {
    // One more than the rest, so that it has passed when the call returns.
    const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(*until - now).count() + 1;
    timeout_ms = static_cast<int>(std::clamp<std::int64_t>(rest, 0, 60'000));
  }
  const int ready = ::poll(polled.data(), polled.size(), timeout_ms);
  events_.clear();
  knocking_ = false;
  if (accept_after_ && Clock::now() >= *accept_after_) accept_after_.reset();
  if (ready <= 0) return;
  if (polled[0].revents != 0) mailbox_->sleep_no_more();
  for (std::size_t i = 0; i < ids.size(); ++i) events_[ids[i]] = polled[i + 1].revents;
  if (polled.size() > ids.size() + 1) knocking_ = polled.back().revents != 0;
}

void LineServer::accept_clients(Clock::time_point now) {
  for (;;) {
    Descriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) accept_after_ = now + kAcceptPause;
      return;
    }
    if (clients_.size() >= limits_.clients) {
      const std::string line = refusal_line(fmt::format("{} clients are connected already", clients_.size()));
      (void)::send(socket.get(), line.data(), line.size(), MSG_NOSIGNAL);
      continue;
    }
    Client client;
    client.socket = std::move(socket);
    clients_.emplace(next_client_++, std::move(client));
  }
}

void LineServer::take_answers() {
  for (auto& [name, text] : mailbox_->take_answers()) {
    const auto found = clients_.find(name.client);
    if (found == clients_.end()) continue;
    Client& client = found->second;
    if (!client.waiting || client.line != name.line) continue;
    client.waiting = false;
    if (text.size() > limits_.reply_bytes) {
      refuse(client, fmt::format("the answer has {} bytes, more than {}", text.size(), limits_.reply_bytes));
    } else {
      client.out += text;
    }
  }
}

bool LineServer::serve(std::uint64_t id, Client& client, short events, Clock::time_point now) {
  // Altogether, with nothing left to read: nobody will take an answer.
  client.gone |= (events & (POLLERR | POLLNVAL)) != 0 || ((events & POLLHUP) != 0 && (events & POLLIN) == 0);
  if (client.gone) return client.waiting;
  const std::size_t before = client.in.size() + client.out.size();
  if ((events & POLLIN) != 0 && !read(client)) return false;
  if (!client.out.empty() && !write(client)) return false;
  if (client.out.empty()) {
    if (!client.closing && !client.waiting) deliver_line(id, client);
    if ((client.closing || client.ended) && !client.waiting && client.out.empty()) return false;
  }
  // Half a line gets its patience from its first byte on, an answer from its last progress on.
  const bool owes = !client.out.empty() || (!client.waiting && !client.in.empty());
  if (!owes) {
    client.since.reset();
  } else if (!client.since || (!client.out.empty() && client.in.size() + client.out.size() != before)) {
    client.since = now;
  }
  return !client.since || now - *client.since < limits_.patience;
}

bool LineServer::read(Client& client) {
  std::array<char, 16 * 1024> buffer;
  const ssize_t got = ::recv(client.socket.get(), buffer.data(), buffer.size(), 0);
  if (got < 0) return would_block(errno);
  if (got == 0) {
    client.ended = true;
    // A last line without its end is a line.
    if (!client.in.empty() && client.in.back() != '\n') client.in += '\n';
    return true;
  }
  client.in.append(buffer.data(), static_cast<std::size_t>(got));
  return true;
}

bool LineServer::write(Client& client) {
  const ssize_t sent = ::send(client.socket.get(), client.out.data(), client.out.size(), MSG_NOSIGNAL);
  if (sent < 0) return would_block(errno);
  client.out.erase(0, static_cast<std::size_t>(sent));
  return true;
}

void LineServer::deliver_line(std::uint64_t id, Client& client) {
  for (;;) {
    const std::size_t end = client.in.find('\n');
    if (std::min(end, client.in.size()) > limits_.line_bytes) {
      client.closing = true;
      client.waiting = true;
      client.in.resize(limits_.line_bytes);
      mailbox_->deliver({{id, ++client.line},
                         std::exchange(client.in, {}),
                         Error{fmt::format("a line has at most {} bytes", limits_.line_bytes), {}, {}}});
      return;
    }
    if (end == std::string::npos) return;
    std::string line = client.in.substr(0, end);
    client.in.erase(0, end + 1);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    client.waiting = true;
    mailbox_->deliver({{id, ++client.line}, std::move(line)});
    return;
  }
}

void LineServer::refuse(Client& client, std::string_view why) {
  client.out += refusal_line(why);
  client.in.clear();
  client.closing = true;
  (void)write(client);
}

}  // namespace pons::gate
