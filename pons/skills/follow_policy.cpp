#include "pons/skills/follow_policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "pons/motion/chunks.hpp"
#include "pons/skills/conduct.hpp"
#include "pons/task/policy.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr Duration kTick = std::chrono::milliseconds(1);  // of the loop: what starvation is counted in
constexpr double kRounding = 1e-9;                        // of a number of actions that a path is asked for
constexpr Duration kSilence = std::chrono::seconds(10);   // then the policy is taken for dead
constexpr Duration kLongestStream = std::chrono::seconds(600);
constexpr double kEndless = std::numeric_limits<double>::infinity();

class FollowPolicy final : public ArmSkill, public task::ChunkStream {
 public:
  FollowPolicy(Cell& cell, task::Json arguments)
      : cell_(cell), arguments_(std::move(arguments)), number_(++cell.streams), for_(from_s(arguments_.at("seconds"))) {
    cell_.stream = this;
  }
  ~FollowPolicy() override {
    if (cell_.stream == this) cell_.stream = nullptr;
  }
  FollowPolicy(const FollowPolicy&) = delete;
  FollowPolicy& operator=(const FollowPolicy&) = delete;

  // ---- the skill ----

  Progress tick(Time now) override {
    if (cell_.held) return {Status::kFailed, "the cups hold " + cell_.held->code, {}};
    if (!cell_.arm.operational()) return stopped();
    if (!path_) return begin(now);
    executed_ = std::max(executed_, path_->executed(motion_time(now)));
    count_starved(now);
    if (ending_) {
      if (motion_time(now) < path_->end()) return {};
      return verdict_;
    }
    if (last_ && motion_time(now) >= path_->end()) return whole() ? succeeded() : too_slow();
    if (first_chunk_ && now >= *first_chunk_ + for_) {
      end(now, succeeded());
    } else if (!last_ && now >= heard_ + kSilence) {
      end(now, {Status::kFailed, fmt::format("no chunk came for {:.0f} s", to_s(kSilence)), detail()});
    }
    return {};
  }

  void cancel(Time now) override {
    const Progress cancelled{Status::kFailed, "cancelled", detail()};
    if (path_ && cell_.arm.operational() && !ending_) {
      end(now, cancelled);
    } else {
      finish(cancelled);
    }
  }

  // What comes in meanwhile is refused, as while the arm is stopped.
  bool may_rest(Time, task::Pause) override {
    if (ending_) return false;
    break_off();
    return true;
  }
  void go_on(Time now, Duration rested) override {
    if (first_chunk_) *first_chunk_ += rested;
    heard_ = now;
    cell_.stream = this;  // another may have had the arm meanwhile
  }

  // ---- the stream ----

  [[nodiscard]] std::uint64_t number() const override { return number_; }
  [[nodiscard]] const task::Json& arguments() const override { return arguments_; }

  [[nodiscard]] task::Observation observe(Time now) const override {
    const link::State& state = cell_.arm.state();
    task::Observation seen{.stamp = now,
                           .position = state.position,
                           .speed = state.speed,
                           .executed = executed_,
                           .objects = cell_.objects()};
    if (path_ && cell_.arm.operational()) {
      const Time motion = motion_time(now);
      seen.executed = path_->executed(motion);
      seen.enough = std::max(Duration{0}, path_->enough_until() - motion);
    }
    return seen;
  }

  [[nodiscard]] Expected<void> take(const Chunk& chunk, Time now) override {
    auto taken = splice(chunk, now);
    if (!taken) {
      ++refused_;
      last_refusal_ = taken.error().line();
      return taken;
    }
    ++chunks_;
    heard_ = now;
    if (!first_chunk_) first_chunk_ = now;
    last_ = chunk.last;
    total_ = last_ ? chunk.observed + static_cast<double>(chunk.actions.size()) : kEndless;
    return {};
  }

 private:
  // While the arm follows; stopped, it is late no longer, wherever its motion broke off.
  [[nodiscard]] Time motion_time(Time now) const { return now - cell_.arm.late(); }

  Expected<void> splice(const Chunk& chunk, Time now) {
    if (!path_ || ending_ || !cell_.arm.operational())
      return fail("no motion is taken now", "chunk_stopped", "wait until observe says that it goes on");
    if (chunk.observed < oldest_ - kRounding)
      return fail(fmt::format("it was observed at {:.1f} actions, before the arm was stopped", chunk.observed),
                  "chunk_stale", "observe again, and do not round what it answers");
    motion::ChunkPath next = *path_;
    auto way = next.splice(chunk, motion_time(now), motion_time(cell_.arm.splice_time(now)), cell_.limits_planned());
    if (!way) return std::unexpected(way.error());
    if (auto sent = send(*way); !sent) return sent;
    path_ = std::move(next);
    return {};
  }

