#include "pons/skills/pick.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "pons/skills/grasp.hpp"
#include "pons/skills/scale.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr Duration kVacuumLead = std::chrono::milliseconds(40);   // before the contact
constexpr Duration kSealWithin = std::chrono::milliseconds(330);  // after it, while riding along
constexpr Duration kReplanEvery = std::chrono::milliseconds(60);
constexpr Duration kNoReplanBefore = std::chrono::milliseconds(120);  // ahead of the hover point
constexpr Duration kUnseenFor = std::chrono::milliseconds(1000);
constexpr double kMoved_m = 0.0015;   // a prediction off by more is worth a new plan
constexpr double kUnweighed_kg = 1.5;  // assumed until the wrist has weighed it
constexpr double kLift_m = 0.09;
constexpr double kLifted_m = 0.015;   // nothing below supports the load any more
constexpr double kRetreat_m = 0.08;
constexpr double kSetDown_m = 0.01;   // over the belt, when let go
constexpr double kWait_m = 0.15;      // over the parcels, where the arm waits for one to come

class Pick final : public task::Skill {
 public:
  Pick(Cell& cell, std::string code, Time now) : cell_(cell), code_(std::move(code)), started_(now), seen_(now) {}

  Progress tick(Time now) override {
    if (!cell_.arm.operational()) {
      stopped_ = true;
      return {};
    }
    if (stopped_) return {Status::kRetry, "the arm was stopped", {}};
    switch (phase_) {
      case Phase::kFind: return find(now);
      case Phase::kRelieve: return relieve(now);
      case Phase::kApproach: return approach(now);
      case Phase::kGrip: return grip(now);
      case Phase::kLift: return lift(now);
      case Phase::kPutBack: return put_back(now);
      case Phase::kRetreat: return retreat(now);
    }
    return {Status::kFailed, "unreachable", {}};
  }

  void cancel(Time now) override {
    if (phase_ == Phase::kLift) {
      begin_put_back(now, {Status::kFailed, "cancelled", {}});
    } else if (phase_ != Phase::kPutBack && phase_ != Phase::kRetreat) {
      begin_retreat(now, {Status::kFailed, "cancelled", {}});
    }
  }

 private:
  enum class Phase : std::uint8_t { kFind, kRelieve, kApproach, kGrip, kLift, kPutBack, kRetreat };

  Progress find(Time now) {
    if (cell_.held) {
      if (cell_.held->code == code_) return success(now);
      return begin_relieve(now);
    }
    const ObjectBelief* object = cell_.find(code_);
    if (object == nullptr) {
      if (now - seen_ < kUnseenFor) return {};
      return {Status::kException, "lost from sight", {}};
    }
    seen_ = now;
    if (object->world_from_top.translation().x() > cell_.world.belt.pick_x_max_m) {
      return {Status::kException, "rode past the pick zone", {}};
    }
    const Time from = Arm::splice_time(now);
    auto grasp = plan_grasp(cell_, cell_.arm.planned(from), from, *object, std::nullopt);
    if (!grasp) {
      // Out of reach upstream is a matter of waiting; the same beyond is not.
      if (object->world_from_top.translation().x() < cell_.world.belt.pick_x_min_m) return {};
      last_error_ = grasp.error().line();
      return now - started_ < std::chrono::seconds(2) ? Progress{} : Progress{Status::kRetry, last_error_, {}};
    }
    if (grasp->contact_point.x() < cell_.world.belt.pick_x_min_m) return wait_for(*object, *grasp, now);
    if (grasp->contact_point.x() > cell_.world.belt.pick_x_max_m) {
      return {Status::kException, "would ride past the pick zone", {}};
    }
    return start(*grasp, *object, now);
  }

  // A parcel that an earlier task left on the cups goes back on the belt, past the pick zone, and rides on.
  Progress begin_relieve(Time now) {
    const Time from = Arm::splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const world::Belt& belt = cell_.world.belt;
    const Load& load = cell_.held->load;
    const Vector3 tip{belt.pick_x_max_m, belt.y_center_m, belt.surface_z_m + load.size_m.z() + kSetDown_m};
    const auto yaw = nearest_yaw(cell_, state.position, tip, load.yaw_in_tip_rad);
    if (!yaw) return {Status::kFailed, "the cups hold " + cell_.held->code, {}};
    const auto q = cell_.model.inverse(Cell::tip_down(tip, *yaw), state.position);
    if (!q) return {Status::kFailed, q.error().line(), {}};
    auto way = cell_.router.route(state, from, {*q, AxisVector::Zero(q->size())}, &load, cell_.objects(),
                                  cell_.limits_loaded(cell_.held->mass_kg, cell_.held->load.size_m.z()));
    if (!way) return {Status::kRetry, way.error().line(), {}};
    if (auto sent = cell_.arm.stream(*way); !sent) return {Status::kRetry, sent.error().line(), {}};
    released_at_ = way->back().end();
    phase_ = Phase::kRelieve;
    return {};
  }

