#include "pons/skills/timed_way.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "pons/skills/conduct.hpp"

namespace pons::skills {
namespace {

using motion::TimedPoint;
using task::Json;
using task::Progress;
using task::Status;

constexpr Duration kLookPiece = std::chrono::milliseconds(400);   // of the way, in one tick
constexpr Duration kLookEvery = std::chrono::milliseconds(100);   // while it goes, so far ahead:
constexpr Duration kLookAhead = std::chrono::milliseconds(1000);  // longer than the arm takes to stop
constexpr double kSettleWithin_s = 0.5;                           // after the end of a motion whose times are kept
constexpr double kBroughtOn_s = 1.0;                              // at most, along its way, by being stopped;
constexpr double kOnTheWay_rad = 0.3;                             // further off it has been elsewhere
constexpr double kStep_s = 0.01;
constexpr Duration kSearchFor = std::chrono::milliseconds(1000);  // the way back to it
constexpr double kFirstLeg_s = 0.02;                              // of a way that goes on, at least
// What a load needs longer is felt for, in ever longer steps: to ten times as long.
constexpr int kLoadRounds = 12;
constexpr double kLeastMore = 0.02, kMostLonger = 1.5;
constexpr int kTold = 10;             // notes of how far it has got
constexpr double kBegins_rad = 0.01;  // off where it has to rest, at most: MoveIt's own bound

// As a person is told it: not less than it takes.
double up_to_hundredths(double seconds) { return std::ceil(100 * seconds - 1e-9) / 100; }

class FollowTimed final : public ArmSkill {
 public:
  FollowTimed(Cell& cell, Expected<TimedWay> asked) : cell_(cell), asked_(std::move(asked)), delay_(cell.arm) {
    if (asked_) points_ = asked_->points;
  }

  Progress tick(Time now) override {
    const Duration later = delay_.take();
    begins_ += later;
    for (Segment& segment : sent_) segment.start += later;
    if (!asked_) return {Status::kFailed, asked_.error().line(), {}};
    if (!cell_.arm.operational()) {
      if (verdict_) return *verdict_;
      break_off();
      return {};
    }
    switch (phase_) {
      case Phase::kPlan:
        return plan(now);
      case Phase::kLook:
        return look(now);
      case Phase::kMove:
        return move(now);
      case Phase::kSettle:
        return settle(now);
      case Phase::kStop:
        return now < cell_.arm.motion_end() ? Progress{} : *verdict_;
    }
    return {Status::kFailed, "unreachable", {}};
  }

  void cancel(Time now) override { stop(now, {Status::kFailed, "cancelled", detail(now)}); }

  // What the cups hold nobody else could place.
  bool may_rest(Time, task::Pause pause) override {
    if (phase_ == Phase::kSettle || phase_ == Phase::kStop) return false;
    if (pause == task::Pause::kHandOver && cell_.held) return false;
    break_off();
    return true;
  }
  void go_on(Time, Duration) override {}

 private:
  enum class Phase : std::uint8_t { kPlan, kLook, kMove, kSettle, kStop };

  [[nodiscard]] std::size_t first_number() const { return asked_->begins ? 2 : 1; }
  [[nodiscard]] std::string axis_name(Eigen::Index axis) const {
    return cell_.model.axis_names()[static_cast<std::size_t>(axis)];
  }
  [[nodiscard]] const Load* load() const { return cell_.held ? &cell_.held->load : nullptr; }
  [[nodiscard]] double whole_s() const { return to_s(way_.back().end() - Time{}); }
  [[nodiscard]] double progress() const {
    return way_.empty() ? 0 : told_before_ + (1 - told_before_) * std::clamp(done_s_ / whole_s(), 0.0, 1.0);
  }
  [[nodiscard]] task::Json detail(Time now) const {
    return {{"points", asked_ ? asked_->points.size() : 0},
            {"progress", progress()},
            {"took_s", began_ ? to_s(now - *began_) : 0.0},
            {"longer_s", longer_s_},
            {"worst_rad", worst_rad_}};
  }

  // ---- from rest ----

