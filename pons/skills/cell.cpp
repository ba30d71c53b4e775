#include "pons/skills/cell.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pons/core/gravity.hpp"
#include "pons/skills/grasp.hpp"
#include "pons/skills/grip.hpp"
#include "pons/skills/left.hpp"
#include "pons/world/view.hpp"

namespace pons::skills {
namespace {

constexpr double kWholeTurn_rad = 2 * std::numbers::pi, kCornered_rad = 0.35;  // from a position limit
constexpr double kPlanShare = 0.97;         // of the enforced limits, so that rounding never trips them
constexpr double kLoadedSpeedShare = 0.92;  // a swinging load drives the arm beyond what was planned
// Of what the cups hold: a load on bellows swings to about twice, at a reversal thrice, what it would take if rigid.
constexpr double kGripShare = 0.40;
constexpr double kTorqueShare = 0.92;    // of the motors': the same load swings
constexpr double kSlowGripShare = 0.70;  // as slowly as can be weight alone, or a motion under way, may use up more
// Of one correction: a few are fine, but what no speed helps must come to an end.
constexpr double kBoldest = 0.5, kTimid = 0.97, kTimidAtLast = 0.9;
constexpr double kSofter = 0.8;  // of the acceleration, when a load must be brought to rest
constexpr int kFineCorrections = 5;
constexpr double kUnsure_kg = 0.1;                    // the scale's
constexpr int kSeenBefore = 3;                        // at least: whoever asked for it trusted them
constexpr double kStoodUp_m = 0.10;                   // of what leans, or lies on another, where that was not known
constexpr double kBeside_m = 0.05, kBounces_m = 0.2;  // the belt, what falls: it comes to lie on it, or may
constexpr double kInstant_s = 0.001;
constexpr Duration kLingers = std::chrono::milliseconds(200);  // where another may have to come
constexpr Duration kLookEvery = std::chrono::milliseconds(100);
constexpr Duration kLookAhead = std::chrono::milliseconds(1500);
constexpr double kHiddenShare = 0.6;  // of the belt's width: at its edges a load is let go into the chutes
constexpr double kAside_m = 0.36;     // over the belt, and over what may stand on it
constexpr double kTaking_s = 1.6;     // from setting out, roughly, until an arm has come down on something
constexpr double kComing_s = 2.0;     // before it comes into the zone an arm sets out for it
constexpr double kAround_m = 0.25;    // a mouth: there arm and load may be in another's way
constexpr double kTallest_m = 0.30;   // of what rides along the belt
constexpr double kRise_m = 0.05;
constexpr int kRises = 8;
constexpr double kBeltSmoothing_s = 0.15;  // of its speed's slope, which changes within seconds

// Of what stands so high on the belt; none where no camera watches it.
std::optional<double> view_end_m(const world::World& world, double height_m) {
  world::Belt raised = world.belt;
  raised.surface_z_m += height_m;
  std::optional<double> end_m;
  for (const world::CameraSpec& camera : world.cameras) {
    if (const auto seen = world::seen_of_belt(camera, raised)) end_m = std::max(end_m.value_or(seen->to_m), seen->to_m);
  }
  return end_m;
}

std::unexpected<Error> too_heavy(double mass_kg, double cups, double motors) {
  return fail(
      fmt::format("{:.2f} kg are too heavy: as slowly as can be they ask for {:.0f} % of what the cups hold, of "
                  "which {:.0f} % may be used, and {:.0f} % of what the motors give",
                  mass_kg, 100 * cups, 100 * kSlowGripShare, 100 * motors),
      "carry", "lower rules.max_mass_kg, or take a stronger tool or arm");
}

}  // namespace

Cell::Cell(link::BridgeEnd& link, const world::World& cell_world, model::RobotModel robot, Duration splice_lead)
    : world(cell_world),
      arm(link, cell_world, splice_lead),
      model(robot.copy()),
      router(cell_world, robot.copy()),
      reach(cell_world, robot),
      mouths(cell_world),
      view_end_m_(view_end_m(cell_world, 0)) {}

void Cell::refresh(Time now, std::vector<ObjectBelief> objects, std::optional<Time> seen) {
  arm.refresh(now);
  router.refresh();
  if (held && !arm.operational() && arm.cups().open) {
    // Lost in a stop. A loop that still reckons with the load's weight does not come to rest.
    lost = held;
    lost_at = now;
    dropped();
  }
  const double passed_s = to_s(now - now_);
  const double speed = belt_speed_m_s();
  if (passed_s > 0 && now_ > Time{}) {
    const double slope = (speed - last_belt_speed_m_s_) / passed_s;
    const double share = std::min(1.0, passed_s / kBeltSmoothing_s);
    belt_acceleration_m_s2_ += share * (slope - belt_acceleration_m_s2_);
  }
  last_belt_speed_m_s_ = speed;
  if (!belt_moved_ || speed > kStands_m_s) belt_moved_ = now;
  const auto ride = [&](ObjectBelief& object) {
    object.world_from_top.translation().x() += speed * passed_s;
    object.velocity_m_s.x() = speed;
    object.stamp = now;
  };
  std::ranges::for_each(left_, ride);
  if (hidden_) ride(*hidden_);
  if (unseen_) unseen_->from_m += speed * passed_s, unseen_->rode_m += speed * passed_s;
  std::erase_if(left_, [&](const ObjectBelief& o) { return o.world_from_top.translation().x() > world.belt.x_end_m; });
  if (unseen_ && unseen_->from_m >= world.belt.x_end_m) unseen_.reset();
  now_ = now;
  seen_ = view_end_m_ ? seen.value_or(now) : now;
  objects_ = std::move(objects);
  watch_strays();
  dragged_.look(objects_, speed * passed_s, world.belt.x_end_m);
  recognise(speed * passed_s);
  take_in_cut();
  add_unseen();
  believe_felt();
}

void Cell::watch_strays() {
  const double travel_m = arm.state().belt_travel_m;
  for (const world::Place* const place : mouths.unexpected(falls(), now_)) {
    if (place->kind == world::PlaceKind::kChute)
      strays->fell(world.arm, place->name, now_);
    else
      strays->rode_off(travel_m);
  }
  for (const Mouths::Load& load : mouths.take_uncounted(now_))
    if (!held || held->code != load.code) strays->uncounted(world.arm, load.code, load.let_go);
  strays->look(objects_, {travel_m, view_end_m_.value_or(world.belt.x_end_m), world.belt.x_end_m}, now_);
  std::erase_if(left_, [&](const ObjectBelief& left) { return strays->is_gone(left.code); });
}

// What the view's downstream border cuts: its track knows more, unless it was never in view as a whole.
void Cell::take_in_cut() {
  const auto is_cut = [&](const ObjectBelief& o) {
    return o.track == 0 && o.world_from_top.translation().x() + 0.5 * o.size_m.x() > view_end_m(world, o.size_m.z());
  };
  for (const ObjectBelief& object : objects_) {
    if (!unseen_ || unseen_->rode_m >= world.rules.max_size_m || !is_cut(object)) continue;
    unseen_->from_m = std::min(unseen_->from_m, object.world_from_top.translation().x() - 0.5 * object.size_m.x());
  }
  std::erase_if(objects_, is_cut);
}

// What no camera shows, to what is believed.
void Cell::add_unseen() {
  if (hidden_) {
    const Vector3 tip = model.world_from_tip(arm.state().position).translation();
    const Vector3 off = (tip - hidden_->world_from_top.translation()).cwiseAbs();
    if (off.x() > 0.5 * hidden_->size_m.x() || off.y() > 0.5 * world.belt.width_m) hidden_.reset();
  }
  if (unseen_) {
    const double height_m = hidden_ ? std::min(unseen_->height_m, hidden_->size_m.z()) : unseen_->height_m;
    objects_.push_back(across_belt(unseen_->from_m, world.belt.x_end_m, world.belt.width_m, height_m));
  }
  if (hidden_) objects_.push_back(*hidden_);
  fallen_.add_unseen(objects_, belt_speed_m_s(), now_);
  dragged_.add_unseen(objects_, belt_speed_m_s(), now_);
  objects_.insert(objects_.end(), left_.begin(), left_.end());
}

void Cell::bears(double mass_kg) {
  arm.payload(mass_kg, world.robot.tool.flange_from_tip * Vector3(0, 0, 0.5 * held->load.size_m.z()));
}

void Cell::holds_nothing() {
  held.reset();
  arm.payload(0, Vector3::Zero());
}

std::vector<task::Note> Cell::take_notes() {
  for (const SentMotion& motion : arm.take_sent())
    note("motion", {{"first_tick", motion.first_tick}, {"last_tick", motion.last_tick}});
  return std::exchange(notes_, {});
}

void Cell::left_on_belt(const Pose& world_from_tip, std::optional<double> top_z_m) {
  ObjectBelief object = held_at(*held, world_from_tip);
  object.world_from_top.translation().z() = top_z_m.value_or(world.belt.surface_z_m + object.size_m.z());
  object.track = strays->next_unseen_track();
  object.frames_seen = kSeenBefore;
  object.stamp = object.last_seen = now_;
  object.velocity_m_s.x() = belt_speed_m_s();
  strays->put_back(world.arm, held->code, now_);
  if (!held->alone) dragged_.put_back(held->company, held->ahead_m, objects_, now_);
  left_.push_back(object);
  objects_.push_back(object);
}

void Cell::struck(std::string_view code) {
  const auto left = std::ranges::find(left_, code, &ObjectBelief::code);
  if (left == left_.end()) return;
  left->code.clear();
  left->size_m.z() += kStoodUp_m, left->world_from_top.translation().z() += kStoodUp_m;
}

void Cell::lifted(const ObjectBelief& object) {
  forgotten_.push_back(object.track);
  strays->taken(object.track);
  if (felt_ && felt_->code == object.code) felt_.reset();
  std::erase_if(left_, [&](const ObjectBelief& left) { return left.code == object.code; });
}

void Cell::dropped() {
  const AxisVector &q = arm.state().position, soon = q + kInstant_s * arm.state().speed;
  const Vector3 tip = model.world_from_tip(q).translation(), tip_soon = model.world_from_tip(soon).translation();
  const double height_m = tip.z() - held->load.size_m.z() - world.belt.surface_z_m;
  const double falls_s = std::sqrt(2 * std::max(0.0, height_m) / kGravity_m_s2);
  const Vector3 lands = tip + falls_s / kInstant_s * (tip_soon - tip);
  const double beside_m = std::abs(lands.y() - world.belt.y_center_m) - 0.5 * world.belt.width_m;
  const Vector3& size_m = held->load.size_m;
  const double top_m = std::min(tip.z(), world.belt.surface_z_m + size_m.maxCoeff());
  if (in_view(lands.x()) && beside_m < kBeside_m)
    fallen_.fell(held->code, size_m, lands, top_m, objects_, now_);
  else if (!in_view(lands.x()) && beside_m < kBounces_m)
    fallen_.fell_unseen(held->code, size_m, lands, top_m);
  holds_nothing();
}

bool Cell::loses_load() {
  if (!held || arm.cups().phase != link::VacuumPhase::kLost) return false;
  strays->dropped(world.arm, held->code, now_);
  dropped();
  return true;
}

void Cell::recognise(double rode_m) {
  recognise_left(left_, objects_, labelled_);
  for (const auto& [track, code] : fallen_.take_mistaken(objects_)) {
    note("mistaken", {{"code", code}, {"track", track}});
    if (labelled_.erase(track) > 0) strays->dropped(world.arm, code, now_);
  }
  for (auto& [track, code] : fallen_.recognise(objects_, rode_m, now_)) {
    note("recognised", {{"code", code}, {"track", track}});
    labelled_[track] = std::move(code);
  }
  std::erase_if(labelled_, [&](const auto& entry) {
    return std::ranges::find(objects_, entry.first, &ObjectBelief::track) == objects_.end();
  });
  label(objects_);
}

void Cell::label(std::vector<ObjectBelief>& objects) const {
  for (ObjectBelief& object : objects) {
    const auto label = labelled_.find(object.track);
    if (label == labelled_.end() || !object.disputed.empty()) continue;
    if (object.code.empty()) object.code = label->second;
    // Who has had it in hand knows it, whatever of it shows since.
    if (object.code == label->second) object.half_seen = false;
  }
}

void Cell::felt_by_some(std::string_view code, const Eigen::Matrix3d& world_from_tip) {
  const world::Tool& tool = world.robot.tool;
  Vector3 sum_m = Vector3::Zero();
  int sealed = 0;
  for (std::size_t i = 0; i < tool.cups_m.size(); ++i) {
    if (arm.state().cup_vacuum_kpa[i] < tool.sealed_kpa) continue;
    sum_m += tool.cups_m[i];
    ++sealed;
  }
  if (sealed == 0) return;
  Eigen::Vector2d aside_m = (world_from_tip * sum_m).head<2>() / sealed;
  if (felt_ && felt_->code == code) aside_m += felt_->aside_m;
  felt_ = Felt{std::string(code), now_, aside_m};
}

void Cell::believe_felt() {
  for (ObjectBelief& object : objects_) {
    if (!felt_ || object.code != felt_->code) continue;
    if (object.last_seen > felt_->time)
      felt_.reset();
    else
      object.world_from_top.translation().head<2>() += felt_->aside_m;
  }
}

void Cell::hides(double reach_m, double height_m) {
  const double tip_x = model.world_from_tip(arm.state().position).translation().x();
  hidden_ = across_belt(tip_x - reach_m, tip_x + reach_m, kHiddenShare * world.belt.width_m, height_m);
  objects_.push_back(*hidden_);
}

void Cell::unseen_end(double height_m) {
  if (const auto end_m = view_end_m(world, height_m)) unseen_ = {.from_m = *end_m, .height_m = height_m};
}

// Of the middle of the belt, riding with it.
ObjectBelief Cell::across_belt(double from_m, double to_m, double width_m, double height_m) const {
  ObjectBelief object;
  object.stamp = now_;
  object.world_from_top.translation() =
      Vector3(0.5 * (from_m + to_m), world.belt.y_center_m, world.belt.surface_z_m + height_m);
  object.velocity_m_s.x() = belt_speed_m_s();
  object.size_m = {to_m - from_m, width_m, height_m};
  return object;
}

const ObjectBelief* Cell::find(std::string_view code) const {
  const auto found = std::ranges::find(objects_, code, &ObjectBelief::code);
  return found == objects_.end() ? nullptr : &*found;
}

bool Cell::disputed(std::string_view code) const {
  return std::ranges::any_of(
      objects_, [&](const ObjectBelief& o) { return std::ranges::find(o.disputed, code) != o.disputed.end(); });
}

// By how much farther the belt gets within that time than at its present speed. It starts and stops along a ramp, which
// ends at the speed that it may have at most, or at none.
double Cell::gain_m(double ahead_s) const {
  const bool stops = arm.state().belt == link::Belt::kWaits;
  const double a = stops ? -world.belt.ramp_m_s2 : belt_acceleration_m_s2_, speed = belt_speed_m_s();
  if (a == 0) return 0;
  const double end = a > 0 ? world.belt.speed_m_s * (1 + world.belt.speed_variation) : 0.0;
  const double changes_s = std::clamp((end - speed) / a, 0.0, ahead_s);
  return a * changes_s * (ahead_s - 0.5 * changes_s);
}

Vector3 Cell::predict(const ObjectBelief& object, Time time) const {
  const double ahead_s = to_s(time - object.stamp);
  Vector3 position = object.world_from_top.translation() + ahead_s * object.velocity_m_s;
  if (object.velocity_m_s.x() != 0) position.x() += gain_m(ahead_s);
  return position;
}

Pose Cell::tip_down(const Vector3& position, double yaw) {
  Pose pose = pose_xyz_yaw(position.x(), position.y(), position.z(), yaw);
  pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()));
  return pose;
}

