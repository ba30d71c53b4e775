#include "pons/skills/servo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/skills/conduct.hpp"

namespace pons::skills {
namespace {

using task::Json;
using task::Progress;
using task::Status;

constexpr Duration kLookEvery = std::chrono::milliseconds(100);
constexpr Duration kLookAhead = std::chrono::milliseconds(1000);  // longer than the arm takes to stop
// Apart from one another as far as the motions are made for it, and before as many have come as are looked at.
constexpr Duration kClosest = std::chrono::milliseconds(20), kFarthest = std::chrono::seconds(2);
constexpr Duration kAtFirst = std::chrono::seconds(1);
constexpr double kLongerThanApart = 1.5;
constexpr Duration kRest = std::chrono::milliseconds(20);  // at the end of a motion: where it is to rest

AxisVector values_of(const Json& positions) {
  AxisVector values(static_cast<Eigen::Index>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i) values[static_cast<Eigen::Index>(i)] = positions[i].get<double>();
  return values;
}

class FollowSetPoints final : public ArmSkill, public Servo {
 public:
  FollowSetPoints(Cell& cell, AxisVector first) : cell_(cell), delay_(cell.arm), wish_(std::move(first)) {
    cell_.servo = this;
  }
  ~FollowSetPoints() override {
    if (cell_.servo == this) cell_.servo = nullptr;
  }
  FollowSetPoints(const FollowSetPoints&) = delete;
  FollowSetPoints& operator=(const FollowSetPoints&) = delete;

  // ---- the skill ----

  Progress tick(Time now) override {
    rests_ = false;
    move_along();
    if (!heard_) heard_ = now;
    if (!cell_.arm.operational()) {
      way_.clear();
      return verdict_ ? *verdict_ : silent(now) ? over("none came while the arm was stopped") : Progress{};
    }
    if (verdict_) return now < cell_.arm.motion_end() ? Progress{} : *verdict_;
    if (cell_.held) return {Status::kFailed, "the cups hold " + cell_.held->code, detail()};
    if (cell_.is_waited_for && cell_.is_waited_for()) return end(now, over("a task waits for the arm"));
    if (silent(now)) return end(now, over("nobody sends any"));
    // The first one from rest.
    if (wish_ && (set_points_ > 0 || now >= cell_.arm.motion_end())) (void)go(*std::exchange(wish_, std::nullopt), now);
    look(now);
    return {};
  }

  void cancel(Time now) override { end(now, {Status::kFailed, "cancelled", detail()}); }

  bool may_rest(Time, task::Pause) override {
    if (verdict_) return false;
    rests_ = true;
    way_.clear();
    return true;
  }
  void go_on(Time now, Duration) override { heard_ = now; }

  // ---- the set-points ----

  // One is planned for in a period; of those that come besides, the last is left for the next.
  Expected<void> take(const AxisVector& position, Time now) override {
    if (verdict_ || rests_ || !cell_.arm.operational())
      return fail("the arm takes none now", "positions",
                  "wait until it is at rest, or `pons robot` says what it needs");
    if (auto good = check_set_point(cell_, position); !good) return refused(good.error(), now);
    if (wish_ || planned_at_ == now) {
      wish_ = position, heard_ = now;
      return {};
    }
    return go(position, now);
  }

 private:
  [[nodiscard]] bool silent(Time now) const { return now >= *heard_ + kServoSilence; }
  [[nodiscard]] Json detail() const { return {{"set_points", set_points_}, {"refused", refused_}}; }
  [[nodiscard]] Progress over(const char* why) const {
    if (set_points_ == 0 && refused_ > 0) return {Status::kFailed, why_refused_, detail()};
    Progress progress{Status::kSucceeded, {}, detail()};
    progress.detail["why"] = why;
    return progress;
  }

  std::unexpected<Error> refused(const Error& why, Time now) {
    ++refused_;
    heard_ = now;
    why_refused_ = why.line();
    return std::unexpected(why);
  }

  Expected<void> go(const AxisVector& position, Time now) {
    const Time before = *heard_;
    if (auto gone = go_to(position, now); !gone) return refused(gone.error(), now);
    if (set_points_ > 0) {
      std::ranges::rotate(apart_, apart_.begin() + 1);
      apart_.back() = std::clamp(now - before, kClosest, kFarthest);
    }
    ++set_points_;
    heard_ = now;
    return {};
  }