  Progress plan(Time now) {
    if (now < cell_.arm.motion_end()) return {};
    const AxisVector start = cell_.arm.planned(cell_.arm.splice_time(now)).position;
    if (began_ && off_way(start) > kOnTheWay_rad) return go_back(now);
    if (!began_ && asked_->begins) {
      if (auto there = check_begin(start); !there) return {Status::kFailed, there.error().line(), detail(now)};
    }
    const motion::InTime make = [&](std::span<const TimedPoint> points) { return asked_->make(start, points); };
    std::vector<TimedPoint> points = rest_from(start);
    auto way = make(points);
    if (!way) return {Status::kFailed, way.error().line(), detail(now)};
    auto possible = give_enough(points, make);
    if (!possible) return {Status::kFailed, possible.error().line(), detail(now)};
    const double longer_s = possible->back().time_s - points.back().time_s;
    if (!began_ && longer_s > asked_->goal_time_tolerance_s.value_or(0))
      return {Status::kFailed, too_quick(points, *way, *possible), detail(now)};
    if (longer_s > 0) way = make(*possible);
    if (!began_) longer_s_ = longer_s;
    points_ = *std::move(possible);
    way_ = *std::move(way);
    told_before_ = progress_;
    done_s_ = 0;
    looked_ = Time{};
    phase_ = Phase::kLook;
    return look(now);
  }

  [[nodiscard]] Expected<void> check_begin(const AxisVector& start) const {
    Eigen::Index axis = 0;
    const double off = (start - *asked_->begins).cwiseAbs().maxCoeff(&axis);
    if (off <= kBegins_rad) return {};
    return fail(fmt::format("{} rests at {:.4f} rad, {:.4f} rad off point 1, of which {:.2f} are allowed",
                            axis_name(axis), start[axis], off, kBegins_rad),
                {}, "plan from where the arm is");
  }

  // Somebody else has had the arm: to where the way was left, as fast as can be.
  Progress go_back(Time now) {
    const AxisVector left = motion::sample(way_, Time(from_s(done_s_)), cell_.model.axes()).position;
    const Time from = cell_.arm.splice_time(now);
    const auto way = cell_.held
                         ? cell_.carry(
                               now, [&](const AxisVector&) -> Expected<AxisVector> { return left; }, search_)
                         : cell_.router.route(cell_.arm.planned(from), from, {left, AxisVector::Zero(left.size())},
                                              nullptr, cell_.objects(), cell_.limits_empty(), &search_.known);
    if (!back_since_) back_since_ = now;
    if (!way && cell_.router.spent() && now < *back_since_ + kSearchFor) return {};
    if (!way) return {Status::kFailed, "the arm was taken off its way, and " + way.error().line(), detail(now)};
    if (auto sent = cell_.arm.stream(*way); !sent) return {Status::kRetry, sent.error().line(), detail(now)};
    search_ = {};
    back_since_.reset();
    return {};
  }

  // All of it once; then it is sent.
  Progress look(Time now) {
    const Time begin = cell_.arm.splice_time(now);
    motion::Trajectory way = way_;
    for (Segment& segment : way) segment.start += begin - Time{};
    const Time end = way_.back().end(), until = std::min(looked_ + kLookPiece, end);
    const auto clear =
        cell_.router.judge(way, begin + (looked_ - Time{}), begin + (until - Time{}), load(), cell_.objects());
    if (!clear) return {Status::kFailed, clear.error().line(), detail(now)};
    looked_ = until;
    if (looked_ < end) return {};
    if (auto sent = cell_.arm.stream(way); !sent) return {Status::kRetry, sent.error().line(), detail(now)};
    cell_.note(
        "plan",
        {{"to", "follow"}, {"points", points_.size()}, {"arrives_s", way.back().end().s()}, {"longer_s", longer_s_}});
    sent_ = std::move(way);
    begins_ = begin;
    if (!began_) began_ = begin;
    looked_at_ = now;
    phase_ = Phase::kMove;
    return {};
  }

  // ---- on the way ----

  Progress move(Time now) {
    const link::State& state = cell_.arm.state();
    done_s_ = std::clamp(to_s(now - begins_), 0.0, whole_s());
    Eigen::Index axis = 0;
    const double off_rad = (cell_.arm.planned(state.stamp).position - state.position).cwiseAbs().maxCoeff(&axis);
    worst_rad_ = std::max(worst_rad_, off_rad);
    tell();
    if (off_rad > asked_->path_tolerance_rad) {
      stop(now, {Status::kFailed,
                 fmt::format("path_tolerance_violated: {} is {:.4f} rad off its way, of which {:.4f} are allowed",
                             axis_name(axis), off_rad, asked_->path_tolerance_rad),
                 detail(now)});
      return {};
    }
    if (now >= sent_.back().end()) {
      phase_ = Phase::kSettle;
      return settle(now);
    }
    if (now < looked_at_ + kLookEvery) return {};
    looked_at_ = now;
    const Time from = std::max(now, sent_.front().start), until = std::min(from + kLookAhead, sent_.back().end());
    const auto clear = cell_.router.judge(sent_, from, until, load(), cell_.objects());
    if (!clear) stop(now, {Status::kFailed, clear.error().line(), detail(now)});
    return {};
  }