  Expected<void> send(motion::Trajectory& way) {
    for (Segment& segment : way) segment.start += cell_.arm.late();
    if (!cell_.router.clear(way, way.front().start, way.back().end(), nullptr, cell_.objects()))
      return fail("the way is not clear", "chunk_not_clear", "keep away from what stands and comes along");
    return cell_.arm.stream(way);
  }

  // From rest, wherever that is.
  Progress begin(Time now) {
    if (ending_) return verdict_;
    if (now < cell_.arm.motion_end()) return {};
    const Time from = cell_.arm.splice_time(now);
    path_.emplace(cell_.arm.planned(from).position, motion_time(now), oldest_);
    executed_ = oldest_;
    counted_ = motion_time(now);
    heard_ = now;
    return {};
  }

  Progress stopped() {
    if (path_ && !ending_ && whole()) finish(succeeded());
    break_off();
    return ending_ ? verdict_ : Progress{};
  }

  // What was sent in before a stop must not move the arm after it, nor end the stream: who had said the last says the
  // rest again. So the numbers go on above all that can have been observed, but short of what nobody has seen executed:
  // within the action that was under way, and before the end.
  void break_off() {
    if (path_) {
      const bool got_on = executed_ > oldest_ + kRounding;
      const double next = std::min(std::floor(executed_ + motion::kSameProgress) + 1, total_);
      oldest_ = got_on ? (executed_ + next) / 2 : oldest_ + 4 * kRounding;
    }
    path_.reset();
    last_ = false;
  }

  void finish(Progress verdict) {
    ending_ = true;
    verdict_ = std::move(verdict);
  }

  void end(Time now, Progress verdict) {
    finish(std::move(verdict));
    motion::ChunkPath next = *path_;
    auto way = next.stop(motion_time(cell_.arm.splice_time(now)), cell_.limits_planned());
    // Without, the motion ends at rest where the last chunk does.
    if (!way) return;
    for (Segment& segment : *way) segment.start += cell_.arm.late();
    if (cell_.arm.stream(*way)) path_ = std::move(next);
  }

  void count_starved(Time now) {
    for (; counted_ < motion_time(now); counted_ += kTick) starved_ += path_->starved(counted_) ? 1 : 0;
  }

  [[nodiscard]] bool whole() const { return last_ && executed_ >= total_ - motion::kSameProgress; }
  // What is played slowly may be longer than what can be queued.
  [[nodiscard]] Progress too_slow() const {
    return {Status::kFailed, "the limits make the last chunk too slow to be queued whole", detail()};
  }
  [[nodiscard]] Progress succeeded() const { return {Status::kSucceeded, {}, detail()}; }
  [[nodiscard]] task::Json detail() const {
    task::Json told{{"policy", arguments_.at("policy")},
                    {"chunks", chunks_},
                    {"refused", refused_},
                    {"executed", static_cast<std::int64_t>(std::floor(executed_ + motion::kSameProgress))},
                    {"starved_ticks", starved_}};
    if (refused_ > 0) told["last_refusal"] = last_refusal_;
    return told;
  }

  Cell& cell_;
  const task::Json arguments_;
  const std::uint64_t number_;
  const Duration for_;
  std::optional<motion::ChunkPath> path_;  // not while the arm is stopped
  double executed_ = 0;                    // actions, when the arm was last seen to follow
  double oldest_ = 0;                      // observations of fewer actions were made before a stop
  Time counted_, heard_;
  std::optional<Time> first_chunk_;
  std::int64_t chunks_ = 0, refused_ = 0, starved_ = 0;
  std::string last_refusal_;
  bool last_ = false;        // the policy has said its last, and no stop has come since
  double total_ = kEndless;  // actions of the stream, as far as that is known
  bool ending_ = false;
  Progress verdict_;
};

}  // namespace

task::SkillType follow_policy(Cell& cell, const std::vector<std::string>& policies) {
  task::Json names = policies;
  names.push_back(kOutside);
  const auto number = [](double least, double most) {
    return task::Json{{"type", "number"}, {"minimum", least}, {"maximum", most}};
  };
  return {.name = "follow_policy",
          .summary = "Follow a policy that says, chunk after chunk, where the arm shall be",
          .schema = {{"type", "object"},
                     {"properties",
                      {{"policy", {{"enum", names}}},
                       {"seconds", number(0.1, to_s(kLongestStream))},
                       {"object", {{"type", "string"}, {"minLength", 1}, {"maxLength", 64}}},
                       {"height_m", number(0.05, 0.5)},
                       {"rate_hz", number(0.2, 50)},
                       {"latency_s", number(0, 5)},
                       {"first_latency_s", number(0, 9)}}},
                     {"required", {"policy", "seconds"}},
                     {"additionalProperties", false}},
          .resources = {cell.world.arm},
          .timeout = kLongestStream + 2 * kSilence,
          .attempts = 1,
          .safe_points = {"anywhere on the path"},
          .start = [&cell](const task::Json& arguments, Time) {
            return conduct(cell, std::make_unique<FollowPolicy>(cell, arguments));
          }};
}

}  // namespace pons::skills