double Cell::effort(const AxisVector& from, const AxisVector& to) const {
  const AxisLimits& limits = world.robot.limits;
  const bool cornered = ((to - limits.position_min).array() < kCornered_rad).any() ||
                        ((limits.position_max - to).array() < kCornered_rad).any();
  return (to - from).cwiseAbs().maxCoeff() + (cornered ? kWholeTurn_rad : 0);
}

void Cell::keep_clear(Time now) {
  if (!arm.operational() || now < arm.motion_end() || now < looked_at_ + kLookEvery) return;
  looked_at_ = now;
  if (!held && now > arm.motion_end() + kLingers && stands_in_zone() && step_aside(now)) return;
  const Time from = arm.splice_time(now);
  const AxisVector rests = arm.planned(from).position;
  const Load* const load = held ? &held->load : nullptr;
  const auto clear = [&](const AxisVector& q) { return router.clear_at(q, from, from + kLookAhead, load, objects_); };
  if (clear(rests)) return;
  Pose pose = model.world_from_tip(rests);
  for (int step = 0; step < kRises; ++step) {
    pose.translation().z() += kRise_m;
    const auto q = model.inverse(pose, rests);
    if (!q) return;
    if (step + 1 < kRises && !clear(*q)) continue;
    const motion::Waypoint end{*q, AxisVector::Zero(q->size())};
    Search search{.must = true};
    const auto way = held ? carry(
                                now, [&](const AxisVector&) -> Expected<AxisVector> { return *q; }, search)
                          : motion::move(arm.planned(from), from, end, limits_empty());
    if (way) (void)arm.stream(*way);
    return;
  }
}

