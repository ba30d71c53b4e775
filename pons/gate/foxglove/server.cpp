#include "pons/gate/foxglove/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <boost/asio.hpp>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "pons/gate/foxglove/connection.hpp"
#include "pons/gate/questions.hpp"
#include "pons/task/json_text.hpp"

namespace pons::gate::foxglove {
namespace {

constexpr std::size_t kWarningsMost = 100;              // different ones; then it is silent
constexpr std::chrono::milliseconds kAcceptPause{100};  // when the process has no descriptor left
constexpr std::chrono::milliseconds kGoodbye{300};
constexpr std::string_view kFull =
    "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Type: text/plain\r\n\r\ntoo many connections\n";

// What the server knows of a channel outside of its thread.
struct Known {
  std::string topic, type;
  Keeps keeps;
  std::shared_ptr<std::atomic<int>> subscribers;
};

struct Put {
  std::size_t channel;
  Time logged;
  Payload message;
};

}  // namespace

class Server::Work final : public Host {
 public:
  explicit Work(ServerSettings settings) : settings_(std::move(settings)) {
    catalogue_.info = settings_.info;
    if (catalogue_.info.session.empty())
      catalogue_.info.session = fmt::format("{}", std::chrono::system_clock::now().time_since_epoch().count());
  }

  Expected<void> listen() {
    const auto refuse = [this](const Failure& failure) {
      const bool taken = failure == asio::error::address_in_use;
      return fail(taken ? "the port is taken" : failure.message(), "--foxglove " + text_of(settings_.address),
                  taken ? "name another port, or 0 for one that is free" : "name another address or port");
    };
    Failure failure;
    const tcp::endpoint endpoint(asio::ip::make_address(settings_.address.host, failure), settings_.address.port);
    if (!failure) (void)acceptor_.open(endpoint.protocol(), failure);
    if (!failure) (void)acceptor_.set_option(asio::socket_base::reuse_address(true), failure);
    if (!failure) (void)acceptor_.bind(endpoint, failure);
    if (!failure) (void)acceptor_.listen(asio::socket_base::max_listen_connections, failure);
    if (!failure) settings_.address.port = acceptor_.local_endpoint(failure).port();
    if (failure) return refuse(failure);
    return {};
  }

  void start() {
    accept();
    thread_ = std::thread([this] { io_.run(); });
  }

  void stop() {
    questions_.close();
    if (!thread_.joinable()) return;
    asio::post(io_, [this] { say_goodbye(); });
    thread_.join();
  }

  void put(std::size_t channel, Time now, std::span<const std::byte> message) {
    newest_ns_ = std::max(newest_ns_.load(), now.ns());  // of whoever shows something there is one thread
    if (wanted(channel)) {
      auto payload = std::make_shared<const std::vector<std::byte>>(message.begin(), message.end());
      const std::scoped_lock lock(mutex_);
      if (queued_bytes_ + message.size() > settings_.limits.queued_bytes) {
        ++catalogue_.dropped;
      } else {
        queued_bytes_ += message.size();
        queued_.push_back({channel, now, std::move(payload)});
      }
    } else if (catalogue_.clients == 0) {
      return;
    }
    wake();
  }

  Expected<std::size_t> add(Channel channel) {
    const auto same = std::ranges::find(known_, channel.topic, &Known::topic);
    if (same != known_.end() && same->type != channel.type)
      return fail(fmt::format("is {} here, not {}", same->type, channel.type), channel.topic, "give it another name");
    if (same != known_.end()) return static_cast<std::size_t>(same - known_.begin());
    const auto subscribers = std::make_shared<std::atomic<int>>(0);
    known_.push_back({channel.topic, channel.type, channel.keeps, subscribers});
    {
      const std::scoped_lock lock(mutex_);
      added_.emplace_back(std::move(channel), subscribers);
    }
    wake();
    return known_.size() - 1;
  }

  [[nodiscard]] bool wanted(std::size_t channel) const {
    return known_[channel].keeps == Keeps::kLast || *known_[channel].subscribers > 0;
  }

  Questions& questions() { return questions_; }

  std::vector<std::string> take_warnings() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(warnings_, {});
  }

  void serve(Service service, Serves serves) {
    catalogue_.services.push_back(std::move(service));
    serves_.push_back(std::move(serves));
  }
  [[nodiscard]] std::size_t clients() const { return catalogue_.clients; }
  [[nodiscard]] std::uint64_t dropped() const { return catalogue_.dropped; }

  // ---- for a connection ----

  [[nodiscard]] const ServerSettings& settings() const override { return settings_; }
  [[nodiscard]] bool has_room() const override { return catalogue_.clients < settings_.limits.clients; }

  std::unique_ptr<Session> session(std::uint64_t connection) override {
    auto session = std::make_unique<Session>(catalogue_, settings_.limits.session, [this, connection](Call call) {
      const auto answered = [this, connection, call = Call{call.service, call.id, call.encoding, {}}](
                                const Expected<std::vector<std::byte>>& response) {
        const auto found = connections_.find(connection);
        if (found == connections_.end() || found->second->session() == nullptr) return;
        found->second->session()->answer(call, response);
        found->second->write();
      };
      serves_[call.service](call.request, answered);
    });
    if (told_time_ > Time{}) session->show_time(told_time_);
    return session;
  }

  void warn(std::string line) override {
    line = task::excerpt(line, 600);
    const std::scoped_lock lock(mutex_);
    if (told_.size() < kWarningsMost && told_.insert(line).second) warnings_.push_back(std::move(line));
  }

