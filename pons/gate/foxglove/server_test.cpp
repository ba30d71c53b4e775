// Over real sockets, with clients of Boost.Beast's and plain ones.
#include "pons/gate/foxglove/server.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <string>
#include <thread>

namespace pons::gate::foxglove {
namespace {

using namespace std::chrono_literals;
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr auto kLongEnough = 20s;

std::vector<std::byte> bytes(std::string_view text) {
  const auto all = std::as_bytes(std::span(text));
  return {all.begin(), all.end()};
}

// Of one thread: each call waits for its end.
class Client {
 public:
  // That many bytes wait at its end, and the others at the server's.
  explicit Client(const Server& server, int buffer = 1 << 20)
      : at_(asio::ip::make_address(server.address().host), server.address().port), socket_(io_) {
    beast::get_lowest_layer(socket_).expires_after(kLongEnough);
    beast::get_lowest_layer(socket_).socket().open(tcp::v4());
    beast::get_lowest_layer(socket_).socket().set_option(asio::socket_base::receive_buffer_size(buffer));
    beast::get_lowest_layer(socket_).async_connect(at_, [this](auto failure) { finish(failure); });
    run();
  }

  // "" or why not; the HTTP status where it is told.
  std::string join(const std::string& subprotocols = "foxglove.sdk.v1", const std::string& origin = {}) {
    websocket::response_type response;
    socket_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      if (!subprotocols.empty()) request.set(beast::http::field::sec_websocket_protocol, subprotocols);
      if (!origin.empty()) request.set(beast::http::field::origin, origin);
    }));
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(websocket::stream_base::timeout{kLongEnough, websocket::stream_base::none(), false});
    socket_.async_handshake(response, "localhost", "/", [this](auto failure) { finish(failure); });
    run();
    subprotocol_ = response[beast::http::field::sec_websocket_protocol];
    if (!failure_) return {};
    return fmt::format("{} {}", response.result_int(), std::string_view(response.body()));
  }

  void say(std::string_view text) { write(text, true); }
  void say_binary(std::string_view text) { write(text, false); }

  // The next message: JSON as text, binary as is; "closed CODE REASON" when there is none.
  std::string hear() {
    beast::flat_buffer buffer;
    socket_.async_read(buffer, [this](auto failure, std::size_t) { finish(failure); });
    run();
    if (failure_ == websocket::error::closed)
      return fmt::format("closed {} {}", socket_.reason().code, std::string_view(socket_.reason().reason));
    if (failure_) return "failed: " + failure_.message();
    return beast::buffers_to_string(buffer.cdata());
  }
  // The first that begins so.
  std::string hear(std::string_view begin) {
    for (;;) {
      std::string heard = hear();
      if (heard.starts_with(begin) || heard.starts_with("closed") || heard.starts_with("failed")) return heard;
    }
  }

  void write_raw(std::string_view text) {
    asio::write(beast::get_lowest_layer(socket_).socket(), asio::buffer(text), failure_);
  }
  std::string read_raw() {
    std::string text;
    asio::read(beast::get_lowest_layer(socket_).socket(), asio::dynamic_buffer(text), failure_);
    return text;
  }
  void ping() {
    socket_.async_ping("hello", [this](auto failure) { finish(failure); });
    run();
  }
  void on_pong(const std::function<void()>& pong) {
    socket_.control_callback([pong](websocket::frame_type kind, beast::string_view payload) {
      if (kind == websocket::frame_type::pong && payload == "hello") pong();
    });
  }
  [[nodiscard]] const std::string& subprotocol() const { return subprotocol_; }
  [[nodiscard]] beast::error_code failure() const { return failure_; }

 private:
  void write(std::string_view text, bool is_text) {
    socket_.text(is_text);
    socket_.async_write(asio::buffer(text), [this](auto failure, std::size_t) { finish(failure); });
    run();
  }
  void finish(beast::error_code failure) {
    failure_ = failure;
    finished_ = true;
  }
  void run() {
    io_.restart();
    const auto until = std::chrono::steady_clock::now() + kLongEnough;
    for (finished_ = false; !finished_;) {
      if (io_.run_one_until(until) > 0) continue;
      ADD_FAILURE() << "nothing came";
      beast::get_lowest_layer(socket_).socket().close();
      return;
    }
  }

  tcp::endpoint at_;
  asio::io_context io_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::error_code failure_;
  bool finished_ = false;
  std::string subprotocol_;
};