bool Cell::step_aside(Time now) {
  const Time from = arm.splice_time(now);
  const AxisState state = arm.planned(from);
  const Pose tip = model.world_from_tip(state.position);
  const Vector3 point(world.belt.pick_x_max_m, world.belt.y_center_m,
                      std::max(tip.translation().z(), world.belt.surface_z_m + kAside_m));
  const auto q = model.inverse(tip_down(point, yaw_of(tip.linear())), state.position);
  if (!q) return false;
  const motion::Waypoint end{*q, AxisVector::Zero(q->size())};
  const auto way = router.route(state, from, end, nullptr, objects_, limits_empty());
  return way && arm.stream(*way);
}

// Before the last arm the belt waits; by the others things ride.
task::Chance Cell::chance(std::string_view code) const {
  const auto holds_it = [&](const Cell* other) { return other->held && other->held->code == code; };
  if (std::ranges::any_of(others_, holds_it)) return task::Chance::kGone;
  if (!lifts && !world.next_arm.empty()) return task::Chance::kGone;
  const ObjectBelief* const object = find(code);
  if (object == nullptr) return task::Chance::kNow;
  const double x_m = object->world_from_top.translation().x();
  const double rides_m = world.next_arm.empty() ? 0 : kTaking_s * belt_speed_m_s();
  if (x_m + rides_m > world.belt.pick_x_max_m) return task::Chance::kGone;
  const double coming_m = belt_stands() ? 0 : kComing_s * world.belt.speed_m_s;
  return x_m < world.belt.pick_x_min_m - coming_m ? task::Chance::kNotYet : task::Chance::kNow;
}