  Progress settle(Time now) {
    const Time end = sent_.back().end();
    const AxisVector planned = cell_.arm.planned(end).position;
    const auto arrived = asked_->arrived(cell_.arm.state().position, planned);
    if (arrived) return {Status::kSucceeded, {}, detail(now)};
    const double within_s =
        asked_->goal_time_tolerance_s ? *asked_->goal_time_tolerance_s - longer_s_ : kSettleWithin_s;
    if (now < end + from_s(within_s)) return {};
    return {Status::kFailed, "goal_tolerance_violated: " + arrived.error().line(), detail(now)};
  }

  void tell() {
    progress_ = progress();
    const int tenths = static_cast<int>(kTold * progress_ + 1e-9);
    if (tenths <= told_) return;
    told_ = tenths;
    cell_.note("progress", {{"share", static_cast<double>(tenths) / kTold}, {"worst_rad", worst_rad_}});
  }

  void stop(Time now, Progress verdict) {
    verdict_ = std::move(verdict);
    if (cell_.arm.operational() && now < cell_.arm.motion_end()) (void)cell_.stop(now);
    phase_ = Phase::kStop;
  }

  // ---- broken off ----

  void break_off() {
    search_ = {};
    back_since_.reset();
    phase_ = Phase::kPlan;
    sent_.clear();
  }

  // The points that are still to come, when the arm rests at q.
  [[nodiscard]] std::vector<TimedPoint> rest_from(const AxisVector& q) const {
    if (!began_ || way_.empty()) return points_;
    const double from_s = nearest(q).first;
    std::vector<TimedPoint> rest;
    std::ranges::copy_if(points_, std::back_inserter(rest), [&](const TimedPoint& p) { return p.time_s > from_s; });
    if (rest.empty()) rest.push_back(points_.back());
    const double shift_s = std::max(-from_s, kFirstLeg_s - rest.front().time_s);
    for (TimedPoint& point : rest) point.time_s += shift_s;
    return rest;
  }

  // Where on the way it rests: stopping has brought it on by a little. And how far off the way that is, rad.
  [[nodiscard]] std::pair<double, double> nearest(const AxisVector& q) const {
    std::pair<double, double> best{done_s_, std::numeric_limits<double>::infinity()};
    for (double s = done_s_; s <= std::min(done_s_ + kBroughtOn_s, whole_s()); s += kStep_s) {
      const AxisVector on = motion::sample(way_, Time(from_s(s)), q.size()).position;
      const double off = (on - q).cwiseAbs().maxCoeff();
      if (off < best.second) best = {s, off};
    }
    return best;
  }
  [[nodiscard]] double off_way(const AxisVector& q) const { return nearest(q).second; }

  // ---- times ----

  // The points at times in which axes, motors and what is held bear the motion.
  [[nodiscard]] Expected<std::vector<TimedPoint>> give_enough(const std::vector<TimedPoint>& points,
                                                              const motion::InTime& make) {
    const AxisLimits limits = cell_.limits_timed();
    auto given = motion::give_time(points, make, limits, first_number());
    for (int round = 0; given && cell_.held && round < kLoadRounds; ++round) {
      const auto way = make(*given);
      if (!way) return std::unexpected(way.error());
      const Cell::LoadUse use = cell_.load_use(*way);
      if (use.most <= 1) return given;
      if (use.slowly <= 1 && motion::limit_use(*way, limits).acceleration <= Cell::kSlowestShare) return given;
      motion::stretch(*given, std::clamp(std::sqrt(use.most), 1 + kLeastMore * (1 + 2 * round), kMostLonger));
    }
    if (given && cell_.held)
      return fail(fmt::format("{:.2f} kg come off the cups there, or are too heavy, however slowly it goes",
                              cell_.held->mass_kg),
                  {}, "keep the tool pointing down, or put it down before");
    return given;
  }

  [[nodiscard]] std::string too_quick(const std::vector<TimedPoint>& points, const motion::Trajectory& way,
                                      const std::vector<TimedPoint>& possible) const {
    const double given_s = points.back().time_s, takes_s = possible.back().time_s;
    std::string allowed;
    if (asked_->goal_time_tolerance_s)
      allowed = fmt::format("; all of it would take {:.2f} times as long, {:.2f} s more, of which {:.2f} s are allowed",
                            takes_s / given_s, up_to_hundredths(takes_s - given_s), *asked_->goal_time_tolerance_s);
    const auto beyond = motion::excesses(way, points, cell_.limits_timed());
    if (beyond.empty())
      return fmt::format("what the cups hold cannot be carried so quickly; take {:.2f} s for all of it, not {:.2f} s{}",
                         up_to_hundredths(takes_s), given_s, allowed);
    const motion::Excess& first = beyond.front();
    return fmt::format(
        "point {}: {} would need {:.2f} times its {} limit; reach it after {:.2f} s at the soonest, not {:.2f} s{}",
        first.point + first_number(), axis_name(first.axis), first.use, motion::name(first.of),
        up_to_hundredths(possible[first.point].time_s), points[first.point].time_s, allowed);
  }