class FoxgloveServer : public ::testing::Test {
 protected:
  void begin(const ServerLimits& limits = {}) {
    auto server =
        Server::listen({.address = {"127.0.0.1", 0}, .info = {"pons", "1", {}}, .origins = {}, .limits = limits});
    ASSERT_TRUE(server) << server.error().line();
    server_ = std::move(*server);
    a_ = *server_->add_channel({"/a", "std_msgs/msg/String", "string data"});
    kept_ = *server_->add_channel({"/kept", "std_msgs/msg/String", "string data", Keeps::kLast});
    server_->add_service(
        {"/echo", "a/srv/A", {}, {}}, [this](std::span<const std::byte> request, Server::Answered answered) {
          server_->ask(
              std::string(reinterpret_cast<const char*>(request.data()), request.size()),
              [answered = std::move(answered)](const Json& answer) { answered(bytes(answer.get<std::string>())); });
        });
    server_->put(kept_, Time(Duration(3)), bytes("robot"));
    server_->start();
  }
  std::unique_ptr<Client> joined(int buffer = 1 << 20) {
    auto client = std::make_unique<Client>(*server_, buffer);
    EXPECT_EQ(client->join(), "");
    EXPECT_THAT(client->hear(), HasSubstr("serverInfo"));
    EXPECT_THAT(client->hear(), AllOf(HasSubstr("/a"), HasSubstr("/kept")));
    EXPECT_THAT(client->hear(), HasSubstr("/echo"));
    return client;
  }
  // Until it is so; its thread has its own time.
  template <typename Condition>
  static void await(const Condition& condition) {
    const auto until = std::chrono::steady_clock::now() + kLongEnough;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) return ADD_FAILURE() << "it did not come to be so";
      std::this_thread::yield();
    }
  }
  std::vector<std::string> warnings(std::size_t count) {
    std::vector<std::string> all;
    await([&] {
      std::ranges::move(server_->take_warnings(), std::back_inserter(all));
      return all.size() >= count;
    });
    return all;
  }
  std::unique_ptr<Server> server_;
  std::size_t a_ = 0, kept_ = 0;
};

constexpr std::string_view kSubscribe =
    R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":0},{"id":2,"channelId":1}]})";
// Of subscription 1 or 2, as they begin.
constexpr std::string_view kOfA("\1\1", 2), kOfKept("\1\2", 2);

TEST_F(FoxgloveServer, SendsWhatIsPutToWhoSubscribed) {
  begin({.time_every = 0ms});
  EXPECT_FALSE(server_->wanted(a_));
  EXPECT_TRUE(server_->wanted(kept_));
  const auto first = joined(), second = joined();
  EXPECT_EQ(first->subprotocol(), "foxglove.sdk.v1");
  EXPECT_EQ(server_->clients(), 2U);
  first->say(kSubscribe);
  // What was put before anybody came.
  EXPECT_EQ(first->hear(kOfKept), std::string_view("\1\2\0\0\0\3\0\0\0\0\0\0\0robot", 18));
  EXPECT_TRUE(server_->wanted(a_));
  server_->put(a_, Time(Duration(4)), bytes("text"));
  EXPECT_EQ(first->hear(std::string("\2\4")), std::string_view("\2\4\0\0\0\0\0\0\0", 9));
  EXPECT_EQ(first->hear(kOfA), std::string_view("\1\1\0\0\0\4\0\0\0\0\0\0\0text", 17));
  // Of an earlier time than what was told ahead: the time does not go back.
  server_->put(a_, Time(Duration(2)), bytes("late"));
  EXPECT_EQ(first->hear(), std::string_view("\1\1\0\0\0\2\0\0\0\0\0\0\0late", 17));
  EXPECT_EQ(second->hear(), std::string_view("\2\3\0\0\0\0\0\0\0", 9));  // as it came
  EXPECT_EQ(second->hear(), std::string_view("\2\4\0\0\0\0\0\0\0", 9));
  first->say(R"({"op":"unsubscribe","subscriptionIds":[1,2]})");
  await([&] { return !server_->wanted(a_); });
}

TEST_F(FoxgloveServer, TellsOfChannelsThatComeLater) {
  begin();
  const auto client = joined();
  const auto later = server_->add_channel({"/later", "std_msgs/msg/String", "string data", Keeps::kLast});
  ASSERT_TRUE(later);
  server_->put(*later, Time(Duration(5)), bytes("news"));
  EXPECT_THAT(client->hear("{"), AllOf(HasSubstr("advertise"), HasSubstr("/later")));
  client->say(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]})");
  EXPECT_THAT(client->hear(kOfA), HasSubstr("news"));
}

