// Images of 1 MB, 30 a second, to another process over loopback: from a gate's outlet, sent as a run sends its cameras'
// pictures, to Pons' node, from the outlet to Fast DDS's own interface, whose socket is of the system's default size,
// and from that to the node. How many are lost (a number is written into each), how long each takes from put() or
// write() to the reader's hands, and what either process takes of a CPU.

#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "pons/gate/ros/gate.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "tests/ros/peer_process.hpp"
#include "tests/ros/plain_dds.hpp"

namespace {

using namespace pons;
using namespace std::chrono_literals;
namespace dds = eprosima::fastdds::dds;
namespace ros = gate::ros;
using test::PlainDds;
using Clock = std::chrono::steady_clock;  // one and the same in all processes of a computer
using Image = wire::sensor_msgs::msg::Image;

constexpr std::uint32_t kWidth = 640, kHeight = 546, kChannels = 3;  // 1,048,320 bytes
constexpr int kRate_hz = 30;
constexpr std::size_t kNumberBytes = 8;  // the first of the pixels: which image it is; 0: to try whether one arrives
const std::string kType = "sensor_msgs::msg::dds_::Image_";

template <typename T>
T must(Expected<T> value) {
  if (!value) throw std::runtime_error(value.error().line());
  if constexpr (!std::is_void_v<T>) return std::move(*value);
}

double cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto s = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return s(usage.ru_utime) + s(usage.ru_stime);
}

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

// ---- the one that sends ----

class Sender {
 public:
  virtual ~Sender() = default;
  virtual void send(const Image& image) = 0;
};

class GateSender final : public Sender {
 public:
  GateSender(std::uint32_t domain, const ros::Qos& qos)
      : gate_(must(ros::Gate::open({.participant = {.domain = domain}, .name = {"/", "camera"}}))),
        outlet_(must(gate_->outlet<Image>("image", large(qos)))) {
    gate_->start();
  }
  void send(const Image& image) override { outlet_.put(image); }

 private:
  static ros::Qos large(ros::Qos qos) {
    qos.publish_mode = ros::Qos::PublishMode::kFlowControlled;
    return qos;
  }
  std::unique_ptr<ros::Gate> gate_;
  ros::Outlet<Image> outlet_;
};

class PlainSender final : public Sender {
 public:
  PlainSender(std::uint32_t domain, const ros::Qos& qos)
      : plain_({.domain = domain}),
        writer_(plain_.writer("rt/image", kType,
                              {.reliable = qos.reliability == ros::Qos::Reliability::kReliable, .depth = qos.depth})) {}
  void send(const Image& image) override {
    must(wire::encode(image, bytes_));
    if (!writer_.write(&bytes_)) throw std::runtime_error("an image could not be written");
  }

 private:
  PlainDds plain_;
  dds::DataWriter& writer_;
  PlainDds::Bytes bytes_;
};

Image image_of(std::uint64_t number) {
  Image image;
  image.height = kHeight;
  image.width = kWidth;
  image.encoding = "rgb8";
  image.step = kWidth * kChannels;
  image.data.assign(std::size_t{kHeight} * image.step, 0x55);
  std::memcpy(image.data.data(), &number, kNumberBytes);
  return image;
}

