#include "pons/skills/place.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "pons/core/gravity.hpp"
#include "pons/skills/conduct.hpp"
#include "pons/skills/grasp.hpp"
#include "pons/skills/scale.hpp"
#include "pons/task/json_value.hpp"
#include "pons/world/mouth.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr double kOverRim_m = 0.03;     // between rim and the parcel's underside when it is let go
constexpr double kTipOverRim_m = 0.10;  // at least: lower, the outer mouths are out of reach
constexpr double kHigher_m = 0.025;     // tried next when a mouth is out of reach
constexpr int kHeights = 5;
// Of the empty tool, for the question whether a mouth is within reach at all.
constexpr std::array kHeightsOverRim_m{kTipOverRim_m, kTipOverRim_m + 2 * kHigher_m, kTipOverRim_m + 4 * kHigher_m};
constexpr double kOverBelt_m = 0.36;                // of the tip, on a way in two parts
constexpr double kSofter_m = 0.015;                 // than the longest fall that is allowed: sizes are measured
constexpr double kMoreShare = 1.2, kMore_kg = 0.2;  // than was weighed: felt so much on the way,
constexpr int kMoreTicks = 5;                       // for so long, another hangs on it
constexpr double kFeltMost = 2;                     // times what is carried: more is a rim that holds it
constexpr int kStruckMost = 3;                      // times something may be struck on the way
constexpr Duration kLetGoEarly = std::chrono::milliseconds(15);
constexpr double kAside_m = 0.004;    // a load hangs beside where the cups were believed to hold it, at most
constexpr double kCups_nm_rad = 10;   // of the cups together: the wrist's moment for a load's lean, measured
constexpr double kSwings = 2.5;       // a lean when it is let go over the one it may fall in with,
constexpr double kSwingsTight = 1.5;  // and of what would jam: the lean that it swings to
constexpr double kStill_nm = 0.15;    // nothing hangs stiller than that
constexpr double kTight_rad = 0.10;   // may it lean less than that, it jams easily
constexpr double kFall_s = 0.1;       // from letting go to the rim
constexpr double kFresh = 0.5;        // share of a tick's reading in the rate of the swing
constexpr Duration kSwing = std::chrono::milliseconds(1500);       // at most,
constexpr Duration kSwingTight = std::chrono::milliseconds(4000);  // and for what would jam in the mouth
constexpr Duration kLetGoWithin = std::chrono::milliseconds(600);
constexpr Duration kTryEvery = std::chrono::milliseconds(40);
constexpr Duration kBlockedFor = std::chrono::milliseconds(400);
constexpr Duration kLookEvery = std::chrono::milliseconds(60);
constexpr Duration kNoReplanBefore = std::chrono::milliseconds(200);  // the end
constexpr Duration kRested = std::chrono::milliseconds(20);           // after the motion, before the wrist is believed
constexpr double kGoneShare = 0.4, kGoneLeast_kg = 0.08;              // of the load's mass, and at least
constexpr Duration kFallsWithin = std::chrono::milliseconds(1000);    // off a rim, too
constexpr Duration kTogether = std::chrono::milliseconds(400);        // falls what came along

constexpr const char* kCancelled = "cancelled; still held";

class Place final : public ArmSkill {
 public:
  Place(Cell& cell, std::string name, std::string object, Time now)
      : cell_(cell), name_(std::move(name)), object_(std::move(object)), started_(now), delay_(cell.arm) {}

  Progress tick(Time now) override {
    move_along(delay_.take());
    if (!let_go_.empty() && !cell_.held) return gone(now);
    if (phase_ == Phase::kFall) return fall_on(now);
    if (!cell_.arm.operational()) return stopped(now);
    stopped_ = false;
    switch (phase_) {
      case Phase::kPlan:
        return plan(now);
      case Phase::kCarry:
        return carry(now);
      case Phase::kRelease:
        return release(now);
      case Phase::kFall:
        break;
      case Phase::kHold:
        if (cell_.arm.cups().phase == link::VacuumPhase::kLost) return begin_fall(now, *cell_.held);
        return now < arrives_ ? Progress{} : Progress{Status::kFailed, why_held_, {}};
    }
    return {Status::kFailed, "unreachable", {}};
  }