  // Not at once: its own function is at work.
  void ended(std::uint64_t connection) override {
    asio::post(io_, [this, connection] {
      connections_.erase(connection);
      if (!acceptor_.is_open() && connections_.empty()) last_.cancel();
    });
  }

 private:
  void wake() {
    if (!scheduled_.exchange(true)) asio::post(io_, [this] { spread(); });
  }

  void accept() {
    acceptor_.async_accept([this](Failure failure, tcp::socket socket) {
      if (failure == asio::error::operation_aborted || !acceptor_.is_open()) return;
      if (failure) {
        pause_.expires_after(kAcceptPause);
        return pause_.async_wait([this](Failure aborted) {
          if (!aborted) accept();
        });
      }
      if (connections_.size() < settings_.limits.connections) {
        const std::uint64_t number = next_connection_++;
        const auto connection = std::make_shared<Connection>(*this, number, std::move(socket));
        connections_.emplace(number, connection);
        connection->begin();
      } else {
        warn(fmt::format("there are {} connections already: more are closed", connections_.size()));
        Failure ignored;
        (void)socket.non_blocking(true, ignored);
        (void)socket.write_some(asio::buffer(kFull), ignored);
      }
      accept();
    });
  }

  // What came to be shown, to all; under mutex_.
  void advertise() {
    const std::size_t first = catalogue_.channels.size();
    for (auto& [channel, subscribers] : added_) catalogue_.add(std::move(channel), std::move(subscribers));
    added_.clear();
    for (const auto& [number, connection] : connections_) {
      if (connection->session() != nullptr) connection->session()->advertise(first);
    }
  }

  // What was put, to all who have subscribed to it.
  void spread() {
    scheduled_ = false;
    std::deque<Put> queued;
    {
      const std::scoped_lock lock(mutex_);
      queued.swap(queued_);
      queued_bytes_ = 0;
      if (!added_.empty()) advertise();
    }
    const SteadyTime now = std::chrono::steady_clock::now();
    const Time newest{Duration(newest_ns_)};
    const bool tells_time = newest != told_time_ && now - time_at_ >= settings_.limits.time_every;
    if (tells_time) told_time_ = newest, time_at_ = now;
    for (Put& put : queued) {
      for (const auto& [number, connection] : connections_) {
        if (connection->session() != nullptr) connection->session()->show(put.channel, put.logged, put.message, now);
      }
      if (catalogue_.channels[put.channel].keeps == Keeps::kLast)
        catalogue_.last[put.channel] = {put.logged, std::move(put.message)};
    }
    for (const auto& [number, connection] : connections_) {
      if (tells_time && connection->session() != nullptr) connection->session()->show_time(newest);
      connection->write();
    }
  }

  void say_goodbye() {
    spread();
    Failure ignored;
    (void)acceptor_.close(ignored);
    pause_.cancel();
    for (const auto& [number, connection] : connections_) connection->goodbye();
    work_.reset();
    if (connections_.empty()) return;
    // Whoever does not answer is left.
    last_.expires_after(kGoodbye);
    last_.async_wait([this](Failure aborted) {
      if (!aborted) io_.stop();
    });
  }

  ServerSettings settings_;
  Catalogue catalogue_;
  std::vector<Serves> serves_;
  std::vector<Known> known_;  // of the thread of whoever shows something
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  tcp::acceptor acceptor_{io_};
  asio::steady_timer pause_{io_}, last_{io_};
  std::map<std::uint64_t, std::shared_ptr<Connection>> connections_;  // of the thread, as are:
  std::uint64_t next_connection_ = 0;
  Time told_time_;
  SteadyTime time_at_;
  Questions questions_{"Foxglove", settings_.limits.asked,
                       [this] { asio::post(io_, [this] { questions_.take_answers(); }); }};
  std::mutex mutex_;
  std::deque<Put> queued_;  // under mutex_, as are:
  std::vector<std::pair<Channel, std::shared_ptr<std::atomic<int>>>> added_;
  std::size_t queued_bytes_ = 0;
  std::vector<std::string> warnings_;
  std::set<std::string> told_;
  std::atomic<std::int64_t> newest_ns_ = 0;
  std::atomic<bool> scheduled_ = false;
  std::thread thread_;
};

Expected<std::unique_ptr<Server>> Server::listen(ServerSettings settings) {
  auto work = std::make_unique<Work>(std::move(settings));
  if (auto listening = work->listen(); !listening) return std::unexpected(listening.error());
  return std::unique_ptr<Server>(new Server(std::move(work)));
}

Server::Server(std::unique_ptr<Work> work) : work_(std::move(work)) {}

// Only memory that has run out would throw here. NOLINTNEXTLINE(bugprone-exception-escape)
Server::~Server() { work_->stop(); }

Expected<std::size_t> Server::add_channel(Channel channel) { return work_->add(std::move(channel)); }

void Server::add_service(Service service, Serves serves) { work_->serve(std::move(service), std::move(serves)); }

void Server::start() { work_->start(); }

const Address& Server::address() const { return work_->settings().address; }

bool Server::wanted(std::size_t channel) const { return work_->wanted(channel); }

void Server::put(std::size_t channel, Time now, std::span<const std::byte> message) {
  work_->put(channel, now, message);
}

std::size_t Server::clients() const { return work_->clients(); }

std::uint64_t Server::dropped() const { return work_->dropped(); }

std::vector<std::string> Server::take_warnings() { return work_->take_warnings(); }

std::vector<Request> Server::poll() { return work_->questions().poll(); }

void Server::ask(std::string request, std::function<void(const Json&)> answered) {
  work_->questions().ask(std::move(request), std::move(answered));
}

}  // namespace pons::gate::foxglove
