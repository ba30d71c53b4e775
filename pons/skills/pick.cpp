#include "pons/skills/pick.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/core/gravity.hpp"
#include "pons/skills/conduct.hpp"
#include "pons/skills/grasp.hpp"
#include "pons/skills/scale.hpp"
#include "pons/skills/set_down.hpp"
#include "pons/task/json_value.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr Duration kVacuumLead = std::chrono::milliseconds(40);   // before the contact
constexpr Duration kSealWithin = std::chrono::milliseconds(330);  // after it, while riding along
constexpr Duration kPressAfter = std::chrono::milliseconds(90);   // the contact, when too few cups have sealed
constexpr Duration kReplanEvery = std::chrono::milliseconds(60);
constexpr Duration kNoReplanBefore = std::chrono::milliseconds(120);  // ahead of the hover point
constexpr Duration kTryEvery = std::chrono::milliseconds(40);
constexpr double kWayRound_s = 0.6;  // what a way round what is in the way may take longer
constexpr Duration kBlockedFor = std::chrono::milliseconds(200), kUnseenFor = std::chrono::milliseconds(1000);
constexpr double kMoved_m = 0.0015;     // a prediction off by more is worth a new plan,
constexpr double kElsewhere_m = 0.015;  // and by so much, when it is too late for one, another try
constexpr double kDensity_kg_m3 = 150;  // of parcels, roughly: what the drives expect until then
// A load hangs on springs: lifted faster it bounces, and what bounces cannot be weighed.
constexpr double kLifted_m_s2 = 5.0;
constexpr double kLifted_m = 0.020;  // nothing below supports the load any more: the bellows stretch 12 mm at most
constexpr double kNearLimit = 0.15;  // of the mass limit: so near to it only a reading at rest decides
constexpr double kRetreat_m = 0.08;
constexpr double kHangsLow_m = 0.05;  // over where it was, what is too heavy: a corner hangs up to 35 mm lower
constexpr double kPutAside = 2.5;     // times as far from its neighbours as it was lifted: what is heavy swings,
constexpr double kHeavier = 1.5, kHeavier_kg = 1.5;     // felt while it is lifted, over what it was taken for
constexpr double kUnweighable = 2.0, kTogether = 1.35;  // times the mass limit: and what two may weigh
constexpr Duration kWeighAtMost = std::chrono::milliseconds(600);
constexpr Duration kWeighAtRest = std::chrono::milliseconds(160);  // after a lift: the readings since its end
constexpr Duration kUntangles = std::chrono::milliseconds(2000);
constexpr Duration kLookAgain = std::chrono::milliseconds(1500);
constexpr double kStops_m = 0.02;  // before where the belt waits, and so far before that it begins to stop

class Pick final : public ArmSkill {
 public:
  Pick(Cell& cell, std::string code, Time now)
      : cell_(cell), code_(std::move(code)), started_(now), seen_(now), set_down_(cell), delay_(cell.arm) {}

  Progress tick(Time now) override {
    move_along(delay_.take());
    if (!cell_.arm.operational()) {
      stopped_ = true;
      if (cell_.arm.has_struck()) cell_.struck(code_);
      return cancelled_ ? Progress{Status::kFailed, "cancelled while the arm was stopped", {}} : Progress{};
    }
    if (stopped_ && phase_ != Phase::kRetreat) {
      if (!cell_.held) return give_up(now, "the arm was stopped");
      cell_.missed = Miss{code_, now};
      return {Status::kRetry, "the arm was stopped", {}};
    }
    switch (phase_) {
      case Phase::kFind:
        return find(now);
      case Phase::kApproach:
        return approach(now);
      case Phase::kGrip:
        return grip(now);
      case Phase::kLift:
        return lift(now);
      case Phase::kSetDown:
        return set_down(now);
      case Phase::kRetreat:
        return retreat(now);
    }
    return {Status::kFailed, "unreachable", {}};
  }

  void cancel(Time now) override {
    cancelled_ = true;
    if (!cell_.arm.operational()) return;
    if (phase_ == Phase::kSetDown) {
      verdict_ = {Status::kFailed, "cancelled", {}};
    } else if (phase_ == Phase::kLift && cell_.held) {
      begin_put_back(now, kPutAside, {Status::kFailed, "cancelled", {}});
      if (phase_ != Phase::kSetDown) begin_retreat(now, {Status::kFailed, "cancelled; still held", {}});
    } else if (phase_ != Phase::kRetreat) {
      begin_retreat(now, {Status::kFailed, "cancelled", {}});
    }
  }