  void cancel(Time now) override {
    cancelled_ = true;
    // It is over the mouth already, or on its way down.
    if (phase_ == Phase::kRelease || phase_ == Phase::kFall || phase_ == Phase::kHold) return;
    // What a stop has taken off the cups cannot be held: plan() says where it went.
    cell_.held ? hold(now, kCancelled) : plan_anew();
  }

  // With the parcel on the cups, the arm is nobody else's; over the mouth it is let go of first.
  bool may_rest(Time, task::Pause pause) override {
    if (pause == task::Pause::kHandOver || (phase_ != Phase::kPlan && phase_ != Phase::kCarry)) return false;
    plan_anew();
    return true;
  }
  void go_on(Time, Duration) override {
    tried_.reset();
    blocked_since_.reset();
  }

 private:
  enum class Phase : std::uint8_t { kPlan, kCarry, kRelease, kFall, kHold };

  // The cups hold through a stop: once the arm is armed again, a new way from where it rests. Where it strikes
  // something again and again, a mouth is jammed maybe; the next collision could be one that only a person leads out
  // of.
  Progress stopped(Time now) {
    plan_anew();
    if (cancelled_ && !cell_.held) return plan(now);
    if (cancelled_) return {Status::kFailed, kCancelled, {}};
    if (!std::exchange(stopped_, true) && cell_.arm.has_struck()) ++times_struck_;
    return {};
  }

  void plan_anew() {
    phase_ = Phase::kPlan;
    search_ = halfway_search_ = {};
  }

  void hold(Time now, std::string why) {
    if (cell_.stop(now)) arrives_ = cell_.arm.motion_end();
    why_held_ = std::move(why);
    phase_ = Phase::kHold;
  }

  void move_along(Duration later) {
    arrives_ += later;
    if (halfway_at_) *halfway_at_ += later;
    for (Segment& segment : way_) segment.start += later;
  }

  Progress plan(Time now) {
    if (!cell_.held && cell_.lost && cell_.lost->code == object_) return begin_fall(now, *cell_.lost);
    if (!cell_.held) return {Status::kFailed, "nothing is held", {}};
    if (!object_.empty() && cell_.held->code != object_) {
      return {Status::kFailed, fmt::format("the cups hold {}, not {}", cell_.held->code, object_), {}};
    }
    if (!cell_.held->alone) return {Status::kFailed, "another hangs on " + cell_.held->code, {}};
    if (cell_.held->doubtful) return {Status::kFailed, "it may be another: nobody has seen it", {}};
    if (times_struck_ >= kStruckMost)
      return {Status::kFailed, fmt::format("{}: struck something {} times on the way", name_, times_struck_), {}};
    const world::Place* target = cell_.world.place(name_);
    if (target == nullptr) return {Status::kFailed, "no place '" + name_ + "' in this world", {}};
    if ((tried_ && now - *tried_ < kTryEvery) || (halfway_at_ && now < *halfway_at_)) return {};
    if (const auto set_out = carry_to(*target, now); !set_out) {
      if (cell_.router.spent()) return {};
      tried_ = now;
      // Others may be in the way, and ride on.
      if (!blocked_since_) blocked_since_ = now;
      cell_.keep_clear(now);
      if (now < *blocked_since_ + kBlockedFor || go_halfway(*target, now)) return {};
      return {Status::kFailed, name_ + ": " + set_out.error().line(), {}};
    }
    blocked_since_.reset();
    looked_at_ = now;
    scale_ = {};
    more_ticks_ = 0;
    phase_ = Phase::kCarry;
    return {};
  }

