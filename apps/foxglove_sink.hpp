// A run for viewers of the Foxglove WebSocket protocol: Foxglove, Lichtblick and others.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/foxglove/server.hpp"
#include "pons/gate/local_socket.hpp"

namespace pons::apps {

struct FoxgloveOptions {
  std::string address;               // [ADDRESS:]PORT; empty: nobody is shown anything
  std::vector<std::string> origins;  // more pages that may look
  bool tasks = false;                // whoever looks may ask for tasks, too
  [[nodiscard]] bool on() const { return !address.empty(); }
};
void add_foxglove_options(CLI::App& command, FoxgloveOptions& options);

class FoxgloveSink final : public Sink {
 public:
  // Listens from here on. Errors: no address, no origin; those of Server::listen().
  [[nodiscard]] static Expected<std::unique_ptr<FoxgloveSink>> open(const FoxgloveOptions& options,
                                                                    const std::string& world);

  // Topics stand in the namespace of a node /pons. Errors: no name, no type that has a definition; those of
  // Server::add_channel().
  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic) override;
  [[nodiscard]] bool wants(std::size_t topic) const override { return server_->wanted(topic); }
  void put(std::size_t topic, Time now, std::span<const std::byte> message) override {
    server_->put(topic, now, message);
  }
  [[nodiscard]] std::string_view name() const override { return "Foxglove"; }
  [[nodiscard]] SinkHealth health() const override {
    return {.dropped = server_->dropped(), .findings = findings_, .newest = newest_};
  }
  // What is asked for; null where nothing may be. Gone with this.
  [[nodiscard]] gate::Visitors* visitors() { return tasks_ ? server_.get() : nullptr; }
  // What people should know, a line each: at first where it listens, then who was refused.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  explicit FoxgloveSink(std::unique_ptr<gate::foxglove::Server> server) : server_(std::move(server)) {}

  std::unique_ptr<gate::foxglove::Server> server_;
  bool tasks_ = false, told_ = false;
  std::uint64_t findings_ = 0;
  std::string newest_;
};

}  // namespace pons::apps