  // Until the cups set out for the last of the way down; from there on the parcel is taken first.
  bool may_rest(Time now, task::Pause) override {
    const bool on_the_way = phase_ == Phase::kApproach && now + kNoReplanBefore < grasp_.hover;
    if (stopped_ || (phase_ != Phase::kFind && !on_the_way) || cell_.held) return false;
    look_afresh(now);
    return true;
  }
  void go_on(Time now, Duration) override {
    seen_ = now;
    tried_.reset();
    blocked_since_.reset();
  }

 private:
  enum class Phase : std::uint8_t { kFind, kApproach, kGrip, kLift, kSetDown, kRetreat };

  // What was planned with the motion comes as much later as it does; approach() then finds the parcel further on.
  void move_along(Duration later) {
    for (Time* const moment : {&grasp_.hover, &grasp_.contact, &lift_end_, &rides_until_, &retreated_at_})
      *moment += later;
    for (Segment& segment : grasp_.trajectory) segment.start += later;
  }

  Progress find(Time now) {
    if (!cell_.world.robot.wrist_sensor)
      return {Status::kFailed, "the robot has no wrist sensor to weigh a load with: see robot.wrist_sensor", {}};
    cell_.keep_clear(now);
    // Its own task has ended, and tells of it no more; what was lost before this bridge lived, has been told.
    if (auto lost = std::exchange(cell_.lost, {}); lost && cell_.lost_at)
      cell_.strays->lost(cell_.world.arm, lost->code, *cell_.lost_at, now);
    if (cell_.held) {
      if (tried_ && now - *tried_ < kTryEvery) return {};
      tried_ = now;
      const bool wanted = cell_.held->code == code_;
      const auto put_down = not_as_it_hangs(cell_.world, *cell_.held);
      if (wanted && !put_down) return success(now);
      const Progress begun = begin_set_down(now, wanted ? *put_down : Progress{});
      return begun.status == Status::kRetry ? Progress{} : begun;  // what is in the way rides on
    }
    if (!cell_.lifts) return too_weak(cell_.world);
    const ObjectBelief* object = cell_.find(code_);
    if (object == nullptr) {
      step_aside(now);
      if (cell_.awaits(code_)) return cell_.hold_belt(now), Progress{};
      if (now - seen_ < kUnseenFor) return {};
      return not_there(cell_, code_);
    }
    seen_ = now;
    keep_in_reach(*object, now);
    const world::Belt& belt = cell_.world.belt;
    if (auto never = never_taken(cell_.world, *object)) return *std::move(never);
    if (must_look_again(*object, now)) return step_aside(now), Progress{};
    if (auto left = better_left(cell_, *object)) return *std::move(left);
    if (const auto other = tied_to(cell_, *object)) {
      if (!untangles(now)) return {Status::kFailed, *other, {}};
      return step_aside(now), Progress{};
    }
    // It comes no nearer, and the arm may hide what the belt waits for.
    if (cell_.belt_stands() && object->world_from_top.translation().x() < belt.pick_x_min_m)
      return step_aside(now), Progress{};
    if (tried_ && now - *tried_ < kTryEvery) return {};
    tried_ = now;
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const auto soonest = meet_straight(cell_, state, from, *object, std::nullopt);
    if (soonest && soonest->hover.x() + kWayRound_s * cell_.belt_speed_m_s() < belt.pick_x_min_m) return {};
    // Far beyond the zone there is no reaching it at all.
    const double met_x = soonest ? soonest->hover.x() : cell_.predict(*object, from + from_s(kWayRound_s)).x();
    if (comes_too_late(met_x)) return {};
    // One side of the parcel may have room for the wrist where another has a tall neighbour.
    std::optional<Eigen::Matrix3d> turned;
    if (soonest && quarters_ != 0)
      turned = Eigen::AngleAxisd(quarters_ * std::numbers::pi / 2, object->world_from_top.linear().col(2)) *
               soonest->orientation;
    auto grasp = plan_grasp(cell_, state, from, *object, turned, search_);
    if (!grasp) {
      if (cell_.router.spent()) return tried_.reset(), Progress{};
      ++quarters_;
      // Out of reach or near an axis' limit is a matter of waiting, between neighbours one of letting them go first.
      const bool rides = grasp.error().where == "motion" && cell_.belt_speed_m_s() > kStands_m_s;
      if (rides || object->world_from_top.translation().x() < belt.pick_x_min_m) return {};
      if (!blocked_since_) blocked_since_ = now;
      return now - *blocked_since_ < kBlockedFor ? Progress{} : Progress{Status::kFailed, grasp.error().line(), {}};
    }
    if (grasp->contact_point.x() < belt.pick_x_min_m) return wait_for(*object, *grasp, now);
    if (comes_too_late(grasp->contact_point.x())) return {};
    return start(*grasp, *object, now);
  }

