#include "pons/skills/set_down.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pons/skills/grasp.hpp"
#include "pons/skills/scale.hpp"

namespace pons::skills {
namespace {

// Over the belt, when let go. Higher when that is blocked, or the load heavy: it hangs askew from bellows that give.
constexpr std::array kOverBelt_m = {0.03, 0.08, 0.20};
constexpr std::size_t kHeavyFrom = 1;
constexpr double kBeyond_m = 0.15;  // past the pick zone the arm still reaches down
constexpr double kSpotStep_m = 0.02;
constexpr double kRoom_m = 0.02;                              // to the next parcel is enough
constexpr Duration kTakes = std::chrono::milliseconds(1200);  // a first guess
constexpr int kRounds = 3;
constexpr double kBack_m_s2 = 2.5;  // the less, the softer it is lowered
// Sideways, where bellows let what is heavy swing like a pendulum; and down on what may hang on it, and stand below.
constexpr double kSoft_m_s2 = 0.8;
constexpr Duration kSwingsOut = std::chrono::milliseconds(350);  // what is heavy, before and after
constexpr double kNear_m = 0.4;          // of its place: from further away the straight way is not clear
constexpr double kBeside_m = 0.01;       // from over its place, coming down would bring it against what stands there
constexpr double kPushedBack_kg = -1.0;  // what the wrist feels when the load stands on something
constexpr Duration kOpensWithin = std::chrono::milliseconds(250);
constexpr Duration kSpringsUp = std::chrono::milliseconds(60);  // the arm, rid of a heavy load: no collision
constexpr double kComesFree_m = 0.02;                           // of what it was pressed on

}  // namespace

bool SetDown::goes_back(Time now) {
  const Held& held = *cell_.held;
  if (held.alone || !held.from_m) return false;
  if (held.from_m->x() + cell_.belt_travel_m(now) > cell_.world.belt.pick_x_max_m) return false;
  const Pose tip = cell_.model.world_from_tip(cell_.arm.planned(cell_.arm.splice_time(now)).position);
  const Vector3 place = *held.from_m + cell_.belt_travel_m(now) * Vector3::UnitX();
  if ((tip.translation() - place).head<2>().norm() > kNear_m) return false;
  return begin_back(now, *held.from_m + kPutBack_m * Vector3::UnitZ(), tip.linear()).has_value();
}

Expected<void> SetDown::begin(Time now) {
  if (goes_back(now)) return {};
  beside_others_ = false;
  back_.reset();
  top_z_m_.reset();
  if (heavy()) height_ = std::max(height_, kHeavyFrom);
  if (!cell_.held->alone) height_ = kOverBelt_m.size() - 1;  // who hangs on it hangs lower, maybe
  Expected<motion::Trajectory> way = fail("no way to the belt", cell_.held->code);
  for (; height_ < kOverBelt_m.size() && !way; ++height_) {
    way = way_to_belt(now, kOverBelt_m[height_]);
    if (!way && cell_.router.spent()) return std::unexpected(way.error());  // the next tick goes on from there
  }
  height_ = 0;
  if (!way) return std::unexpected(way.error());
  if (auto sent = cell_.arm.stream(*way); !sent) return sent;
  begin_at(way->back().end());
  return {};
}

Expected<void> SetDown::begin_back(Time now, const Vector3& tip_m, const Eigen::Matrix3d& orientation,
                                   std::optional<double> top_z_m) {
  back_ = Back{tip_m, orientation};
  top_z_m_ = top_z_m;
  beside_others_ = true;
  if (!heavy()) return go_back(now);
  if (auto stopped = cell_.stop(now); !stopped) return stopped;
  begin_at(cell_.arm.motion_end() + kSwingsOut);
  return {};
}

void SetDown::begin_here(Time now, double top_z_m) {
  back_.reset();
  top_z_m_ = top_z_m;
  beside_others_ = false;
  (void)cell_.stop(now);  // or it rises on, which does no harm
  begin_at(now);
}

Expected<void> SetDown::go_back(Time now) {
  const Time from = cell_.arm.splice_time(now);
  const AxisState start = cell_.arm.planned(from);
  const Vector3 tip = cell_.model.world_from_tip(start.position).translation();
  Vector3 offset = back_->tip_m + cell_.belt_travel_m(from) * Vector3::UnitX() - tip;
  const bool aside = !back_->over && offset.head<2>().norm() > kBeside_m;
  if (aside) offset.z() = 0;
  const bool swings = aside && heavy();
  const bool may_stand = !aside && !cell_.held->alone;
  const auto way = lift(cell_, start, from, back_->orientation, offset, swings || may_stand ? kSoft_m_s2 : kBack_m_s2);
  if (!way) return std::unexpected(way.error());
  if (auto sent = cell_.arm.stream(way->trajectory); !sent) return sent;
  if (aside)
    back_->over = true;
  else
    back_.reset();
  begin_at(way->top + (swings ? kSwingsOut : Duration{0}));
  return {};
}

void SetDown::begin_at(Time released_at) {
  released_at_ = released_at;
  free_at_.reset();
  (void)delay_.take();
}

Expected<motion::Trajectory> SetDown::way_to_belt(Time now, double over_belt_m) {
  if (round_ == 0) arrives_ = now + kTakes;
  for (;;) {
    const auto goal = [&](const AxisVector& from) -> Expected<AxisVector> {
      const Vector3 spot = free_spot(arrives_, over_belt_m);
      const auto down = nearest_orientation(cell_, from, spot, cell_.held->load.yaw_in_tip_rad);
      if (!down) return fail("no room on the belt", cell_.held->code);
      Pose pose = Pose::Identity();
      pose.translation() = spot;
      pose.linear() = *down;
      return cell_.model.inverse(pose, from);
    };
    auto way = cell_.carry(now, goal, search_);
    // All rounds may take more than a tick may search.
    if (!way && cell_.router.spent()) return way;
    if (way) arrives_ = way->back().end();
    if (!way || ++round_ == kRounds) return round_ = 0, way;
  }
}

// Tip position over the belt: the first with room enough at `time`, else the one with the most.
Vector3 SetDown::free_spot(Time time, double over_belt_m) const {
  const world::Belt& belt = cell_.world.belt;
  const Vector3& size = cell_.held->load.size_m;
  Vector3 spot{belt.pick_x_max_m, belt.y_center_m, belt.surface_z_m + size.z() + over_belt_m};
  double most_m = -1;
  for (double x = 0.5 * (belt.pick_x_min_m + belt.pick_x_max_m); x <= belt.pick_x_max_m + kBeyond_m; x += kSpotStep_m) {
    double room_m = kRoom_m;
    for (const ObjectBelief& object : cell_.objects()) {
      const double both_m = 0.5 * (size.head<2>().norm() + object.size_m.head<2>().norm());
      room_m = std::min(room_m, std::abs(cell_.predict(object, time).x() - x) - both_m);
    }
    if (room_m <= most_m) continue;
    most_m = room_m;
    spot.x() = x;
  }
  return spot;
}

Expected<bool> SetDown::tick(Time now) {
  if (free_at_) {
    *free_at_ += delay_.take();
    if (now < *free_at_ || comes_free(now)) return false;
    cell_.arm.expect_contact(0);
    return true;
  }
  released_at_ += delay_.take();
  if (back_) {
    if (now < released_at_) return false;
    if (auto down = go_back(now); !down) return std::unexpected(down.error());
    return false;
  }
  if (now < released_at_) {
    if (weigh_now(cell_) > kPushedBack_kg) return false;
    released_at_ = now;  // it stands already: its size was misjudged, or it stands on what came down with it
    if (beside_others_) top_z_m_ = cell_.model.world_from_tip(cell_.arm.state().position).translation().z();
    if (auto stopped = cell_.arm.stop(now); !stopped) return std::unexpected(stopped.error());
  }
  cell_.arm.vacuum(false);
  cell_.arm.expect_contact(kHandling_n);
  if (!cell_.arm.cups().open && now < released_at_ + kOpensWithin) return false;
  cell_.left_on_belt(cell_.model.world_from_tip(cell_.arm.state().position), top_z_m_);
  cell_.holds_nothing();
  free_at_ = now + kSpringsUp;
  rises_ = false;
  return false;
}

// The stop that standing too early calls for leaves the arm pressed on what it let go of: taken for a collision as soon
// as no contact is expected.
bool SetDown::comes_free(Time now) {
  if (weigh_now(cell_) > kPushedBack_kg || std::exchange(rises_, true)) return false;
  const Time from = cell_.arm.splice_time(now);
  const AxisState state = cell_.arm.planned(from);
  const auto up = nudge(cell_, state, from, cell_.model.world_from_tip(state.position).linear(),
                        kComesFree_m * Vector3::UnitZ(), Vector3::Zero(), cell_.limits_empty());
  if (!up || !cell_.arm.stream(*up)) return false;
  free_at_ = up->back().end();
  return true;
}

}  // namespace pons::skills
