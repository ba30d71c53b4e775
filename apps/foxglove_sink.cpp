#include "apps/foxglove_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/foxglove_tasks.hpp"
#include "apps/run_recorder.hpp"
#include "pons/rt/grant.hpp"
#include "pons/wire/schema.hpp"

namespace pons::apps {

using gate::foxglove::Keeps;
using gate::foxglove::Server;

void add_foxglove_options(CLI::App& command, FoxgloveOptions& options) {
  auto* const on = command
                       .add_option("--foxglove", options.address,
                                   "Show the run to Foxglove or Lichtblick at [ADDRESS:]PORT: docs/foxglove.md")
                       ->expected(0, 1)
                       ->default_str(fmt::format("127.0.0.1:{}", gate::foxglove::kUsualPort));
  command
      .add_option("--foxglove-origin", options.origins,
                  "Pages that may look, too, as https://viewer.example; again for each; * for all")
      ->needs(on);
  command.add_flag("--foxglove-tasks", options.tasks, "Whoever looks may ask for tasks, too")->needs(on);
}

Expected<std::unique_ptr<FoxgloveSink>> FoxgloveSink::open(const FoxgloveOptions& options, const std::string& world) {
  const auto address = gate::foxglove::address_of(options.address);
  if (!address) return std::unexpected(address.error());
  gate::foxglove::ServerSettings settings{.address = *address,
                                          .info = {.name = "pons", .session = {}, .metadata = {{"world", world}}},
                                          .origins = {},
                                          .limits = {}};
  for (const std::string& origin : options.origins) {
    auto named = gate::foxglove::origin_of(origin);
    if (!named) return std::unexpected(named.error());
    settings.origins.push_back(*std::move(named));
  }
  auto server = Server::listen(std::move(settings));
  if (!server) return std::unexpected(server.error());
  std::unique_ptr<FoxgloveSink> sink(new FoxgloveSink(std::move(*server)));
  sink->tasks_ = options.tasks;
  if (options.tasks) serve_tasks(*sink->server_);
  const rt::KeptOff off(rt::loop_cpu());
  sink->server_->start();
  return sink;
}

Expected<std::size_t> FoxgloveSink::add(const ShownTopic& topic) {
  auto name = recorded_name(topic.name);
  if (!name) return std::unexpected(name.error());
  std::string schema = wire::ros2msg_schema(topic.type);
  if (schema.empty()) return fail(fmt::format("nothing defines {}", topic.type), *name, "show a type that ros2/ has");
  const bool kept = topic.qos.durability == gate::ros::Qos::Durability::kTransientLocal;
  return server_->add_channel(
      {*std::move(name), wire::wire_name(topic.type), std::move(schema), kept ? Keeps::kLast : Keeps::kNothing});
}

std::vector<std::string> FoxgloveSink::take_warnings() {
  std::vector<std::string> lines = server_->take_warnings();
  findings_ += lines.size();
  if (!lines.empty()) newest_ = lines.back();
  for (std::string& line : lines) line = "foxglove: " + line;
  if (!std::exchange(told_, true))
    lines.insert(lines.begin(), fmt::format("foxglove: ws://{}", gate::foxglove::text_of(server_->address())));
  return lines;
}

}  // namespace pons::apps
