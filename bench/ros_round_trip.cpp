// How long a text of 64 characters takes to another process and back: through two of Pons' nodes, and through Fast
// DDS's own interface, on which these stand, with the same transport and qualities of service: once as threads of one's
// own wait for data (a WaitSet, as rclcpp does), once inside the listener's call, on the library's thread, where no
// program can do much. All three pairs live during the whole run and take turns.

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <fastdds/dds/core/condition/StatusCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "pons/gate/ros/node.hpp"
#include "pons/wire/types/std_msgs/msg/string.hpp"
#include "tests/ros/peer_process.hpp"
#include "tests/ros/plain_dds.hpp"

namespace {

using namespace pons;
using namespace std::chrono_literals;
namespace dds = eprosima::fastdds::dds;
namespace ros = gate::ros;
using test::PlainDds;
using wire::std_msgs::msg::String;
using Clock = std::chrono::steady_clock;

constexpr double kBar = 1.2;  // ours over a WaitSet's
constexpr auto kPatience = 5s;
constexpr std::size_t kCharacters = 64;
const std::string kType = "std_msgs::msg::dds_::String_";

template <typename T>
T must(Expected<T> value) {
  if (!value) throw std::runtime_error(value.error().line());
  if constexpr (!std::is_void_v<T>) return std::move(*value);
}

// Sends and waits for what comes back.
class Pinger {
 public:
  virtual ~Pinger() = default;
  // µs; nothing: it did not come back within that time.
  [[nodiscard]] virtual std::optional<double> once(Clock::duration patience) = 0;
};

double us(Clock::duration took) { return std::chrono::duration<double, std::micro>(took).count(); }

class NodePinger final : public Pinger {
 public:
  explicit NodePinger(std::uint32_t domain)
      : node_(must(ros::Node::open({.participant = {.domain = domain}, .name = {"/", "ping"}}))),
        publisher_(must(node_->advertise<String>("ping_node"))) {
    must(node_->subscribe<String>("pong_node", ros::kTopicQos, [this](const String&) { back_ = true; }));
  }
  [[nodiscard]] std::optional<double> once(Clock::duration patience) override {
    back_ = false;
    const auto begun = Clock::now();
    must(publisher_.publish(message_));
    while (!back_) {
      node_->spin_for(100ms);
      if (!back_ && Clock::now() - begun > patience) return std::nullopt;
    }
    return us(Clock::now() - begun);
  }

 private:
  std::unique_ptr<ros::Node> node_;
  ros::Publisher<String> publisher_;
  String message_{std::string(kCharacters, 'x')};
  bool back_ = false;
};

class NodeEcho final {
 public:
  explicit NodeEcho(std::uint32_t domain)
      : node_(must(ros::Node::open({.participant = {.domain = domain}, .name = {"/", "pong"}}))),
        publisher_(must(node_->advertise<String>("pong_node"))) {
    must(node_->subscribe<String>("ping_node", ros::kTopicQos,
                                  [this](const String& text) { must(publisher_.publish(text)); }));
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) node_->spin_for(100ms);
    });
  }

 private:
  std::unique_ptr<ros::Node> node_;
  ros::Publisher<String> publisher_;
  std::jthread thread_;
};

