#include "pons/skills/servo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
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

AxisVector values_of(const Json& positions) {
  AxisVector values(static_cast<Eigen::Index>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i) values[static_cast<Eigen::Index>(i)] = positions[i].get<double>();
  return values;
}

class FollowSetPoints final : public ArmSkill, public Servo {
 public:
  FollowSetPoints(Cell& cell, AxisVector first) : cell_(cell), first_(std::move(first)) { cell_.servo = this; }
  ~FollowSetPoints() override {
    if (cell_.servo == this) cell_.servo = nullptr;
  }
  FollowSetPoints(const FollowSetPoints&) = delete;
  FollowSetPoints& operator=(const FollowSetPoints&) = delete;

  // ---- the skill ----

  Progress tick(Time now) override {
    rests_ = false;
    if (!heard_) heard_ = now;
    if (!cell_.arm.operational()) {
      way_.clear();
      return verdict_ ? *verdict_ : silent(now) ? over("none came while the arm was stopped") : Progress{};
    }
    if (verdict_) return now < cell_.arm.motion_end() ? Progress{} : *verdict_;
    if (cell_.is_waited_for && cell_.is_waited_for()) return end(now, over("a task waits for the arm"));
    if (silent(now)) return end(now, over("nobody sends any"));
    if (first_) return begin(now);
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

  Expected<void> take(const AxisVector& position, Time now) override {
    if (first_ && !verdict_) {
      auto good = check_set_point(cell_, position);
      if (good) first_ = position, heard_ = now;
      return good;
    }
    auto taken = go_to(position, now);
    if (!taken) {
      ++refused_;
      return taken;
    }
    ++set_points_;
    heard_ = now;
    return {};
  }

 private:
  [[nodiscard]] bool silent(Time now) const { return now >= *heard_ + kServoSilence; }
  [[nodiscard]] Json detail() const { return {{"set_points", set_points_}, {"refused", refused_}}; }
  [[nodiscard]] Progress over(const char* why) const {
    Progress progress{Status::kSucceeded, {}, detail()};
    progress.detail["why"] = why;
    return progress;
  }

  Progress begin(Time now) {
    if (cell_.held) return {Status::kFailed, "the cups hold " + cell_.held->code, detail()};
    if (now < cell_.arm.motion_end()) return {};
    const AxisVector first = *std::exchange(first_, std::nullopt);
    const auto taken = take(first, now);
    return taken ? Progress{} : Progress{Status::kFailed, taken.error().line(), detail()};
  }

  Expected<void> go_to(const AxisVector& position, Time now) {
    if (verdict_ || rests_ || !cell_.arm.operational())
      return fail("the arm takes none now", "positions",
                  "wait until it is at rest, or `pons robot` says what it needs");
    if (auto good = check_set_point(cell_, position); !good) return good;
    const Time from = cell_.arm.splice_time(now);
    auto apart = apart_;
    if (set_points_ > 0) {
      std::ranges::rotate(apart, apart.begin() + 1);
      apart.back() = std::clamp(now - *heard_, kClosest, kFarthest);
    }
    auto way = motion::move(cell_.arm.planned(from), from, {position, AxisVector::Zero(position.size())},
                            cell_.limits_empty(), from_s(kLongerThanApart * to_s(*std::ranges::max_element(apart))));
    if (!way) return std::unexpected(way.error());
    if (auto clear = judge(*way, from); !clear) return clear;
    if (auto sent = cell_.arm.stream(*way); !sent) return sent;
    way_ = *std::move(way);
    apart_ = apart;
    looked_at_ = now;
    return {};
  }

  [[nodiscard]] Expected<void> judge(const motion::Trajectory& way, Time from) {
    return cell_.router.judge(way, from, std::min(from + kLookAhead, way.back().end()), nullptr, cell_.objects());
  }

  void look(Time now) {
    if (way_.empty() || now < looked_at_ + kLookEvery) return;
    looked_at_ = now;
    const auto clear = judge(way_, std::max(now, way_.front().start));
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
  std::optional<AxisVector> first_;  // until it is gone to
  std::optional<Time> heard_;        // the last one
  motion::Trajectory way_;           // under way
  // Between the last ones. The longest counts: two that a network has brought together are no haste.
  std::array<Duration, 3> apart_{kAtFirst, kAtFirst, kAtFirst};
  Time looked_at_;
  std::int64_t set_points_ = 0, refused_ = 0;
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
