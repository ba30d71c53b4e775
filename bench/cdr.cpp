// What it costs to encode and decode a sensor_msgs/JointState of seven joints, and what the code costs that ROS 2's
// generators for Fast DDS make for it (rosidl_typesupport_fastrtps_cpp, as of Humble and Jazzy: a `<<` of libfastcdr's
// a field, after a look at how long it becomes), in turn in one process. Names as short as std::string keeps without
// memory of its own, and longer ones. Each decodes into a message that has held one before.

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"

namespace {

using namespace pons;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using pons::wire::sensor_msgs::msg::JointState;
using Clock = std::chrono::steady_clock;

constexpr double kBar_us = 1;  // encoding and decoding together

struct Amount {
  int rounds = 11, times = 200'000;  // so many a round
};

[[noreturn]] void die(const std::string& why) {
  std::fprintf(stderr, "cdr: error: %s\n", why.c_str());
  std::exit(2);
}

// ---- as generated for Fast DDS ----

std::size_t text_size(const std::string& text, std::size_t at) { return 4 + Cdr::alignment(at, 4) + text.size() + 1; }

std::size_t doubles_size(const std::vector<double>& values, std::size_t at) {
  const std::size_t count = 4 + Cdr::alignment(at, 4);
  return values.empty() ? count : count + 8 * values.size() + Cdr::alignment(at + count, 8);
}

std::size_t generated_size(const JointState& message) {
  std::size_t at = 0;
  at += 4 + Cdr::alignment(at, 4);
  at += 4 + Cdr::alignment(at, 4);
  at += text_size(message.header.frame_id, at);
  at += 4 + Cdr::alignment(at, 4);
  for (const std::string& name : message.name) at += text_size(name, at);
  for (const auto* values : {&message.position, &message.velocity, &message.effort}) at += doubles_size(*values, at);
  return at + 4;
}

void generated_encode(const JointState& message, std::vector<std::byte>& bytes) {
  bytes.resize(generated_size(message));
  FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  cdr << message.header.stamp.sec;
  cdr << message.header.stamp.nanosec;
  cdr << message.header.frame_id;
  cdr << message.name;
  cdr << message.position;
  cdr << message.velocity;
  cdr << message.effort;
  if (cdr.getSerializedDataLength() != bytes.size()) die("fastcdr wrote another length");
}

void generated_decode(std::vector<std::byte>& bytes, JointState& message) {
  FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  cdr.read_encapsulation();
  cdr >> message.header.stamp.sec;
  cdr >> message.header.stamp.nanosec;
  cdr >> message.header.frame_id;
  cdr >> message.name;
  cdr >> message.position;
  cdr >> message.velocity;
  cdr >> message.effort;
}

// ---- ours ----

void our_encode(const JointState& message, std::vector<std::byte>& bytes) {
  if (const auto encoded = wire::encode(message, bytes); !encoded) die(encoded.error().line());
}

void our_decode(std::vector<std::byte>& bytes, JointState& message) {
  if (const auto decoded = wire::decode(bytes, message); !decoded) die(decoded.error().line());
}

// ---- both ----

// Neither what is under `value` nor what follows may be computed once for all times.
template <typename T>
void is_looked_at(T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

template <typename Call>
double ns_each(int times, const Call& call) {
  const auto begun = Clock::now();
  for (int i = 0; i < times; ++i) call();
  return std::chrono::duration<double, std::nano>(Clock::now() - begun).count() / times;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

JointState message_of(const std::string& prefix) {
  JointState message;
  message.header.stamp.sec = 1'700'000'000;
  message.header.stamp.nanosec = 123'456'789;
  message.header.frame_id = "base_link";
  for (int joint = 1; joint <= 7; ++joint) {
    message.name.push_back(prefix + std::to_string(joint));
    message.position.push_back(0.1 * joint);
    message.velocity.push_back(-0.2 * joint);
    message.effort.push_back(3.5 * joint);
  }
  return message;
}

// Both make the same bytes, and the same message of them.
void check(const JointState& message) {
  std::vector<std::byte> ours, generated;
  our_encode(message, ours);
  generated_encode(message, generated);
  if (ours != generated) die("the bytes differ");
  JointState read;
  our_decode(generated, read);
  if (read != message) die("what fastcdr writes is read as another message");
  generated_decode(ours, read);
  if (read != message) die("fastcdr reads another message");
}

struct Figures {
  double encode_ns = 0, decode_ns = 0, both_ns = 0;
};

template <typename Encode, typename Decode>
Figures one_round(int times, const JointState& message, const Encode& encode, const Decode& decode) {
  std::vector<std::byte> bytes;
  JointState read;
  Figures figures;
  const auto write = [&] {
    is_looked_at(message);
    encode(message, bytes);
    is_looked_at(bytes);
  };
  figures.encode_ns = ns_each(times, write);
  const auto take = [&] {
    is_looked_at(bytes);
    decode(bytes, read);
    is_looked_at(read);
  };
  figures.decode_ns = ns_each(times, take);
  figures.both_ns = ns_each(times, [&] {
    write();
    take();
  });
  return figures;
}

Figures median_of(const std::vector<Figures>& rounds) {
  const auto of = [&](double Figures::* member) {
    std::vector<double> values;
    for (const Figures& round : rounds) values.push_back(round.*member);
    return median(values);
  };
  return {of(&Figures::encode_ns), of(&Figures::decode_ns), of(&Figures::both_ns)};
}

// Whether the bars are kept.
bool compare(const std::string& title, const JointState& message, const Amount& amount) {
  check(message);
  std::vector<Figures> ours, generated;
  for (int round = 0; round < amount.rounds; ++round) {
    ours.push_back(one_round(amount.times, message, our_encode, our_decode));
    generated.push_back(one_round(amount.times, message, generated_encode, generated_decode));
  }
  const Figures mine = median_of(ours), theirs = median_of(generated);
  fmt::print("{}, {} bytes\n  {:<10}{:>10}{:>10}{:>10}\n", title, wire::encoded_size(message), "ns", "encode", "decode",
             "both");
  fmt::print("  {:<10}{:>10.1f}{:>10.1f}{:>10.1f}\n", "pons", mine.encode_ns, mine.decode_ns, mine.both_ns);
  fmt::print("  {:<10}{:>10.1f}{:>10.1f}{:>10.1f}\n", "fastcdr", theirs.encode_ns, theirs.decode_ns, theirs.both_ns);
  fmt::print("  {:<10}{:>10.2f}{:>10.2f}{:>10.2f}\n", "ratio", mine.encode_ns / theirs.encode_ns,
             mine.decode_ns / theirs.decode_ns, mine.both_ns / theirs.both_ns);
  return mine.both_ns <= 1e3 * kBar_us && mine.encode_ns <= theirs.encode_ns && mine.decode_ns <= theirs.decode_ns;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    CLI::App app{"What encoding and decoding a JointState of seven joints costs, beside fastcdr"};
    Amount amount;
    bool gate = false;
    app.add_option("--rounds", amount.rounds, "Medians of so many")->check(CLI::Range(1, 1000));
    app.add_option("--times", amount.times, "Messages a round")->check(CLI::Range(1, 10'000'000));
    app.add_flag("--gate", gate, fmt::format("Fail above {} µs, or where it is slower than fastcdr", kBar_us));
    CLI11_PARSE(app, argc, argv);
    fmt::print("JointState of seven joints, medians of {} rounds of {}\n", amount.rounds, amount.times);
    const bool of_short = compare("names of 12 characters", message_of("panda_joint"), amount);
    const bool of_long = compare("names of 24 characters", message_of("left_arm_shoulder_joint"), amount);
    fmt::print("bars {}\n", of_short && of_long ? "kept" : "MISSED");
    return gate && !(of_short && of_long) ? 1 : 0;
  } catch (const std::exception& failure) {
    die(failure.what());
  }
}