  // Where that fails, whatever was under way stays so.
  Expected<void> carry_to(const world::Place& target, Time now) {
    world::Entry entry;
    auto way = cell_.carry(now, [&](const AxisVector& from) { return over(target, from, entry); }, search_);
    if (!way) return std::unexpected(way.error());
    if (auto sent = cell_.arm.stream(*way); !sent) return sent;
    way_ = std::move(*way);
    arrives_ = way_.back().end();
    entry_ = entry;
    let_go_.clear();
    cell_.note("plan",
               {{"to", "carry"}, {"place", name_}, {"mass_kg", cell_.held->mass_kg}, {"arrives_s", arrives_.s()}});
    return {};
  }

  // Something wide comes by the arm's own links on a long way; from the middle of the belt there is another. Once.
  bool go_halfway(const world::Place& target, Time now) {
    if (halfway_at_) return false;
    const world::Belt& belt = cell_.world.belt;
    const auto halfway = [&](const AxisVector& from) -> Expected<AxisVector> {
      const Pose tip = cell_.model.world_from_tip(from);
      const Vector3 point(0.5 * (tip.translation().x() + target.center_m.x()), belt.y_center_m,
                          std::max(tip.translation().z(), belt.surface_z_m + kOverBelt_m));
      return cell_.model.inverse(Cell::tip_down(point, yaw_of(tip.linear())), from);
    };
    const auto way = cell_.carry(now, halfway, halfway_search_);
    if (!way || !cell_.arm.stream(*way)) return cell_.router.spent();
    halfway_at_ = way->back().end();
    blocked_since_.reset();
    return true;
  }

  // What was upstream of the cameras' view when the way was planned may stand in it.
  void look_out(Time now) {
    if (now < looked_at_ + kLookEvery || now + kNoReplanBefore > arrives_) return;
    looked_at_ = now;
    const Time from = cell_.arm.splice_time(now);
    if (cell_.router.clear(way_, from, arrives_, &cell_.held->load, cell_.objects())) return;
    (void)carry_to(*cell_.world.place(name_), now);  // if there is no way, the one under way is as good as any
  }

  // Over the middle of the mouth, turned as one goes in; which of the turns, the arm decides.
  Expected<AxisVector> over(const world::Place& target, const AxisVector& from, world::Entry& chosen) {
    const Vector3& size = cell_.held->load.size_m;
    std::vector<world::Entry> entries = world::ways_in(size, target);
    if (entries.empty()) entries = world::ways_in(size, target, world::kMisjudged_m);
    if (entries.empty()) return fail(fmt::format("too large for its mouth: {:.2f} x {:.2f} m", size.x(), size.y()));
    // The more it leans the higher it is let go, and the deeper it falls.
    for (const world::Entry& entry : entries) {
      for (int height = 0; height < kHeights; ++height) {
        const double tip_z = height_over(target, entry.lean_rad) + kHigher_m * height;
        const double drop_m = tip_z - size.z() - (target.center_m.z() - target.size_m.z());
        if (entry.lean_rad > 0 && drop_m > cell_.world.rules.max_drop_m - kSofter_m) break;
        auto q = nearest(target, entry, tip_z, from);
        if (!q) continue;
        chosen = entry;
        return q;
      }
    }
    return fail("out of reach");
  }

  // Of the tip, at least, to let go over the rim.
  [[nodiscard]] double height_over(const world::Place& target, double tilt) const {
    const Vector3& size = cell_.held->load.size_m;
    const double underside_m = size.z() * std::cos(tilt) + 0.5 * size.x() * std::sin(tilt);
    return target.center_m.z() + std::max(kTipOverRim_m, kOverRim_m + underside_m);
  }

  // How far the tool leans so that the load does: its weight, half its height off the axis, bends the cups back.
  [[nodiscard]] double tool_lean(double lean_rad) const {
    const double sag_nm = cell_.held->mass_kg * kGravity_m_s2 * 0.5 * cell_.held->load.size_m.z() * std::sin(lean_rad);
    return lean_rad + sag_nm / kCups_nm_rad;
  }