TEST_F(FoxgloveServer, OneTopicHasOneType) {
  begin();
  EXPECT_EQ(server_->add_channel({"/a", "std_msgs/msg/String", "string data"}), a_);
  const auto other = server_->add_channel({"/a", "std_msgs/msg/Header", ""});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().line(), HasSubstr("/a: is std_msgs/msg/String here, not std_msgs/msg/Header"));
}

TEST_F(FoxgloveServer, APortThatIsTakenIsNamed) {
  begin();
  const auto second = Server::listen({.address = server_->address(), .info = {}, .origins = {}, .limits = {}});
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().line(), AllOf(HasSubstr("the port is taken"), HasSubstr(text_of(server_->address()))));
  const auto others = Server::listen({.address = {"192.0.2.1", 0}, .info = {}, .origins = {}, .limits = {}});
  ASSERT_FALSE(others);
  EXPECT_THAT(others.error().line(), HasSubstr("192.0.2.1"));
}

TEST_F(FoxgloveServer, RefusesByName) {
  begin();
  EXPECT_THAT(Client(*server_).join(""), AllOf(HasSubstr("400"), HasSubstr("offer foxglove.sdk.v1")));
  EXPECT_THAT(Client(*server_).join("rosbridge"), AllOf(HasSubstr("400"), HasSubstr("'rosbridge'")));
  EXPECT_THAT(Client(*server_).join("foxglove.sdk.v1", "https://evil.example"),
              AllOf(HasSubstr("403"), HasSubstr("https://evil.example")));
  EXPECT_EQ(Client(*server_).join("foxglove.websocket.v1", "http://localhost:8080"), "");
  const auto raw = [&](const std::string& text) {
    Client client(*server_);
    client.write_raw(text);
    return client.read_raw();
  };
  EXPECT_THAT(raw("GET / HTTP/1.1\r\nHost: a\r\n\r\n"), AllOf(HasSubstr("426"), HasSubstr("open it in Foxglove")));
  EXPECT_THAT(raw("\x16\x03\x01 hello\r\n\r\n"), AllOf(HasSubstr("400"), HasSubstr("does not speak HTTP")));
  EXPECT_THAT(raw("GET / HTTP/1.1\r\nA: " + std::string(10'000, 'x') + "\r\n\r\n"), HasSubstr("400"));
  EXPECT_THAT(raw("POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello"), HasSubstr("400"));
  EXPECT_GE(warnings(7).size(), 7U);
  EXPECT_EQ(server_->clients(), 0U);
}

TEST_F(FoxgloveServer, AHalfHandshakeIsEnded) {
  begin({.handshake = 50ms});
  Client half(*server_), silent(*server_);
  half.write_raw("GET / HT");
  EXPECT_EQ(half.read_raw(), "");
  EXPECT_EQ(silent.read_raw(), "");
}

TEST_F(FoxgloveServer, AThousandConnectionsLeaveItAsItWas) {
  begin({.clients = 2, .connections = 10, .handshake = 300ms});
  const auto first = joined();
  std::vector<std::unique_ptr<Client>> many;
  for (int i = 0; i < 1000; ++i) many.push_back(std::make_unique<Client>(*server_));
  EXPECT_THAT(warnings(1), ElementsAre(HasSubstr("10 connections already")));
  many.clear();
  std::unique_ptr<Client> second;
  await([&] {
    second = std::make_unique<Client>(*server_);
    return second->join().empty();
  });
  await([&] { return server_->clients() == 2; });
  EXPECT_THAT(Client(*server_).join(), AllOf(HasSubstr("503"), HasSubstr("2 viewers are connected already")));
  first->say(kSubscribe);
  EXPECT_THAT(first->hear(kOfKept), HasSubstr("robot"));
}

TEST_F(FoxgloveServer, WhatIsTooLongOrNoFrameEndsAConnection) {
  begin({.said_bytes = 1000});
  const auto first = joined(), second = joined(), third = joined();
  first->say(std::string(1001, ' '));
  EXPECT_THAT(first->hear("closed"), HasSubstr("closed 1009"));
  // A frame that says that it has 2^62 bytes; one that is not masked.
  second->write_raw(std::string_view("\x82\xff\x40\0\0\0\0\0\0\0abcd", 14));
  EXPECT_THAT(second->hear("closed"), HasSubstr("closed 1009"));
  third->write_raw(std::string_view("\x81\5hello", 7));
  EXPECT_THAT(third->hear("closed"), HasSubstr("closed 1002"));
  EXPECT_THAT(warnings(1), ElementsAre(HasSubstr("more than 1000 bytes")));
  await([&] { return server_->clients() == 0; });
}

TEST_F(FoxgloveServer, TellsWhatIsWrongAndAnswersPings) {
  begin();
  const auto client = joined();
  client->say("hello");
  EXPECT_THAT(client->hear("{"), AllOf(HasSubstr("status"), HasSubstr("JSON")));
  client->say_binary("\7");
  EXPECT_THAT(client->hear("{"), HasSubstr("7 is no operation"));
  bool answered = false;
  client->on_pong([&] { answered = true; });
  client->ping();
  client->say("once more");
  (void)client->hear("{");
  EXPECT_TRUE(answered);
}

TEST_F(FoxgloveServer, ASlowClientMissesTheOldestAndIsTold) {
  begin({.session = {.queued_bytes = 1'000'000}});
  const auto slow = joined(1 << 16), quick = joined();
  slow->say(kSubscribe);
  EXPECT_THAT(slow->hear(kOfKept), HasSubstr("robot"));
  quick->say(kSubscribe);
  EXPECT_THAT(quick->hear(kOfKept), HasSubstr("robot"));
  const std::string large(100'000, 'x');
  int put = 0;
  std::uint64_t dropped = 0;
  await([&] {
    // The quick one has each before the next is put.
    ++put;
    server_->put(a_, Time(Duration(put)), bytes(fmt::format("{:06}{}", put, large)));
    EXPECT_EQ(quick->hear(kOfA).substr(13, 6), fmt::format("{:06}", put));
    dropped = server_->dropped();
    return dropped >= 20;
  });
  std::string told, last;
  int heard = 0;
  while (last != fmt::format("{:06}", put)) {
    const std::string text = slow->hear();
    ASSERT_FALSE(text.starts_with("failed") || text.starts_with("closed")) << text;
    if (text.starts_with("{") && told.empty()) told = text;
    if (!text.starts_with(kOfA)) continue;
    EXPECT_GT(text.substr(13, 6), last);
    last = text.substr(13, 6);
    ++heard;
  }
  EXPECT_THAT(told, AllOf(HasSubstr("\"level\":1"), HasSubstr("of /a; subscribe to fewer topics")));
  EXPECT_EQ(static_cast<std::uint64_t>(heard) + server_->dropped(), static_cast<std::uint64_t>(put));
}

TEST_F(FoxgloveServer, WhoDoesNotAnswerAPingHasGone) {
  begin({.idle = 100ms});
  const auto client = joined();
  EXPECT_EQ(server_->clients(), 1U);
  await([&] { return server_->clients() == 0; });
}

TEST_F(FoxgloveServer, WhatIsAskedIsAnsweredByWhoPolls) {
  begin();
  const auto client = joined();
  client->say_binary(std::string_view("\2\0\0\0\0\7\0\0\0\3\0\0\0cdrhow", 19));
  std::vector<Request> asked;
  await([&] {
    std::ranges::move(server_->poll(), std::back_inserter(asked));
    return !asked.empty();
  });
  EXPECT_EQ(asked[0].text, "how");
  asked[0].reply("well");
  EXPECT_EQ(client->hear("\3"), std::string_view("\3\0\0\0\0\7\0\0\0\3\0\0\0cdrwell", 20));
  // Who asked has gone, or the server has: nobody minds.
  client->say_binary(std::string_view("\2\0\0\0\0\7\0\0\0\3\0\0\0cdrhow", 19));
  asked.clear();
  await([&] {
    std::ranges::move(server_->poll(), std::back_inserter(asked));
    return !asked.empty();
  });
  server_.reset();
  asked[0].reply("late");
}

TEST_F(FoxgloveServer, SaysGoodbyeAfterWhatWasPut) {
  begin();
  const auto client = joined();
  client->say(kSubscribe);
  (void)client->hear(kOfKept);
  server_->put(a_, Time(Duration(9)), bytes("last"));
  std::jthread end([this] { server_.reset(); });
  EXPECT_THAT(client->hear(kOfA), HasSubstr("last"));
  EXPECT_EQ(client->hear("closed"), "closed 1001 the run has ended");
}

}  // namespace
}  // namespace pons::gate::foxglove