  // The brain has the belt wait for what it sees; what was put back, nobody may see.
  void keep_in_reach(const ObjectBelief& object, Time now) {
    const double x_m = object.world_from_top.translation().x();
    if (cell_.was_hooked(code_) || cell_.world.belt.must_wait_for(x_m, cell_.belt_speed_m_s())) cell_.hold_belt(now);
  }

  // Then the belt waits for the arm, at the end of the zone; while it stops, nothing is met well.
  [[nodiscard]] bool comes_too_late(double x_m) const {
    return x_m > cell_.world.belt.waits_at_m() - kStops_m && cell_.belt_speed_m_s() > kStands_m_s;
  }

  // After a miss it may have been pushed, and the arm hides it: its place is a memory until a camera has seen it again.
  bool must_look_again(const ObjectBelief& object, Time now) {
    if (!cell_.missed || cell_.missed->code != code_) return false;
    const bool seen = object.last_seen > cell_.missed->time + kLookAgain / 3;
    const bool pointless = !cell_.in_view(object.world_from_top.translation().x());
    if (!seen && !pointless && now - cell_.missed->time < kLookAgain) return true;
    cell_.missed.reset();
    return false;
  }

  // What was put back lies as it lay: it only seems tied to its neighbour until arm and shadow have left the view.
  bool untangles(Time now) {
    if (!tangled_) tangled_ = now;
    return cell_.was_hooked(code_) && now < *tangled_ + kUntangles;
  }

  void step_aside(Time now) { aside_ = aside_ || cell_.step_aside(now); }
  // To where it was lifted from, which has moved on with the belt: what cannot be sorted so much farther from its
  // neighbours, and rides into the exception chute; what has another with it to the very place, on what it lay on.
  Progress begin_put_back(Time now, double aside, Progress verdict) {
    const Time from = cell_.arm.splice_time(now);
    if (from > rides_until_) return begin_set_down(now, std::move(verdict));  // another may be below by now
    Vector3 to = aside * lift_offset(cell_, target_) + *cell_.held->from_m;
    to.z() = cell_.held->from_m->z() + (cell_.held->mass_kg > cell_.world.rules.max_mass_kg ? kHangsLow_m : kPutBack_m);
    const auto top_z_m = aside == 0 ? std::optional(target_.world_from_top.translation().z()) : std::nullopt;
    if (auto begun = set_down_.begin_back(now, to, grasp_.orientation, top_z_m); !begun)
      return begin_set_down(now, std::move(verdict));
    verdict_ = std::move(verdict);
    phase_ = Phase::kSetDown;
    return {};
  }

  // What an earlier task left on the cups goes back on the belt where there is room.
  Progress begin_set_down(Time now, Progress verdict) {
    verdict_ = std::move(verdict);
    if (auto begun = set_down_.begin(now); !begun) return {Status::kRetry, begun.error().line(), {}};
    phase_ = Phase::kSetDown;
    return {};
  }

  Progress let_go_here(Time now, Progress verdict) {
    set_down_.begin_here(now, target_.world_from_top.translation().z());
    return verdict_ = std::move(verdict), phase_ = Phase::kSetDown, Progress{};
  }

  Progress set_down(Time now) {
    cell_.hold_belt(now);  // or what is behind it rides against it, and stays behind, perhaps where no camera sees it
    const auto laid = set_down_.tick(now);
    if (!laid) return {Status::kRetry, laid.error().line(), {}};
    if (!*laid) return {};
    if (verdict_.status == Status::kRetry) cell_.missed = Miss{code_, now};
    verdict_.status == Status::kRunning ? look_afresh(now) : begin_retreat(now, verdict_);
    return {};
  }

  void look_afresh(Time now) {
    phase_ = Phase::kFind;
    seen_ = now;
    search_ = {};
    waiting_ = aside_ = false;
  }