  Expected<AxisVector> nearest(const world::Place& target, const world::Entry& entry, double tip_z,
                               const AxisVector& from) {
    const Load& load = cell_.held->load;
    const Vector3 tip(target.center_m.x(), target.center_m.y(), tip_z);
    const double lean_rad = tool_lean(entry.lean_rad);
    const Eigen::AngleAxisd tip_from_load(load.yaw_in_tip_rad, Vector3::UnitZ());
    Expected<AxisVector> best = fail("out of reach");
    double least = 0;
    for (int turn = 0; turn < 8; ++turn) {
      const double yaw =
          load.yaw_in_tip_rad + 0.5 * std::numbers::pi * ((turn % 4) + (entry.across_corners ? 0.5 : 0.0));
      Pose pose = Cell::tip_down(tip, yaw);
      pose.rotate(Eigen::AngleAxisd(turn < 4 ? lean_rad : -lean_rad, tip_from_load * Vector3::UnitY()));
      // The middle of the load, not of its top face, over the middle of the mouth.
      const Vector3 middle = pose.linear() * (load.offset_in_tip_m + Vector3(0, 0, 0.5 * load.size_m.z()));
      pose.translation().head<2>() -= middle.head<2>();
      const auto q = cell_.model.inverse(pose, from);
      if (!q) continue;
      const double turned = cell_.effort(from, *q);
      if (best && turned >= least) continue;
      best = q;
      least = turned;
    }
    return best;
  }

  Progress carry(Time now) {
    if (cell_.arm.cups().phase == link::VacuumPhase::kLost) return begin_fall(now, *cell_.held);
    look_out(now);
    if (const auto felt_kg = feels_more()) {
      const std::string why = fmt::format("another hangs on {}: {:.2f} kg are felt where {:.2f} were weighed",
                                          cell_.held->code, *felt_kg, cell_.held->mass_kg);
      cell_.held->alone = false;
      cell_.strays->felt(cell_.held->code);
      cell_.weighs(std::min(*felt_kg, kFeltMost * cell_.world.rules.max_mass_kg));
      hold(now, why);
      return {};
    }
    const bool tight = may_lean() < kTight_rad, level = hangs_level(now, tight);
    if (now < (level && !tight ? arrives_ - kLetGoEarly : arrives_)) return {};
    if (!level && now < arrives_ + (tight ? kSwingTight : kSwing)) return {};
    cell_.arm.vacuum(false);
    let_go_ = cell_.held->code;
    cell_.strays->let_go(cell_.held->code, name_, now);
    cell_.mouths.expect_at(name_, let_go_, now);
    cell_.arm.expect_contact(kHandling_n);
    arrives_ = std::max(arrives_, now);
    phase_ = Phase::kRelease;
    return {};
  }

  // Who hangs on it with an edge on the belt weighs nothing on the scale, and is felt only when he comes off.
  std::optional<double> feels_more() {
    scale_.add(cell_);
    const double weighed_kg = cell_.held->mass_kg;
    const auto felt = scale_.weigh(cell_, weighed_kg);
    const bool more = felt && felt->mass_kg > kMoreShare * weighed_kg + kMore_kg;
    more_ticks_ = more ? more_ticks_ + 1 : 0;
    return more_ticks_ < kMoreTicks ? std::nullopt : std::optional(felt->mass_kg);
  }

  // A bridge that comes after this one in the middle of it must know of it, too: until it is told, it is `lost`.
  Progress begin_fall(Time now, Held load) {
    fallen_ = std::move(load);
    cell_.arm.vacuum(false);
    if (cell_.held) {
      cell_.lost = fallen_;
      cell_.lost_at = now;
      cell_.dropped();
    }
    cell_.mouths.expect_anywhere(now);
    fell_at_ = now;
    phase_ = Phase::kFall;
    return fall_on(now);
  }

  Progress fall_on(Time now) {
    Progress progress = fall(now);
    if (task::is_end(progress.status)) cell_.lost.reset();
    return progress;
  }

