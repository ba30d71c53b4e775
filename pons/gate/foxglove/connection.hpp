// One connection of a Foxglove server, on Boost.Beast; of server.cpp, the only file that compiles that library.
#pragma once

#include <fmt/format.h>

#include <array>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "pons/gate/foxglove/handshake.hpp"
#include "pons/gate/foxglove/server.hpp"
#include "pons/gate/foxglove/session.hpp"

namespace pons::gate::foxglove {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using Failure = boost::system::error_code;

inline constexpr std::uint32_t kHeadMost = 8192;  // bytes of the first words of a connection

// What a connection needs of its server.
class Host {
 public:
  virtual ~Host() = default;
  [[nodiscard]] virtual const ServerSettings& settings() const = 0;
  [[nodiscard]] virtual bool has_room() const = 0;
  [[nodiscard]] virtual std::unique_ptr<Session> session(std::uint64_t connection) = 0;
  virtual void warn(std::string line) = 0;
  virtual void ended(std::uint64_t connection) = 0;
};

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Host& host, std::uint64_t number, tcp::socket socket)
      : host_(host), number_(number), stream_(std::move(socket)) {
    Failure ignored;
    const auto from = beast::get_lowest_layer(stream_).socket().remote_endpoint(ignored);
    peer_ = ignored ? "somebody" : from.address().to_string();
    (void)beast::get_lowest_layer(stream_).socket().set_option(tcp::no_delay(true), ignored);
  }

  void begin() {
    parser_.header_limit(kHeadMost);
    parser_.body_limit(0);
    beast::get_lowest_layer(stream_).expires_after(host_.settings().limits.handshake);
    http::async_read(stream_.next_layer(), buffer_, parser_,
                     [self = shared_from_this()](Failure failure, std::size_t) { self->greet(failure); });
  }

  // Null until it is a client.
  [[nodiscard]] Session* session() { return session_.get(); }

  // Sends what waits, a message at a time, so that what is newer may take the place of what still waits.
  void write() {
    if (!session_ || writing_ || closing_) return;
    if (!session_->broken().empty()) return close(websocket::close_code::policy_error, session_->broken());
    auto next = session_->next();
    if (!next && leaving_) return close(websocket::close_code::going_away, "the run has ended");
    if (!next) return;
    writing_ = true;
    out_ = std::move(*next);
    stream_.text(out_.text.has_value());
    std::array<asio::const_buffer, 2> buffers;
    if (out_.text) {
      buffers[0] = asio::buffer(*out_.text);
    } else {
      buffers[0] = asio::buffer(out_.header.bytes.data(), out_.header.size);
      if (out_.body) buffers[1] = asio::buffer(*out_.body);
    }
    stream_.async_write(buffers, [self = shared_from_this()](Failure failure, std::size_t) {
      self->writing_ = false;
      if (failure) return self->end();
      self->write();
    });
  }

  // After what waits.
  void goodbye() {
    leaving_ = true;
    if (!session_) return end();
    write();
  }

 private:
  void greet(Failure failure) {
    const bool of_http = failure.category() == http::make_error_code(http::error::bad_method).category();
    if (failure && (!of_http || failure == http::error::end_of_stream)) return end();
    if (failure) return refuse({400, fmt::format("it does not speak HTTP as viewers do: {}", failure.message())});
    // Before it is answered a viewer has no more to say.
    if (buffer_.size() > 0) return refuse({400, "it sent more than a request"});
    request_ = parser_.release();
    const auto chosen = welcome({.upgrade = websocket::is_upgrade(request_) ? "websocket" : "",
                                 .subprotocols = request_[http::field::sec_websocket_protocol],
                                 .origin = request_[http::field::origin]},
                                host_.settings().origins);
    if (!chosen) return refuse(chosen.error());
    if (!host_.has_room())
      return refuse({503, fmt::format("{} viewers are connected already", host_.settings().limits.clients)});
    accept(*chosen);
  }

  void refuse(const Refused& refused) {
    host_.warn(fmt::format("{} was refused: {}", peer_, refused.why));
    response_.result(refused.status);
    response_.version(request_.version());
    response_.set(http::field::content_type, "text/plain; charset=utf-8");
    if (refused.status == 426) response_.set(http::field::upgrade, "websocket");
    response_.body() = refused.why + "\n";
    response_.keep_alive(false);
    response_.prepare_payload();
    beast::get_lowest_layer(stream_).expires_after(host_.settings().limits.handshake);
    http::async_write(stream_.next_layer(), response_,
                      [self = shared_from_this()](Failure, std::size_t) { self->end(); });
  }

  void accept(std::string_view subprotocol) {
    const ServerLimits& limits = host_.settings().limits;
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(websocket::stream_base::timeout{limits.handshake, limits.idle, true});
    stream_.set_option(websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
      response.set(http::field::server, "pons");
      response.set(http::field::sec_websocket_protocol, subprotocol);
    }));
    stream_.read_message_max(limits.said_bytes);
    stream_.auto_fragment(false);
    stream_.async_accept(request_, [self = shared_from_this()](Failure failure) {
      if (failure || self->ended_) return self->end();
      self->session_ = self->host_.session(self->number_);
      self->write();
      self->read();
    });
  }

  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (failure) return self->end(failure);
      const auto said = self->buffer_.cdata();
      if (self->stream_.got_text()) {
        self->session_->hear_text({static_cast<const char*>(said.data()), said.size()});
      } else {
        self->session_->hear_binary({static_cast<const std::byte*>(said.data()), said.size()});
      }
      self->buffer_.clear();
      self->write();
      self->read();
    });
  }

  void close(websocket::close_code code, std::string_view why) {
    if (std::exchange(closing_, true)) return;
    if (code == websocket::close_code::policy_error)
      host_.warn(fmt::format("the connection to {} was ended: {}", peer_, why));
    if (writing_) return end();  // it does not read: a goodbye would wait behind that
    websocket::close_reason reason(code);
    reason.reason.assign(why.substr(0, reason.reason.max_size()));
    stream_.async_close(reason, [self = shared_from_this()](Failure) { self->end(); });
  }

  void end(Failure why = {}) {
    if (std::exchange(ended_, true)) return;
    if (why == websocket::error::message_too_big)
      host_.warn(fmt::format("the connection to {} was ended: it sent more than {} bytes in one message", peer_,
                             host_.settings().limits.said_bytes));
    closing_ = true;
    Failure ignored;
    auto& socket = beast::get_lowest_layer(stream_).socket();
    (void)socket.shutdown(tcp::socket::shutdown_both, ignored);
    (void)socket.close(ignored);
    session_.reset();
    host_.ended(number_);
  }

  Host& host_;
  std::uint64_t number_;
  websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_;
  http::request_parser<http::string_body> parser_;
  http::request<http::string_body> request_;
  http::response<http::string_body> response_;
  std::string peer_;
  std::unique_ptr<Session> session_;
  Outgoing out_;
  bool writing_ = false, leaving_ = false, closing_ = false, ended_ = false;
};

}  // namespace pons::gate::foxglove