  // The parcel is still too far upstream: hang over the place where it will come within reach.
  Progress wait_for(const ObjectBelief& object, const Grasp& grasp, Time now) {
    if (waiting_) return {};
    const auto way = way_to_wait(cell_, object, grasp, now);
    if (way && cell_.arm.stream(*way)) waiting_ = true;
    return {};
  }

  Progress start(const Grasp& grasp, const ObjectBelief& object, Time now) {
    if (auto sent = cell_.arm.stream(grasp.trajectory); !sent) return {Status::kRetry, sent.error().line(), {}};
    cell_.note("plan", {{"to", "meet"},
                        {"object_m", task::list_of(object.world_from_top.translation())},
                        {"yaw_rad", yaw_of(object.world_from_top.linear())},
                        {"sigma_m", object.position_sigma_m},
                        {"seen_s", object.last_seen.s()},
                        {"meets_m", task::list_of(grasp.contact_point)},
                        {"meets_s", grasp.contact.s()}});
    grasp_ = grasp;
    target_ = object;
    planned_ = now;
    phase_ = Phase::kApproach;
    return {};
  }

  Progress approach(Time now) {
    if (const ObjectBelief* object = cell_.find(code_)) {
      keep_in_reach(*object, now);
      const Vector3 off = cell_.predict(*object, grasp_.contact) - grasp_.contact_point;
      const double moved_m = off.head<2>().norm();
      if (const auto other = tied_to(cell_, *object)) return give_up(now, *other);
      if (now + kNoReplanBefore >= grasp_.hover) {
        // The cups would take hold of its neighbour, too.
        if (moved_m > kElsewhere_m) return give_up(now, "it lies elsewhere than it seemed to");
      } else if (now - planned_ >= kReplanEvery) {
        replan(now, *object, moved_m);
      }
    } else if (cell_.disputed(code_)) {
      return give_up(now, "it shows two codes");
    }
    // On its last way down it may meet the parcel sooner than it seemed: that is no collision.
    if (now >= grasp_.hover) cell_.arm.expect_contact(kHandling_n);
    if (now + kVacuumLead >= grasp_.contact) {
      cell_.arm.vacuum(true);
      slip_ = {};
      phase_ = Phase::kGrip;
    }
    return {};
  }

  // When it lies elsewhere than was believed, or something else stands in the way.
  void replan(Time now, const ObjectBelief& object, double moved_m) {
    if (moved_m <= kMoved_m && cell_.router.clear(grasp_.trajectory, now, grasp_.hover, nullptr, cell_.objects()))
      return;
    const Time from = cell_.arm.splice_time(now);
    // A belief's yaw is known up to half a turn.
    const double turn = std::remainder(yaw_of(object.world_from_top.linear()) - yaw_of(target_.world_from_top.linear()),
                                       std::numbers::pi);
    const auto better = plan_grasp(cell_, cell_.arm.planned(from), from, object,
                                   Eigen::AngleAxisd(turn, Vector3::UnitZ()) * grasp_.orientation, search_);
    planned_ = now;
    if (better && better->contact_point.x() < cell_.world.belt.pick_x_max_m) {
      (void)start(*better, object, now);
    } else if (!better && moved_m > kElsewhere_m && !cell_.router.spent()) {
      begin_retreat(now, {});  // it will not come there, and what was to ride on by then may stand in the way
    }
  }

  Progress grip(Time now) {
    if (cell_.belt_speed_m_s() < kStands_m_s) cell_.hold_belt(now);  // what stands below the cups stays
    if (slip_.is_over(cell_, now >= grasp_.contact)) return give_up(now, "the belt is faster or slower than the cups");
    const link::Vacuum& cups = cell_.arm.cups();
    const bool enough =
        cups.phase == link::VacuumPhase::kSealed && cups.sealed_cups >= cell_.world.robot.tool.cups_to_lift;
    sealed_ticks_ = enough ? sealed_ticks_ + 1 : 0;
    const int all = static_cast<int>(cell_.world.robot.tool.cups_m.size());
    const int needed_ticks = cups.sealed_cups == all ? 1 : 3;
    if (now >= grasp_.contact && sealed_ticks_ >= needed_ticks) return begin_lift(now);
    if (now > grasp_.contact + kPressAfter && press_further(now)) return {};
    if (now > grasp_.contact + kSealWithin) {
      // It was not there, and no camera has seen it since another was taken from beside it.
      if (cups.sealed_cups == 0 && cell_.strays->missed_twice(code_))
        return begin_retreat(now, not_there(cell_, code_)), Progress{};
      cell_.felt_by_some(code_, grasp_.orientation);
      return give_up(now, fmt::format("{} of {} cups sealed", cups.sealed_cups, all));
    }
    return {};
  }

