#include "pons/brain/policy_runner.hpp"

#include <algorithm>
#include <utility>

namespace pons::brain {
namespace {

constexpr double kRate_hz = 10, kLatency_s = 0.15, kFirstLatency_s = 0.6;  // where a task does not say
// From a chunk's arrival to its first effect: a bridge tick, the splice lead, the knots of the motion that stay.
constexpr Duration kMargin = std::chrono::milliseconds(200);
constexpr double kForget = 0.2;  // how much of it a shorter latency takes off the usual one

}  // namespace

void PolicyRunner::begin(const task::ChunkStream& stream) {
  stream_ = stream.number();
  policy_.reset();
  asked_ = answered_ = 0;
  asked_at_.reset();
  usual_ = Duration{0};
  const task::Json& arguments = stream.arguments();
  const auto maker = makers_.find(arguments.at("policy").get<std::string>());
  if (maker == makers_.end()) return;
  policy_ = maker->second(arguments);
  modelled_ = {from_s(arguments.value("latency_s", kLatency_s)),
               from_s(arguments.value("first_latency_s", kFirstLatency_s))};
  every_ = from_s(1 / arguments.value("rate_hz", kRate_hz));
}

bool PolicyRunner::is_time(const task::Observation& seen, Time now) const {
  if (!asked_at_) return true;
  if (answered_ == 0) return false;
  // The second at once: its latency is the first that tells what is usual.
  if (asked_ == 1 || now >= *asked_at_ + every_) return true;
  return asked_ == answered_ && seen.enough <= usual_ + kMargin;
}

void PolicyRunner::hand_on(task::ChunkStream* stream, Time now) {
  while (!under_way_.empty() && under_way_.front().due <= now) {
    const auto chunk = inference_.take();
    if (!chunk) return;
    const Asked asked = under_way_.front();
    under_way_.pop_front();
    if (stream == nullptr || asked.stream != stream->number()) continue;
    // Refused, it is counted and named by the stream; the next one may do better.
    (void)stream->take(*chunk, now);
    if (answered_++ == 0) continue;
    const Duration latency = now - asked.at;
    usual_ = latency > usual_ ? latency : usual_ - from_s(kForget * to_s(usual_ - latency));
  }
}

void PolicyRunner::attend(task::ChunkStream* stream, Time now) {
  if (stream != nullptr && stream->number() != stream_) begin(*stream);
  hand_on(stream, now);
  if (stream == nullptr || !policy_) return;
  task::Observation seen = stream->observe(now);
  if (!is_time(seen, now)) return;
  under_way_.push_back({stream_, now, now + (asked_ == 0 ? modelled_.first : modelled_.usual)});
  // Answers come in order; one cannot be handed on before the one asked for earlier.
  inference_.ask(policy_, std::move(seen));
  asked_at_ = now;
  ++asked_;
}

}  // namespace pons::brain