  Progress relieve(Time now) {
    if (now < released_at_) return {};
    cell_.arm.vacuum(false);
    if (!cell_.arm.all_cups_open() && now < released_at_ + std::chrono::milliseconds(250)) return {};
    cell_.held.reset();
    cell_.arm.payload(0, Vector3::Zero());
    phase_ = Phase::kFind;
    seen_ = now;
    return {};
  }

  // The parcel is still too far upstream: hang over the place where it will come within reach.
  Progress wait_for(const ObjectBelief& object, const Grasp& grasp, Time now) {
    if (waiting_) return {};
    const Time from = Arm::splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    Vector3 point = grasp.contact_point;
    point.x() = cell_.world.belt.pick_x_min_m + 0.02;
    point.z() = object.world_from_top.translation().z() + kWait_m;
    const auto q = cell_.model.inverse(Cell::tip_down(point, grasp.yaw_rad), state.position);
    if (!q) return {};
    const auto way = cell_.router.route(state, from, {*q, AxisVector::Zero(q->size())}, nullptr, cell_.objects(),
                                        cell_.limits_empty());
    if (way && cell_.arm.stream(*way)) waiting_ = true;
    return {};
  }

  Progress start(const Grasp& grasp, const ObjectBelief& object, Time now) {
    if (auto sent = cell_.arm.stream(grasp.trajectory); !sent) return {Status::kRetry, sent.error().line(), {}};
    grasp_ = grasp;
    target_ = object;
    planned_ = now;
    phase_ = Phase::kApproach;
    return {};
  }

  Progress approach(Time now) {
    const ObjectBelief* object = cell_.find(code_);
    if (object != nullptr && now - planned_ >= kReplanEvery && now + kNoReplanBefore < grasp_.hover) {
      const Vector3 contact = cell_.predict(*object, grasp_.contact);
      if ((contact - grasp_.contact_point).head<2>().norm() > kMoved_m) {
        const Time from = Arm::splice_time(now);
        const double turn = yaw_of(*object) - yaw_of(target_);
        auto better = plan_grasp(cell_, cell_.arm.planned(from), from, *object, grasp_.yaw_rad + wrapped(turn));
        if (better && better->contact_point.x() < cell_.world.belt.pick_x_max_m) return start(*better, *object, now);
        planned_ = now;
      }
    }
    if (now + kVacuumLead >= grasp_.contact) {
      cell_.arm.vacuum(true);
      phase_ = Phase::kGrip;
    }
    return {};
  }

  Progress grip(Time now) {
    sealed_ticks_ = cell_.arm.sealed_cups() >= cell_.world.robot.tool.cups_to_lift ? sealed_ticks_ + 1 : 0;
    const int all = static_cast<int>(cell_.world.robot.tool.cups_m.size());
    const int needed_ticks = cell_.arm.sealed_cups() == all ? 1 : 3;
    if (now >= grasp_.contact && sealed_ticks_ >= needed_ticks) return begin_lift(now);
    if (now > grasp_.contact + kSealWithin) {
      cell_.arm.vacuum(false);
      begin_retreat(now, {Status::kRetry, fmt::format("{} of {} cups sealed", cell_.arm.sealed_cups(), all), {}});
    }
    return {};
  }

  Progress begin_lift(Time now) {
    const Time from = Arm::splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    lift_from_ = cell_.model.world_from_tip(state.position).translation();
    const Vector3 offset{0.10 * cell_.belt_speed_m_s(), 0, kLift_m};
    auto up = nudge(cell_, state, from, grasp_.yaw_rad, offset, Vector3::Zero(), cell_.limits_loaded(kUnweighed_kg, target_.size_m.z()));
    if (!up) return {Status::kRetry, up.error().line(), {}};
    if (auto sent = cell_.arm.stream(*up); !sent) return {Status::kRetry, sent.error().line(), {}};
    Held held{.code = code_};
    held.load.size_m = target_.size_m;
    held.load.yaw_in_tip_rad = grasp_.yaw_rad - yaw_of(target_);
    cell_.held = held;
    cell_.forget(target_.track);
    phase_ = Phase::kLift;
    return {};
  }