  Expected<void> go_to(const AxisVector& position, Time now) {
    planned_at_ = now;
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const Duration longest = *std::ranges::max_element(apart_);
    // Slowed by a zone, or on its way to rest, it may be beyond what it is planned with.
    auto way = motion::move(state, from, {position, AxisVector::Zero(position.size())},
                            covering(cell_.limits_empty(), state), from_s(kLongerThanApart * to_s(longest)));
    if (!way) return std::unexpected(way.error());
    const Time end = way->back().end();
    if (auto clear = judge(*way, from, from + kLookAhead); !clear) return clear;
    if (auto clear = judge(*way, end - kRest, end); !clear) return clear;
    if (auto sent = cell_.arm.stream(*way); !sent) return sent;
    move_along();
    way_ = *std::move(way);
    looked_at_ = now;
    return {};
  }

  // The motion becomes later while a zone slows it.
  void move_along() {
    const Duration later = delay_.take();
    for (Segment& segment : way_) segment.start += later;
  }

  [[nodiscard]] Expected<void> judge(const motion::Trajectory& way, Time from, Time until) {
    return cell_.router.judge(way, from, std::min(until, way.back().end()), nullptr, cell_.objects());
  }

  void look(Time now) {
    if (way_.empty() || now < looked_at_ + kLookEvery) return;
    looked_at_ = now;
    const Time from = std::max(now, way_.front().start);
    const auto clear = judge(way_, from, from + kLookAhead);
    if (clear && now < way_.back().end()) return;
    way_.clear();
    if (clear) return;
    cell_.note("stopped", {{"by", "servo"}, {"cause", clear.error().line()}});
    (void)cell_.stop(now);
  }

  Progress end(Time now, Progress verdict) {
    verdict_ = std::move(verdict);
    way_.clear();
    if (cell_.arm.operational() && now < cell_.arm.motion_end()) (void)cell_.stop(now);
    return {};
  }

  Cell& cell_;
  Delay delay_;
  std::optional<AxisVector> wish_;  // until it is gone to
  std::optional<Time> heard_;       // of the last one
  motion::Trajectory way_;          // under way
  // Between the last ones. The longest counts: two that a network has brought together are no haste.
  std::array<Duration, 3> apart_{kAtFirst, kAtFirst, kAtFirst};
  std::optional<Time> planned_at_;
  Time looked_at_;
  std::int64_t set_points_ = 0, refused_ = 0;
  std::string why_refused_;  // the last one
  bool rests_ = false;
  std::optional<Progress> verdict_;
};

}  // namespace

Expected<void> check_set_point(Cell& cell, const AxisVector& position) {
  const AxisLimits limits = cell.limits_planned();
  const std::vector<std::string> names = cell.model.axis_names();
  if (position.size() != limits.position_min.size())
    return fail(fmt::format("{} positions for {} joints", position.size(), names.size()), "positions",
                "give one a joint, in the order of joint_states");
  for (Eigen::Index i = 0; i < position.size(); ++i) {
    if (position[i] >= limits.position_min[i] && position[i] <= limits.position_max[i]) continue;
    return fail(
        fmt::format("{} at {:.4f} rad is outside its limits, {:.4f} to {:.4f} rad", names[static_cast<std::size_t>(i)],
                    position[i], limits.position_min[i], limits.position_max[i]),
        "positions", "keep inside");
  }
  return cell.reach.stands_free(position, "the set-point");
}

task::SkillType servo(Cell& cell) {
  const Json positions{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 1}, {"maxItems", kMaxAxes}};
  return {.name = "servo",
          .summary = "Go after the set-points that somebody sends, until nobody does or a task waits for the arm",
          .schema = {{"type", "object"},
                     {"properties", {{"positions", positions}}},
                     {"required", {"positions"}},
                     {"additionalProperties", false}},
          .resources = {cell.world.arm},
          .timeout = std::chrono::hours(24),
          .attempts = 1,
          .outputs = {"why", "set_points", "refused"},
          .safe_points = {"anywhere, at rest"},
          .feasible = [&cell](const Json& arguments, task::Moment) -> Expected<void> {
            return check_set_point(cell, values_of(arguments.at("positions")));
          },
          .start =
              [&cell](const Json& arguments, Time) {
                return conduct(cell, std::make_unique<FollowSetPoints>(cell, values_of(arguments.at("positions"))));
              }};
}

}  // namespace pons::skills