  // The mouths' light curtains tell into which it went, and the journal whom to send there. What lies on the belt again
  // is seen again.
  Progress fall(Time now) {
    task::Json detail{{"place", name_}, {"object", fallen_.code}};
    if (const auto chutes = cell_.mouths.fallen_since(fallen_.falls); !chutes.empty()) {
      cell_.await_no_more(fallen_.code);
      cell_.mouths.expect_anywhere(now);  // another may have come along
      counted_ += static_cast<int>(chutes.size());
      fallen_.falls = cell_.falls();
      for (const world::Place* const chute : chutes) count(*chute, now);
    }
    if (into_ != nullptr) {
      if (now < counted_at_ + kTogether) return {};
      cell_.strays->let_go(fallen_.code, into_->name, now);
      const bool is_it = fallen_.alone || counted_ > 1;  // else it may be who was felt to hang on it
      if (into_->name == name_ && is_it) return {Status::kSucceeded, "let go early", std::move(detail)};
      detail["fell_into"] = into_->name;
      if (!is_it) return {Status::kException, "it or what hung on it fell into " + into_->name, std::move(detail)};
      return {Status::kException, "fell into " + into_->name, std::move(detail)};
    }
    if (cell_.awaits(fallen_.code)) return look_for_it(now);
    if (now < fell_at_ + kFallsWithin) return {};
    // On a rim, maybe, off which it falls later: then a mouth's curtain counts what nobody let go of.
    cell_.mouths.expect_no_more();
    cell_.strays->dropped(cell_.world.arm, fallen_.code, now);
    return {Status::kFailed, "dropped", std::move(detail)};
  }

  // Of two counts that of its own mouth is its own, else the last; the other is that of one that came along, or lay on
  // a rim.
  void count(const world::Place& chute, Time now) {
    const bool own_before = into_ != nullptr && into_->name == name_;
    if (into_ != nullptr) cell_.strays->fell(cell_.world.arm, own_before ? chute.name : into_->name, now);
    if (!own_before) into_ = &chute;
    counted_at_ = now;
  }

  // On the belt, where it is asked for again once it is seen.
  Progress look_for_it(Time now) {
    cell_.hold_belt(now);
    if (cell_.arm.operational()) aside_ = aside_ || cell_.step_aside(now);
    return {};
  }

  // From the vertical, in radians, and still fall through the mouth: its lower edges move aside with its height.
  [[nodiscard]] double may_lean() const {
    const Vector3& size = cell_.held->load.size_m;
    const double mouth_m = cell_.world.place(name_)->size_m.head<2>().minCoeff();
    const double across_m = entry_.across_corners ? (size.x() + size.y()) / std::numbers::sqrt2
                            : entry_.lean_rad > 0 ? size.y()
                                                  : std::max(size.x(), size.y());
    return std::max(0.0, 0.5 * (mouth_m - across_m) - kAside_m) / std::max(kAside_m, size.z());
  }

  // The cups are springs, and the load swings on them: will it be level when it has fallen to the rim? It keeps turning
  // as it turned when it was let go. What hardly passes must hang still, too: how it turns is known roughly.
  bool hangs_level(Time now, bool tight) {
    const auto& torque = cell_.arm.state().wrist_torque_nm;
    const Eigen::Vector2d felt_nm(torque[0], torque[1]);
    if (now > felt_at_) turns_nm_s_ += kFresh * ((felt_nm - felt_nm_) / to_s(now - felt_at_) - turns_nm_s_);
    felt_nm_ = felt_nm;
    felt_at_ = now;
    const double may_nm = std::max(kStill_nm, kCups_nm_rad * may_lean());
    // kFall_s is about what a swing takes by one radian.
    const bool still = tight ? std::hypot(felt_nm.norm(), kFall_s * turns_nm_s_.norm()) <= kSwingsTight * may_nm
                             : felt_nm.norm() <= kSwings * may_nm;
    return still && (felt_nm + kFall_s * turns_nm_s_).norm() <= may_nm;
  }

  Progress release(Time now) {
    if (now < arrives_ + kRested || !cell_.arm.cups().open) return late(now);
    const double felt_kg = weigh_now(cell_);
    if (felt_kg > std::max(kGoneLeast_kg, kGoneShare * cell_.held->mass_kg)) return late(now);
    cell_.holds_nothing();
    return gone(now);
  }