bool Cell::stands_over(const world::Place& place) {
  const AxisVector& position = arm.state().position;
  if (position.size() == 0) return true;  // nobody knows where it stands
  const Vector3 off = (model.world_from_tip(position).translation() - place.center_m).cwiseAbs();
  return off.x() < 0.5 * place.size_m.x() + kAround_m && off.y() < 0.5 * place.size_m.y() + kAround_m;
}

bool Cell::stands_in(std::string_view zone) {
  return std::ranges::any_of(world.places,
                             [&](const world::Place& place) { return place.resource == zone && stands_over(place); });
}

bool Cell::stands_in_zone() {
  return std::ranges::any_of(world.places,
                             [&](const world::Place& place) { return !place.resource.empty() && stands_over(place); });
}

bool Cell::lets_pass() {
  const AxisVector& position = arm.state().position;
  if (position.size() != model.axes()) return false;
  const double load_m = held ? held->load.size_m.norm() : 0;
  const world::Belt& belt = world.belt;
  std::vector<model::PlacedCapsule> capsules;
  model.place_capsules(position, capsules);
  return std::ranges::all_of(capsules, [&](const model::PlacedCapsule& capsule) {
    const double around_m = capsule.radius_m + load_m;
    const double low_z = std::min(capsule.from.z(), capsule.to.z()) - around_m;
    const double from_y = std::min(capsule.from.y(), capsule.to.y()) - around_m;
    const double to_y = std::max(capsule.from.y(), capsule.to.y()) + around_m;
    const bool over_belt = to_y > belt.y_center_m - 0.5 * belt.width_m && from_y < belt.y_center_m + 0.5 * belt.width_m;
    return !over_belt || low_z > belt.surface_z_m + kTallest_m;
  });
}