  Cell& cell_;
  Expected<TimedWay> asked_;
  Delay delay_;
  Phase phase_ = Phase::kPlan;
  std::vector<TimedPoint> points_;  // of the way under way
  motion::Trajectory way_;          // from Time{} on
  motion::Trajectory sent_;         // the same, when it is followed
  Time begins_, looked_, looked_at_;
  std::optional<Time> began_;  // the first time
  double done_s_ = 0;          // of way_
  double progress_ = 0, told_before_ = 0;
  double longer_s_ = 0;  // than asked for, as it was planned from the begin
  double worst_rad_ = 0;
  int told_ = 0;
  Cell::Search search_;
  std::optional<Time> back_since_;  // the way back is searched
  std::optional<Progress> verdict_;
};

// A way that says where it begins is known before it begins, but where it may take longer than asked for, and would:
// that changes it between its points. Of others the skill alone can tell, which looks at all of the way, too.
Expected<void> looked_through(Cell& cell, const TimedWay& way, bool may_take_longer) {
  if (!way.begins || !cell.reach.anything_stands()) return {};
  const auto motion = way.make(*way.begins, way.points);
  if (!motion) return std::unexpected(motion.error());
  if (may_take_longer && !motion::excesses(*motion, way.points, cell.limits_timed()).empty()) return {};
  const auto touch = cell.reach.touches(*motion);
  if (!touch) return {};
  const auto next =
      std::ranges::find_if(way.points, [&](const TimedPoint& p) { return from_s(p.time_s) >= touch->at - Time{}; });
  const auto point = next - way.points.begin() + 1;  // the one before it: where it begins is point 1
  return fail(fmt::format("between point {} and point {}, {:.2f} s on the way, the arm touches what stands there ({})",
                          point, point + 1, to_s(touch->at - Time{}), touch->what),
              {}, "lead it around that");
}

}  // namespace

task::SkillType timed_skill(Cell& cell, TimedSkill skill) {
  skill.schema["properties"][kTimeTolerance] = {{"type", "number"}, {"minimum", 0}, {"maximum", kLongestWay_s}};
  return {.name = std::move(skill.name),
          .summary = std::move(skill.summary),
          .schema = std::move(skill.schema),
          .resources = {cell.world.arm},
          .timeout = from_s(2 * kLongestWay_s),
          .attempts = 1,
          .outputs = {"took_s", "longer_s", "worst_rad"},
          .safe_points = {"anywhere on the way; with something on the cups nobody else gets the arm there"},
          .feasible = [&cell, read = skill.read](const Json& arguments, task::Moment) -> Expected<void> {
            const auto way = read(cell, arguments);
            if (!way) return std::unexpected(way.error());
            return looked_through(cell, *way, arguments.contains(kTimeTolerance));
          },
          .start =
              [&cell, read = skill.read](const Json& arguments, Time) {
                auto way = read(cell, arguments);
                if (way && arguments.contains(kTimeTolerance))
                  way->goal_time_tolerance_s = arguments.at(kTimeTolerance);
                return conduct(cell, std::make_unique<FollowTimed>(cell, std::move(way)));
              }};
}

Expected<void> check_times(std::span<const TimedPoint> points, std::size_t first) {
  double before_s = 0;
  for (std::size_t k = first; k < points.size(); ++k) {
    const double time_s = points[k].time_s;
    if (!(time_s >= before_s + motion::kShortestLeg_s * (1 - 1e-6)))
      return fail(fmt::format("point {}: {} s is not at least {} s after {}", k + 1, time_s, motion::kShortestLeg_s,
                              k == first ? "the begin" : fmt::format("point {}, at {} s", k, before_s)),
                  {}, k == first ? "leave out where the arm already is" : "give times that grow");
    before_s = time_s;
  }
  if (!(before_s <= kLongestWay_s))
    return fail(fmt::format("the last point is due after {} s, which is too long", before_s), {},
                fmt::format("take at most {:.0f} s", kLongestWay_s));
  return {};
}

}  // namespace pons::skills