  Progress lift(Time now) {
    const double height = cell_.model.world_from_tip(cell_.arm.state().position).translation().z() - lift_from_.z();
    if (cell_.arm.sealed_cups() == 0 && height > 0) {
      cell_.held.reset();
      cell_.arm.vacuum(false);
      begin_retreat(now, {Status::kRetry, "lost while lifting", {}});
      return {};
    }
    if (height < kLifted_m) return {};
    scale_.add(cell_, now);
    if (!scale_.ready()) return {};
    const double mass = scale_.mass_kg();
    cell_.held->mass_kg = std::max(0.0, mass);
    const double depth = 0.5 * target_.size_m.z();
    const Pose& flange_from_tip = cell_.world.robot.tool.flange_from_tip;
    cell_.arm.payload(cell_.held->mass_kg, flange_from_tip * Vector3(0, 0, depth));
    if (mass > cell_.world.rules.max_mass_kg) {
      begin_put_back(now, {Status::kException, fmt::format("overweight: {:.2f} kg", mass), {{"mass_kg", mass}}});
      return {};
    }
    return success(now);
  }

  void begin_put_back(Time now, Progress verdict) {
    verdict_ = std::move(verdict);
    const Time from = Arm::splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const double height = cell_.model.world_from_tip(state.position).translation().z() - lift_from_.z();
    const Vector3 belt{cell_.belt_speed_m_s(), 0, 0};
    const double down_s = 0.3;
    auto down = nudge(cell_, state, from, grasp_.yaw_rad, down_s * belt - Vector3(0, 0, height), belt,
                      cell_.limits_loaded(cell_.held->mass_kg, cell_.held->load.size_m.z()));
    if (down) {
      const Time end = down->back().end();
      if (auto along = ride(cell_, motion::sample(*down, end, cell_.model.axes()), end, grasp_.yaw_rad, 0.3)) {
        down->insert(down->end(), along->begin(), along->end());
      }
      released_at_ = end;
    }
    if (!down || !cell_.arm.stream(*down)) released_at_ = now;
    phase_ = Phase::kPutBack;
  }

  Progress put_back(Time now) {
    if (now < released_at_) return {};
    cell_.arm.vacuum(false);
    if (!cell_.arm.all_cups_open() && now < released_at_ + std::chrono::milliseconds(250)) return {};
    cell_.held.reset();
    cell_.arm.payload(0, Vector3::Zero());
    begin_retreat(now, verdict_);
    return {};
  }

  void begin_retreat(Time now, Progress verdict) {
    verdict_ = std::move(verdict);
    const Time from = Arm::splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const double yaw = phase_ == Phase::kFind ? 0 : grasp_.yaw_rad;
    auto up = phase_ == Phase::kFind || phase_ == Phase::kApproach
                  ? motion::stop(state, from, cell_.limits_empty())
                  : nudge(cell_, state, from, yaw, {0.05 * cell_.belt_speed_m_s(), 0, kRetreat_m}, Vector3::Zero(), cell_.limits_empty());
    if (!up) up = motion::stop(state, from, cell_.limits_empty());
    retreated_at_ = now;
    if (up && cell_.arm.stream(*up)) retreated_at_ = up->back().end();
    phase_ = Phase::kRetreat;
  }

  Progress retreat(Time now) { return now < retreated_at_ ? Progress{} : verdict_; }

  Progress success(Time now) {
    return {Status::kSucceeded, {}, {{"mass_kg", cell_.held->mass_kg}, {"sealed", cell_.arm.sealed_cups()}, {"seconds", to_s(now - started_)}}};
  }

  static double yaw_of(const ObjectBelief& object) {
    return std::atan2(object.world_from_top.linear()(1, 0), object.world_from_top.linear()(0, 0));
  }
  // A belief's yaw is known up to half a turn.
  static double wrapped(double angle) { return std::remainder(angle, M_PI); }

  Cell& cell_;
  std::string code_;
  Time started_, seen_, planned_, released_at_, retreated_at_;
  Phase phase_ = Phase::kFind;
  Grasp grasp_;
  ObjectBelief target_;
  Vector3 lift_from_ = Vector3::Zero();
  Scale scale_;
  Progress verdict_;
  std::string last_error_;
  int sealed_ticks_ = 0;
  bool waiting_ = false, stopped_ = false;
};

}  // namespace

task::SkillType pick(Cell& cell) {
  return {.name = "pick",
          .summary = "Take one parcel off the moving belt by its label and weigh it",
          .schema = {{"type", "object"},
                     {"properties", {{"object", {{"type", "string"}, {"minLength", 1}, {"maxLength", 64}}}}},
                     {"required", {"object"}},
                     {"additionalProperties", false}},
          .resources = {"arm"},
          .timeout = std::chrono::seconds(20),
          .attempts = 4,
          .start = [&cell](const task::Json& arguments, Time now) {
            return std::make_unique<Pick>(cell, arguments.at("object").get<std::string>(), now);
          }};
}

}  // namespace pons::skills