// Whoever waits for a reader's data on a thread of his own.
class Waiting {
 public:
  explicit Waiting(dds::DataReader& reader) : reader_(reader) {
    reader.get_statuscondition().set_enabled_statuses(dds::StatusMask::data_available());
    set_.attach_condition(reader.get_statuscondition());
  }
  // False: nothing in that time.
  bool take(PlainDds::Bytes& bytes, Clock::duration patience) {
    if (PlainDds::take(reader_, bytes)) return true;
    dds::ConditionSeq active;
    const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(patience).count();
    (void)set_.wait(active, eprosima::fastrtps::Duration_t(static_cast<std::int32_t>(ns / 1'000'000'000),
                                                           static_cast<std::uint32_t>(ns % 1'000'000'000)));
    return PlainDds::take(reader_, bytes);
  }

 private:
  dds::DataReader& reader_;
  dds::WaitSet set_;
};

PlainDds::Bytes text() {
  PlainDds::Bytes bytes;
  must(wire::encode(String{std::string(kCharacters, 'x')}, bytes));
  return bytes;
}

class WaitSetPinger final : public Pinger {
 public:
  explicit WaitSetPinger(std::uint32_t domain)
      : plain_({.domain = domain}),
        writer_(plain_.writer("rt/ping_waitset", kType, {})),
        waiting_(plain_.reader("rt/pong_waitset", kType, {})) {}
  [[nodiscard]] std::optional<double> once(Clock::duration patience) override {
    const auto begun = Clock::now();
    writer_.write(&bytes_);
    while (!waiting_.take(back_, 100ms))
      if (Clock::now() - begun > patience) return std::nullopt;
    return us(Clock::now() - begun);
  }

 private:
  PlainDds plain_;
  dds::DataWriter& writer_;
  Waiting waiting_;
  PlainDds::Bytes bytes_ = text(), back_;
};

class WaitSetEcho final {
 public:
  explicit WaitSetEcho(std::uint32_t domain)
      : plain_({.domain = domain}),
        writer_(plain_.writer("rt/pong_waitset", kType, {})),
        waiting_(plain_.reader("rt/ping_waitset", kType, {})),
        thread_([this](const std::stop_token& stop) {
          PlainDds::Bytes bytes;
          while (!stop.stop_requested())
            if (waiting_.take(bytes, 100ms)) writer_.write(&bytes);
        }) {}

 private:
  PlainDds plain_;
  dds::DataWriter& writer_;
  Waiting waiting_;
  std::jthread thread_;
};

class ListenerPinger final : public Pinger, dds::DataReaderListener {
 public:
  explicit ListenerPinger(std::uint32_t domain)
      : plain_({.domain = domain}), writer_(plain_.writer("rt/ping_listener", kType, {})) {
    plain_.reader("rt/pong_listener", kType, {}, this);
  }
  [[nodiscard]] std::optional<double> once(Clock::duration patience) override {
    std::unique_lock lock(mutex_);
    back_.reset();
    const auto begun = Clock::now();
    lock.unlock();
    writer_.write(&bytes_);
    lock.lock();
    if (!came_.wait_for(lock, patience, [&] { return back_.has_value(); })) return std::nullopt;
    return us(*back_ - begun);
  }

 private:
  void on_data_available(dds::DataReader* reader) override {
    while (PlainDds::take(*reader, read_)) {
      const std::scoped_lock lock(mutex_);
      back_ = Clock::now();
      came_.notify_one();
    }
  }
  PlainDds::Bytes bytes_ = text(), read_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::optional<Clock::time_point> back_;  // under mutex_
  PlainDds plain_;                         // last: it calls the others
  dds::DataWriter& writer_;
};

class ListenerEcho final : dds::DataReaderListener {
 public:
  explicit ListenerEcho(std::uint32_t domain)
      : plain_({.domain = domain}), writer_(plain_.writer("rt/pong_listener", kType, {})) {
    plain_.reader("rt/ping_listener", kType, {}, this);
  }

 private:
  void on_data_available(dds::DataReader* reader) override {
    while (PlainDds::take(*reader, bytes_)) writer_.write(&bytes_);
  }
  PlainDds::Bytes bytes_;
  PlainDds plain_;
  dds::DataWriter& writer_;
};

// Until the input ends.
int echo(std::uint32_t domain) {
  const NodeEcho node(domain);
  const WaitSetEcho waitset(domain);
  const ListenerEcho listener(domain);
  pollfd input{STDIN_FILENO, POLLIN, 0};
  (void)::poll(&input, 1, -1);
  return 0;
}

double percentile(std::vector<double> values, double percent) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(percent / 100 * static_cast<double>(values.size() - 1))];
}

struct Options {
  bool gate = false;
  int rounds = 11, times = 2000;
  std::uint32_t domain = 11;
};

struct Side {
  const char* name;
  std::unique_ptr<Pinger> pinger;
  std::vector<double> medians, most;  // µs, a round
};

int run(const Options& options, const std::string& self) {
  const test::PeerProcess peer(self, options.domain, "pong", "echo");
  std::vector<Side> sides;
  sides.push_back({"Pons' node", std::make_unique<NodePinger>(options.domain), {}, {}});
  sides.push_back({"WaitSet", std::make_unique<WaitSetPinger>(options.domain), {}, {}});
  sides.push_back({"listener", std::make_unique<ListenerPinger>(options.domain), {}, {}});
  // What is sent before both sides have found each other is lost.
  for (const Side& side : sides) {
    const auto begun = Clock::now();
    while (!side.pinger->once(200ms))
      if (Clock::now() - begun > 30s) throw std::runtime_error(fmt::format("{}: nothing comes back", side.name));
  }
  for (int round = 0; round < options.rounds; ++round) {
    for (Side& side : sides) {
      std::vector<double> took;
      for (int i = 0; i < options.times; ++i) {
        const auto one = side.pinger->once(kPatience);
        if (!one) throw std::runtime_error(fmt::format("{}: a message was lost", side.name));
        took.push_back(*one);
      }
      side.medians.push_back(percentile(took, 50));
      side.most.push_back(percentile(std::move(took), 99));
    }
  }
  fmt::print("{} characters there and back, {} rounds of {}; medians of the rounds', µs\n", kCharacters, options.rounds,
             options.times);
  for (const Side& side : sides)
    fmt::print("  {:<12} 50 % {:7.1f}   99 % {:7.1f}\n", side.name, percentile(side.medians, 50),
               percentile(side.most, 50));
  const auto over = [&](const Side& other) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < other.medians.size(); ++i) ratios.push_back(sides[0].medians[i] / other.medians[i]);
    return percentile(std::move(ratios), 50);
  };
  const double ratio = over(sides[1]);
  fmt::print("  ratio of the medians, median of the rounds': {:.2f} over WaitSet's, {:.2f} over the listener's\n",
             ratio, over(sides[2]));
  fmt::print("bar {}\n", ratio <= kBar ? "kept" : "MISSED");
  return options.gate && ratio > kBar ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 4 && std::string_view(argv[3]) == "echo") return echo(static_cast<std::uint32_t>(std::atoi(argv[1])));
    Options options;
    CLI::App app("A small message to another process and back, beside Fast DDS by itself");
    app.add_option("--rounds", options.rounds, "Figures are their medians")->check(CLI::PositiveNumber);
    app.add_option("--times", options.times, "Messages a round")->check(CLI::PositiveNumber);
    app.add_option("--domain", options.domain, "That nobody else is on")->check(CLI::Range(0, 232));
    app.add_flag("--gate", options.gate, fmt::format("Exit code 1 above {} times what a WaitSet takes", kBar));
    CLI11_PARSE(app, argc, argv);
    return run(options, "/proc/self/exe");
  } catch (const std::exception& problem) {
    fmt::print(stderr, "ros_round_trip: {}\n", problem.what());
    return 2;
  }
}
