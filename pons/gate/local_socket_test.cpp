#include "pons/gate/local_socket.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <cstdlib>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <thread>

#include "pons/gate/line_server.hpp"
#include "pons/gate/unix_address.hpp"

namespace pons::gate {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

class LocalSocketTest : public testing::Test {
 protected:
  LocalSocketTest() {
    std::string name = (fs::temp_directory_path() / "pons-XXXXXX").string();
    EXPECT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    path_ = folder_ / "pons.sock";
  }
  ~LocalSocketTest() override { fs::remove_all(folder_); }

  std::unique_ptr<LocalSocket> listen(SocketLimits limits = {}) {
    auto socket = LocalSocket::listen(path_, limits);
    EXPECT_TRUE(socket) << socket.error().line();
    return socket ? std::move(*socket) : nullptr;
  }
  // What has come, once something has.
  static std::vector<Request> wait_for_requests(LocalSocket& socket) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < until) {
      auto requests = socket.poll();
      if (!requests.empty()) return requests;
      std::this_thread::yield();
    }
    ADD_FAILURE() << "nothing came";
    return {};
  }

  fs::path folder_, path_;
};

// A client that does what the test wants, good or bad.
class RawClient {
 public:
  explicit RawClient(const fs::path& path) : socket_(unix_socket()) {
    EXPECT_EQ(connect_to(socket_, unix_address(path).value()), 0);
  }
  // How much the other side took at once.
  std::size_t send(std::string_view text) const {
    const ssize_t sent = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL);
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }
  void end_sending() const { EXPECT_EQ(::shutdown(socket_.get(), SHUT_WR), 0); }
  [[nodiscard]] bool dropped() const {
    pollfd polled{socket_.get(), 0, 0};
    return ::poll(&polled, 1, 0) == 1 && (polled.revents & POLLHUP) != 0;
  }
  void wait_until_dropped() const {
    pollfd polled{socket_.get(), 0, 0};
    EXPECT_EQ(::poll(&polled, 1, 20'000), 1);
    EXPECT_NE(polled.revents & POLLHUP, 0);
  }
  // One line without its end; empty when the other side has closed.
  std::string line() {
    for (;;) {
      if (const auto end = text_.find('\n'); end != text_.npos) {
        std::string result = text_.substr(0, end);
        text_.erase(0, end + 1);
        return result;
      }
      pollfd polled{socket_.get(), POLLIN, 0};
      if (::poll(&polled, 1, 20'000) <= 0) {
        ADD_FAILURE() << "no line";
        return "";
      }
      char buffer[4096];
      const ssize_t got = ::recv(socket_.get(), buffer, sizeof buffer, 0);
      if (got <= 0) return "";
      text_.append(buffer, static_cast<std::size_t>(got));
    }
  }

 private:
  Descriptor socket_;
  std::string text_;
};

TEST_F(LocalSocketTest, AnswersARequest) {
  const auto socket = listen();
  Expected<Json> answer = fail("none");
  std::thread client([&] { answer = ask(path_, {{"op", "list"}}); });
  for (const Request& request : wait_for_requests(*socket)) {
    EXPECT_EQ(request.text, R"({"op":"list"})");
    request.reply({{"ok", true}});
    request.reply({{"ok", false}});
  }
  client.join();
  ASSERT_TRUE(answer) << answer.error().line();
  EXPECT_EQ(*answer, (Json{{"ok", true}}));
}

TEST_F(LocalSocketTest, KeepsEachClientsOrder) {
  const auto socket = listen();
  RawClient one(path_), two(path_);
  one.send("a\n\nb\r\nc");
  two.send("x\n");
  one.end_sending();
  std::string order;
  while (order.size() < 4) {
    for (const Request& request : wait_for_requests(*socket)) {
      order += request.text;
      request.reply(request.text);
    }
  }
  EXPECT_EQ(one.line(), "\"a\"");
  EXPECT_EQ(one.line(), "\"b\"");
  EXPECT_EQ(one.line(), "\"c\"");
  EXPECT_EQ(one.line(), "");
  EXPECT_EQ(two.line(), "\"x\"");
}

TEST_F(LocalSocketTest, OnlyTheOwnerMayConnectAndTheFileGoesWithIt) {
  auto socket = listen();
  struct stat status{};
  ASSERT_EQ(::lstat(path_.c_str(), &status), 0);
  EXPECT_TRUE(S_ISSOCK(status.st_mode));
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  socket.reset();
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(LocalSocketTest, ReplacesAStaleSocketOnly) {
  {
    const Descriptor stale = unix_socket();
    const sockaddr_un address = unix_address(path_).value();
    ASSERT_EQ(::bind(stale.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ASSERT_TRUE(fs::exists(path_));
  const auto socket = listen();
  EXPECT_EQ(LocalSocket::listen(path_).error().what, "this socket is in use");

  std::ofstream(folder_ / "file") << "x";
  EXPECT_EQ(LocalSocket::listen(folder_ / "file").error().what, "this file is not a socket");
  EXPECT_TRUE(fs::exists(folder_ / "file"));
  EXPECT_NE(LocalSocket::listen(folder_ / "none/pons.sock").error().what.find("No such file"), std::string::npos);
  EXPECT_NE(LocalSocket::listen(folder_ / std::string(200, 'x')).error().what.find("1 to 107 bytes"),
            std::string::npos);
}

TEST_F(LocalSocketTest, RefusesLongLines) {
  const auto socket = listen({.line_bytes = 100});
  RawClient exact(path_), above(path_), endless(path_);
  exact.send(std::string(100, 'a') + "\n");
  EXPECT_EQ(wait_for_requests(*socket).at(0).text.size(), 100u);
  const auto refuse = [&] {
    const std::vector<Request> requests = wait_for_requests(*socket);
    ASSERT_EQ(requests.size(), 1u);
    EXPECT_EQ(requests[0].text, std::string(100, 'a'));
    ASSERT_TRUE(requests[0].refused);
    EXPECT_EQ(requests[0].refused->line(), "a line has at most 100 bytes");
    requests[0].reply("no");
  };
  above.send(std::string(101, 'a') + "\nb\n");
  refuse();
  EXPECT_EQ(above.line(), "\"no\"");
  EXPECT_EQ(above.line(), "");
  endless.send(std::string(5000, 'a'));
  refuse();
  EXPECT_EQ(endless.line(), "\"no\"");
  EXPECT_EQ(endless.line(), "");
  EXPECT_TRUE(socket->poll().empty());
}

TEST_F(LocalSocketTest, RefusesOneClientTooManyUntilOneLeaves) {
  const auto socket = listen({.clients = 2});
  auto first = std::make_unique<RawClient>(path_);
  RawClient second(path_);
  RawClient third(path_);
  EXPECT_EQ(third.line(), R"({"error":"2 clients are connected already","ok":false})");
  first.reset();
  Expected<Json> answer = fail("none");
  // The server may see this one come before it sees the first one leave: then it is refused once more, and asks again.
  std::thread client([&] {
    for (int attempt = 0; attempt < 1000; ++attempt) {
      answer = ask(path_, "hello");
      if (answer && *answer == "hello") return;
    }
  });
  for (const Request& request : wait_for_requests(*socket)) request.reply("hello");
  client.join();
  ASSERT_TRUE(answer) << answer.error().line();
  EXPECT_EQ(*answer, "hello");
}

// Else one who sends and leaves, again and again, could have more waiting than anybody answers.
TEST_F(LocalSocketTest, WhoLeavesTakesTheirPlaceUntilTheyAreAnswered) {
  const auto socket = listen({.clients = 2});
  std::vector<Request> requests;
  for (int i = 0; i < 2; ++i) {
    RawClient(path_).send("a\n");
    std::ranges::move(wait_for_requests(*socket), std::back_inserter(requests));
  }
  EXPECT_EQ(RawClient(path_).line(), R"({"error":"2 clients are connected already","ok":false})");
  requests.at(0).reply("late");
  std::vector<Request> next;
  while (next.empty()) {
    const RawClient client(path_);  // refused until the server has seen the answer
    client.send("b\n");
    while (next.empty() && !client.dropped()) next = socket->poll();
  }
  EXPECT_EQ(next.at(0).text, "b");
}

TEST_F(LocalSocketTest, OfWhatWaitsStopsComeFirstAndTheRestInPortions) {
  Mailbox mailbox(Descriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)));
  const auto texts = [&mailbox] {
    std::vector<std::string> taken;
    for (const Line& line : mailbox.take_lines()) taken.push_back(line.text.substr(0, 20));
    return taken;
  };
  const std::string half(Portion::kBytes / 2, 'x'), more(2 * Portion::kBytes, 'y'), stop = R"({"op":"stop"})";
  for (const std::string& text : {half, half, std::string("z"), more, stop}) mailbox.deliver({{}, text});
  const std::string x(20, 'x'), y(20, 'y');
  EXPECT_EQ(texts(), (std::vector{stop, x, x}));
  EXPECT_EQ(texts(), std::vector<std::string>{"z"});
  EXPECT_EQ(texts(), std::vector{y}) << "alone, however large";
  EXPECT_EQ(texts(), std::vector<std::string>{});
  for (std::size_t i = 0; i <= Portion::kRequests; ++i) mailbox.deliver({{}, "s"});
  EXPECT_EQ(texts().size(), Portion::kRequests);
  EXPECT_EQ(texts().size(), 1u);
}

TEST_F(LocalSocketTest, WhoAsksWaitsForRoomAmongThoseThatConnect) {
  const auto address = unix_address(path_).value();
  const Descriptor listener = unix_socket();
  ASSERT_EQ(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener.get(), 0), 0);  // one may wait
  const RawClient before(path_);
  const auto late = ask(path_, {{"op", "stop"}}, milliseconds(20));
  ASSERT_FALSE(late);
  ASSERT_EQ(late.error().what, "no answer in time");
  Expected<Json> answer = fail("none");
  std::thread client([&] { answer = ask(path_, {{"op", "stop"}}); });
  std::vector<Descriptor> accepted;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (accepted.size() < 2 && std::chrono::steady_clock::now() < until) {
    Descriptor next(::accept(listener.get(), nullptr, nullptr));
    if (next) accepted.push_back(std::move(next));
  }
  if (accepted.size() == 2) {
    EXPECT_EQ(::send(accepted[1].get(), "{}\n", 3, MSG_NOSIGNAL), 3);
  }
  accepted.clear();
  client.join();
  ASSERT_TRUE(answer) << answer.error().line();
  EXPECT_EQ(*answer, Json::object());
}

TEST_F(LocalSocketTest, DropsAClientThatSendsHalfALine) {
  const auto socket = listen({.patience = milliseconds(50)});
  RawClient half(path_);
  half.send("{\"op\":");
  EXPECT_EQ(half.line(), "");
}

TEST_F(LocalSocketTest, DropsAClientThatDoesNotRead) {
  const auto socket = listen({.patience = milliseconds(50)});
  RawClient lazy(path_);
  lazy.send("a\n");
  wait_for_requests(*socket).at(0).reply(std::string(8'000'000, 'x'));
  lazy.wait_until_dropped();
  EXPECT_EQ(lazy.line(), "");
}

TEST_F(LocalSocketTest, AnswersThatAreTooLargeBecomeAnError) {
  const auto socket = listen({.reply_bytes = 1000});
  RawClient client(path_);
  client.send("a\n");
  wait_for_requests(*socket).at(0).reply(std::string(2000, 'x'));
  EXPECT_EQ(client.line(), R"({"error":"the answer has 2003 bytes, more than 1000","ok":false})");
}

TEST_F(LocalSocketTest, CarriesLargeAnswers) {
  const auto socket = listen();
  Expected<Json> answer = fail("none");
  std::thread client([&] { answer = ask(path_, "all"); });
  wait_for_requests(*socket).at(0).reply(std::string(10'000'000, 'x'));
  client.join();
  ASSERT_TRUE(answer) << answer.error().line();
  EXPECT_EQ(answer->get<std::string>().size(), 10'000'000u);
}

TEST_F(LocalSocketTest, AnAnswerToSomebodyGoneIsDropped) {
  auto socket = listen();
  std::vector<Request> requests;
  {
    const RawClient client(path_);
    client.send("a\n");
    requests = wait_for_requests(*socket);
  }
  requests.at(0).reply("late");
  socket.reset();
  requests.at(0).reply("later");
  EXPECT_EQ(ask(path_, "x").error().what, "nobody listens there");
}

TEST_F(LocalSocketTest, AskGivesUpInTime) {
  const auto socket = listen();
  EXPECT_EQ(ask(path_, "x", milliseconds(30)).error().what, "no answer in time");
  EXPECT_EQ(ask(folder_ / "none", "x").error().what, "nobody listens there");
}

TEST_F(LocalSocketTest, ServesManyAtOnce) {
  const auto socket = listen();
  std::vector<std::thread> threads;
  std::array<int, 8> right{};
  for (std::size_t i = 0; i < right.size(); ++i) {
    threads.emplace_back([this, i, &right] {
      for (int n = 0; n < 50; ++n) {
        const Json question{{"client", i}, {"n", n}};
        const auto answer = ask(path_, question);
        right[i] += answer && *answer == question ? 1 : 0;
      }
    });
  }
  for (int answered = 0; answered < 400;) {
    for (const Request& request : wait_for_requests(*socket)) {
      request.reply(Json::parse(request.text));
      ++answered;
    }
  }
  for (std::thread& thread : threads) thread.join();
  for (const int count : right) EXPECT_EQ(count, 50);
}

}  // namespace
}  // namespace pons::gate