  // Lets go of what is not lifted.
  Progress give_up(Time now, std::string why) {
    cell_.missed = Miss{code_, now};
    begin_retreat(now, {Status::kRetry, std::move(why), {}});
    return {};
  }

  bool press_further(Time now) {
    const auto down = press_down(cell_, now, grasp_.orientation, presses_);
    if (!down || !cell_.arm.stream(down->trajectory)) return false;
    grasp_.contact = down->pressed;
    return true;
  }

  Progress begin_lift(Time now) {
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const Vector3 tip = cell_.model.world_from_tip(state.position).translation();
    const auto up = skills::lift(cell_, state, from, grasp_.orientation, lift_offset(cell_, target_), kLifted_m_s2);
    if (!up || !cell_.arm.stream(up->trajectory))
      return give_up(now, up ? "the link to the cerebellum is full" : up.error().line());
    lift_end_ = up->top;
    rides_until_ = up->rides_until;
    const ObjectBelief* const seen = cell_.find(code_);
    cell_.held = Held{.code = code_,
                      .load = load_of(target_, grasp_.orientation),
                      .company = company_of(seen != nullptr ? *seen : target_, cell_.objects(), grasp_.orientation),
                      .from_m = tip - cell_.belt_travel_m(from) * Vector3::UnitX(),
                      .falls = cell_.falls()};
    cell_.held->alone = cell_.held->company.empty();
    cell_.strays->lifted(cell_.world.arm, code_, cell_.held->company);
    cell_.lost.reset();
    expected_kg_ = std::min(cell_.world.rules.max_mass_kg, kDensity_kg_m3 * cell_.held->load.size_m.prod());
    cell_.bears(expected_kg_);
    unseen_ = std::ranges::count(cell_.left(), code_, &ObjectBelief::code) > 0;
    cell_.held->doubtful = unseen_ && !cell_.held->alone;
    cell_.lifted(seen != nullptr ? *seen : target_);
    phase_ = Phase::kLift;
    return {};
  }

  Progress lift(Time now) {
    const Vector3 tip = cell_.model.world_from_tip(cell_.arm.state().position).translation();
    const double height = tip.z() - cell_.held->from_m->z();
    if (height > 0 && cell_.loses_load()) return give_up(now, "lost while lifting");
    const double back_to_m = cell_.held->from_m->x() + cell_.belt_travel_m(now);
    cell_.held->ahead_m = std::max(cell_.held->ahead_m, tip.x() - back_to_m);
    if (cell_.world.belt.must_wait_for(back_to_m, cell_.belt_speed_m_s())) cell_.hold_belt(now);
    const double felt_kg = weigh_now(cell_), limit = cell_.world.rules.max_mass_kg;
    // Small things may be heavy: drives that reckon with far less than they lift fall behind, and stop.
    const double bears_kg = std::min(limit, felt_kg / (1 + kLifted_m_s2 / kGravity_m_s2));
    if (bears_kg > kHeavier * expected_kg_ + kHeavier_kg) cell_.bears(expected_kg_ = bears_kg);
    if (height < kLifted_m) {
      auto never = never_lifted(cell_, felt_kg);
      return never ? let_go_here(now, *std::move(never)) : Progress{};
    }
    scale_.add(cell_);
    const std::optional<Weight> weighed = scale_.weigh(cell_, expected_kg_);
    const bool at_rest = now >= lift_end_ + (weighed ? kWeighAtRest : kWeighAtMost);
    // A neighbour may bear it or drag along: only a reading at rest tells for sure.
    const bool odd = weighed && (weighed->mass_kg > (1 - kNearLimit) * limit || weighed->mass_kg < kLightest_kg);
    const auto hooked = cell_.was_hooked(code_) ? cell_.hooked : std::nullopt;
    const auto beside = weighed ? hangs_beside(cell_.held->load, *weighed, cell_.held->company, hooked) : std::nullopt;
    if (beside) cell_.hold_belt(now), cell_.strays->felt(code_);
    if ((!weighed || odd || beside || hooked) && !at_rest) return {};
    if ((target_.crowded || !cell_.held->alone) && now < lift_end_) return {};
    // What swings the arm so that it cannot be weighed is heavier than any parcel should be.
    const double mass = weighed ? weighed->mass_kg : kUnweighable * limit;
    cell_.weighs(std::max(kLightest_kg, mass));
    if (mass < kLightest_kg) return begin_put_back(now, 0, {Status::kRetry, "something bears it", {}});
    const bool alone = cell_.held->alone || hooked || mass > kTogether * limit;
    if (mass > limit && alone) return begin_put_back(now, beside ? 0 : kPutAside, overweight(mass));
    cell_.arm.expect_contact(0);
    if (!beside && mass <= limit && hooked && unseen_ && may_be_who_hung(mass, highest_top_m(cell_), *hooked))
      return begin_put_back(now, kPutAside, {Status::kException, "it may be what hung on it: nobody has seen it", {}});
    const bool hidden = target_.crowded && cell_.held->alone && !beside;  // an end, maybe, when it was measured
    if (hidden && weighed) cell_.held->load = reaching(cell_.held->load, *weighed);
    if (!beside && mass <= limit) return success(now);
    cell_.hooked = hooked_again(*cell_.held, mass, beside, hooked);
    const std::string why = beside ? beside->whose + " hangs on it: its weight is felt beside it"
                                   : fmt::format("{:.2f} kg: another may hang on it", mass);
    return begin_put_back(now, 0, {Status::kRetry, why, {}});
  }