AxisLimits Cell::limits_planned() const {
  AxisLimits limits = world.robot.limits;
  limits.speed_rad_s *= kPlanShare;
  limits.acceleration_rad_s2 *= kPlanShare;
  limits.jerk_rad_s3 *= kPlanShare;
  return limits;
}

AxisLimits Cell::limits_empty() const {
  AxisLimits limits = limits_planned();
  limits.speed_rad_s = world.robot.limits.speed_rad_s * (kPlanShare * arm.speed_share());
  return limits;
}

AxisLimits Cell::limits_timed() const {
  AxisLimits limits = limits_planned();
  if (held) limits.speed_rad_s *= kLoadedSpeedShare;
  return limits;
}

Cell::LoadUse Cell::load_use(const motion::Trajectory& way) {
  const double mass_kg = held->mass_kg + kUnsure_kg;
  const double cups = grip_use(model, world.robot.tool, held->load, mass_kg, way);
  const double motors = torque_use(model, world.robot, held->load, mass_kg, way);
  return {std::max(cups / (kGripShare * grip_share), motors / kTorqueShare),
          std::max(cups / (kSlowGripShare * grip_share), motors), cups, motors};
}

AxisLimits Cell::limits_loaded(double share) const {
  AxisLimits limits = limits_empty();
  limits.speed_rad_s *= kLoadedSpeedShare;
  limits.acceleration_rad_s2 *= share;
  return limits;
}