  // Let go of over its mouth, whether a stop came then or not.
  Progress gone(Time now) {
    cell_.await_no_more(let_go_);
    if (cell_.lost && cell_.lost->code == let_go_) cell_.lost.reset();
    cell_.arm.expect_contact(0);
    return {Status::kSucceeded, {}, {{"place", name_}, {"object", let_go_}, {"seconds", to_s(now - started_)}}};
  }

  Progress late(Time now) {
    if (now < arrives_ + kLetGoWithin) return {};
    return {Status::kFailed, fmt::format("does not let go: the wrist still feels {:.2f} kg", weigh_now(cell_)), {}};
  }

  Cell& cell_;
  std::string name_, object_;
  std::string let_go_;  // what the cups were told to let go of over the mouth
  Time started_, arrives_, looked_at_;
  Delay delay_;
  motion::Trajectory way_;
  Phase phase_ = Phase::kPlan;
  Eigen::Vector2d felt_nm_ = Eigen::Vector2d::Zero(), turns_nm_s_ = Eigen::Vector2d::Zero();
  Time felt_at_;
  std::optional<Time> tried_, blocked_since_, halfway_at_;
  Cell::Search search_, halfway_search_;
  world::Entry entry_;
  Held fallen_;                         // what the cups lost on the way
  const world::Place* into_ = nullptr;  // the chute whose curtain counted it last
  Time counted_at_, fell_at_;
  int counted_ = 0;  // that fell since its load was lost
  bool cancelled_ = false, aside_ = false, stopped_ = false;
  int times_struck_ = 0, more_ticks_ = 0;
  Scale scale_;
  std::string why_held_;
};

// Beside the arm: what the place has, or any place may have that the arguments may come to name.
std::vector<std::string> held_for(const Cell& cell, const task::Json& arguments) {
  const std::string name = task::text_of(arguments, "place");
  std::vector<std::string> held;
  for (const world::Place& place : cell.world.places) {
    if (!place.resource.empty() && (name.empty() || place.name == name)) held.push_back(place.resource);
  }
  return held;
}

}  // namespace

task::SkillType place(Cell& cell) {
  for (const std::string& name : cell.world.place_names()) cell.reach.foresee(name, kHeightsOverRim_m);
  return {.name = "place",
          .summary = "Carry what the cups hold to a place, let go, and make sure that it left",
          .schema = {{"type", "object"},
                     {"properties",
                      {{"place", {{"enum", cell.world.place_names()}}},
                       {"object", {{"type", "string"}, {"minLength", 1}, {"maxLength", 64}}}}},
                     {"required", {"place"}},
                     {"additionalProperties", false}},
          .resources = {cell.world.arm},
          .timeout = std::chrono::seconds(15),
          .attempts = 3,
          .safe_points =
              {"anywhere on the way, with the parcel on the cups; nobody else gets the arm before it is let go of"},
          .feasible = [&cell](const task::Json& arguments, task::Moment moment) -> Expected<void> {
            const auto place = arguments.at("place").get<std::string>();
            if (auto good = cell.reach.over(place, kHeightsOverRim_m); !good) return good;
            // Once it is on the cups, its size is what was measured there.
            if (moment != task::Moment::kAdmission || !arguments.contains("object")) return {};
            return passes(cell.find(arguments.at("object").get<std::string>()), cell.world.place(place));
          },
          .holds = [&cell](const task::Json& arguments) { return held_for(cell, arguments); },
          .chance =
              [&cell](const task::Json& arguments) {
                const std::vector<std::string> held = held_for(cell, arguments);
                const bool free = std::ranges::none_of(held, [&](const std::string& zone) { return cell.taken(zone); });
                return free ? task::Chance::kNow : task::Chance::kNotYet;
              },
          .start =
              [&cell](const task::Json& arguments, Time now) {
                return conduct(cell, std::make_unique<Place>(cell, arguments.at("place").get<std::string>(),
                                                             arguments.value("object", std::string{}), now));
              }};
}

}  // namespace pons::skills