  // Straight up from what is below, or from what stopped the arm: whatever leans on it must not be dragged along. What
  // is not held by then is let go: nobody would know of it.
  void begin_retreat(Time now, Progress verdict) {
    if (!cell_.held) cell_.arm.vacuum(false);
    verdict_ = std::move(verdict);
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const bool over_it = phase_ != Phase::kFind && now + kNoReplanBefore >= grasp_.hover;
    auto up = !over_it && !stopped_
                  ? motion::stop(state, from, cell_.limits_empty())
                  : nudge(cell_, state, from, cell_.model.world_from_tip(state.position).linear(),
                          {0.05 * cell_.belt_speed_m_s(), 0, kRetreat_m}, Vector3::Zero(), cell_.limits_empty());
    if (!up) up = motion::stop(state, from, cell_.limits_empty());
    retreated_at_ = now;
    if (up && cell_.arm.stream(*up)) retreated_at_ = up->back().end();
    phase_ = Phase::kRetreat;
  }

  Progress retreat(Time now) {
    if (now < retreated_at_) return {};
    cell_.arm.expect_contact(0);
    if (verdict_.status == Status::kRunning) look_afresh(now);
    return verdict_;
  }

  Progress success(Time now) {
    cell_.held->alone = true, cell_.held->doubtful = false;
    const task::Json mass_kg = cell_.held->mass_kg, sealed = cell_.arm.cups().sealed_cups;
    return {Status::kSucceeded, {}, {{"mass_kg", mass_kg}, {"sealed", sealed}, {"seconds", to_s(now - started_)}}};
  }

  Cell& cell_;
  std::string code_;
  Time started_, seen_, planned_, lift_end_, rides_until_, retreated_at_;
  Phase phase_ = Phase::kFind;
  Grasp grasp_;
  ObjectBelief target_;
  double expected_kg_ = 0;  // of the load, by its size
  Scale scale_;
  SetDown set_down_;
  Delay delay_;
  Slip slip_;
  Progress verdict_;
  std::optional<Time> tried_, blocked_since_, tangled_;
  GraspSearch search_;
  Presses presses_;
  int sealed_ticks_ = 0, quarters_ = 0;
  bool waiting_ = false, aside_ = false, stopped_ = false, cancelled_ = false, unseen_ = false;
};

}  // namespace

task::SkillType pick(Cell& cell) {
  return {
      .name = "pick",
      .summary = "Take one parcel off the moving belt by its label and weigh it",
      .schema = {{"type", "object"},
                 {"properties", {{"object", {{"type", "string"}, {"minLength", 1}, {"maxLength", 64}}}}},
                 {"required", {"object"}},
                 {"additionalProperties", false}},
      .resources = {cell.world.arm},
      .timeout = std::chrono::seconds(20),
      .attempts = 4,
      .outputs = {"mass_kg", "sealed"},
      .safe_points = {"before the last of the way down", "with the parcel weighed, which its task keeps"},
      .chance = [&cell](const task::Json& arguments) { return cell.chance(arguments.at("object").get<std::string>()); },
      .start =
          [&cell](const task::Json& arguments, Time now) {
            return conduct(cell, std::make_unique<Pick>(cell, arguments.at("object").get<std::string>(), now));
          }};
}

}  // namespace pons::skills