Expected<motion::Trajectory> Cell::carry(Time now, const Goal& goal, Search& search) {
  auto way = carry_on(now, goal, search);
  if (way || !router.spent()) search = {.must = search.must};
  return way;
}

Expected<motion::Trajectory> Cell::carry_on(Time now, const Goal& goal, Search& search) {
  for (;;) {
    const AxisLimits limits = limits_loaded(search.share);
    const Time from = arm.splice_time(now, limits);
    const AxisState state = arm.planned(from);
    const auto q = goal(state.position);
    if (!q) return std::unexpected(q.error());
    const motion::Waypoint end{*q, AxisVector::Zero(q->size())};
    auto way = router.route(state, from, end, &held->load, objects_, limits, &search.known);
    if (!way) return way;
    const auto [use, slowly, cups, motors] = load_use(*way);
    if (use <= 1) return way;
    if (search.share <= kSlowestShare) {
      if (search.must || slowly <= 1) return way;
      return too_heavy(held->mass_kg, cups / grip_share, motors);
    }
    const double timid = search.corrections++ < kFineCorrections ? kTimid : kTimidAtLast;
    search.share = std::max(kSlowestShare, search.share * std::clamp(1 / use, kBoldest, timid));
  }
}

Expected<void> Cell::stop(Time now) {
  std::optional<motion::Trajectory> softest;
  for (double share = 1; held && share >= kSlowestShare; share *= kSofter) {
    const AxisLimits limits = limits_loaded(share);
    const Time from = arm.splice_time(now, limits);
    auto way = motion::stop(arm.planned(from), from, limits);
    if (!way) break;
    const double mass_kg = held->mass_kg + kUnsure_kg;
    softest = std::move(*way);
    if (grip_use(model, world.robot.tool, held->load, mass_kg, *softest) <= kGripShare * grip_share) break;
  }
  return softest ? arm.stream(*softest) : arm.stop(now);
}

}  // namespace pons::skills