void stamp(Image& image, std::uint64_t number) {
  std::memcpy(image.data.data(), &number, kNumberBytes);
  const auto ns = Clock::now().time_since_epoch().count();
  image.header.stamp = {static_cast<std::int32_t>(ns / 1'000'000'000), static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

// ---- the one that hears, in a process of its own ----

// Prints "here" when one has come, and what is known when the last has, or no more do.
class Tally {
 public:
  explicit Tally(std::uint64_t count) : count_(count) {}
  void hear(const Image& image) {
    std::uint64_t number = 0;
    if (image.data.size() != std::size_t{kHeight} * kWidth * kChannels)
      throw std::runtime_error("an image is not whole");
    std::memcpy(&number, image.data.data(), kNumberBytes);
    last_s_ = now_s();
    if (number == 0) return void(std::exchange(here_, true) || std::puts("here") > 0);
    if (numbers_.empty()) begun_s_ = last_s_, begun_cpu_s_ = cpu_s();
    numbers_.insert(number);
    took_ms_.push_back(1e3 * (last_s_ - image.header.stamp.sec - 1e-9 * image.header.stamp.nanosec));
    ended_ = number == count_;
  }
  [[nodiscard]] bool ended() const { return ended_ || (!numbers_.empty() && now_s() - last_s_ > 3); }
  void tell() {
    if (took_ms_.empty()) throw std::runtime_error("no image came");
    const double cpu = 100 * (cpu_s() - begun_cpu_s_) / (last_s_ - begun_s_);
    std::ranges::sort(took_ms_);
    const auto at = [&](double share) {
      return took_ms_[static_cast<std::size_t>(share * static_cast<double>(took_ms_.size() - 1))];
    };
    fmt::print("lost {} of {}; latency {:.2f} ms (50 %), {:.2f} (99 %), {:.2f} (worst); the reader's CPU {:.1f} %\n",
               count_ - numbers_.size(), count_, at(0.5), at(0.99), at(1), cpu);
  }

 private:
  std::uint64_t count_;
  std::set<std::uint64_t> numbers_;
  std::vector<double> took_ms_;
  double begun_s_ = 0, begun_cpu_s_ = 0, last_s_ = 0;
  bool here_ = false, ended_ = false;
};

int hear_by_node(std::uint32_t domain, const ros::Qos& qos, Tally& tally) {
  const auto node = must(ros::Node::open({.participant = {.domain = domain}, .name = {"/", "viewer"}}));
  must(node->subscribe<Image>("image", qos, [&](const Image& image) { tally.hear(image); }));
  while (!tally.ended()) node->spin_for(200ms);
  tally.tell();
  return 0;
}

class PlainViewer final : public dds::DataReaderListener {
 public:
  explicit PlainViewer(Tally& tally) : tally_(tally) {}
  void on_data_available(dds::DataReader* reader) override {
    while (PlainDds::take(*reader, bytes_)) {
      if (const auto read = wire::decode(bytes_, image_); !read) std::abort();
      tally_.hear(image_);
      if (tally_.ended()) ended_ = true;
    }
  }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  Tally& tally_;
  PlainDds::Bytes bytes_;
  Image image_;
  std::atomic<bool> ended_ = false;
};

int hear_plainly(std::uint32_t domain, const ros::Qos& qos, Tally& tally) {
  PlainViewer viewer(tally);
  {
    PlainDds plain({.domain = domain});
    plain.reader("rt/image", kType,
                 {.reliable = qos.reliability == ros::Qos::Reliability::kReliable, .depth = qos.depth}, &viewer);
    // Until all have come, or whoever sends has waited long enough for that.
    for (pollfd input{STDIN_FILENO, POLLIN, 0}; !viewer.ended() && ::poll(&input, 1, 200) == 0;) {
    }
  }
  tally.tell();
  return 0;
}

// "hear BY QOS COUNT"
int hear(std::uint32_t domain, const std::string& role) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::array<char, 16> by{}, qos{};
  unsigned long count = 0;
  if (std::sscanf(role.c_str(), "hear %15s %15s %lu", by.data(), qos.data(), &count) != 3) return 2;
  Tally tally(count);
  const ros::Qos wanted = std::string_view(qos.data()) == "sensor" ? ros::kSensorQos : ros::kTopicQos;
  return std::string_view(by.data()) == "node" ? hear_by_node(domain, wanted, tally)
                                               : hear_plainly(domain, wanted, tally);
}

struct Options {
  bool gate = false, sensor = false;
  int seconds = 30;
  std::uint32_t domain = 12;
};

// Whether none was lost.
bool stream(const Options& options, const std::string& from, const std::string& to) {
  const ros::Qos qos = options.sensor ? ros::kSensorQos : ros::kTopicQos;
  const auto count = static_cast<std::uint64_t>(options.seconds) * kRate_hz;
  test::PeerProcess peer("/proc/self/exe", options.domain, "viewer",
                         fmt::format("hear {} {} {}", to, options.sensor ? "sensor" : "topic", count));
  std::unique_ptr<Sender> sender;
  if (from == "outlet") {
    sender = std::make_unique<GateSender>(options.domain, qos);
  } else {
    sender = std::make_unique<PlainSender>(options.domain, qos);
  }
  Image image = image_of(0);
  for (const double begun_s = now_s(); !peer.said("here");) {
    sender->send(image);
    std::this_thread::sleep_for(100ms);
    if (now_s() - begun_s > 30) throw std::runtime_error("no image arrives");
  }
  const double begun_cpu_s = cpu_s(), begun_s = now_s();
  auto next = Clock::now();
  for (std::uint64_t number = 1; number <= count; ++number) {
    std::this_thread::sleep_until(next += std::chrono::nanoseconds(1'000'000'000 / kRate_hz));
    stamp(image, number);
    sender->send(image);
  }
  const double cpu = 100 * (cpu_s() - begun_cpu_s) / (now_s() - begun_s);
  for (const double ended_s = now_s(); !peer.said("lost") && now_s() - ended_s < 10;) std::this_thread::sleep_for(50ms);
  if (!peer.said("lost")) throw std::runtime_error("the reader says nothing");
  fmt::print("{:>6} to {:<5} {}, the writer's {:.1f} %\n", from, to, peer.lines().back(), cpu);
  std::fflush(stdout);
  return peer.said("lost 0 ");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 4 && std::string_view(argv[3]).starts_with("hear"))
      return hear(static_cast<std::uint32_t>(std::atoi(argv[1])), argv[3]);
    Options options;
    CLI::App app("Images of 1 MB, 30 a second, to another process");
    app.add_option("--seconds", options.seconds, "Of each stream")->check(CLI::PositiveNumber);
    app.add_option("--domain", options.domain, "That nobody else is on")->check(CLI::Range(0, 232));
    app.add_flag("--sensor", options.sensor, "Best effort, as for sensors, in place of reliable");
    app.add_flag("--gate", options.gate, "Exit code 1 where an image is lost");
    CLI11_PARSE(app, argc, argv);
    fmt::print("1 MB at {} Hz, {} s a stream, {}\n", kRate_hz, options.seconds,
               options.sensor ? "best effort" : "reliable");
    bool kept = stream(options, "outlet", "node");
    kept = stream(options, "outlet", "plain") && kept;
    kept = stream(options, "plain", "node") && kept;
    fmt::print("bar {}\n", kept ? "kept" : "MISSED");
    return options.gate && !kept ? 1 : 0;
  } catch (const std::exception& problem) {
    fmt::print(stderr, "ros_images: {}\n", problem.what());
    return 2;
  }
}
