#include "pons/skills/rest.hpp"

namespace pons::skills {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(100);     // called later than that: a skill ran
constexpr Duration kTryEvery = std::chrono::milliseconds(200);   // to find a way out of the view
constexpr Duration kLeftAlone = std::chrono::milliseconds(500);  // then nobody wants what is held

}  // namespace

void Rest::tick(Time now) {
  const bool skill_ran = now > last_ + kPeriod;
  if (skill_ran) since_ = now, laying_ = false, parked_ = false;
  last_ = now;
  if (skill_ran || !weighing_ || !cell_.arm.operational()) weighing_.emplace(cell_);
  if (!cell_.arm.operational()) return;
  if (weighing_->lets_go()) {
    (void)weighing_->tick(now);
    return;
  }
  laying_ = laying_ && cell_.held;  // lost in a stop
  if (laying_) {
    const auto laid = set_down_.tick(now);
    laying_ = laid && !*laid;
    return;
  }
  // What a skill that was broken off left behind.
  cell_.let_go_of_unknown();
  cell_.arm.expect_contact(0);
  if (cell_.arm.state().controller != link::Controller::kTracking) {
    if (now > cell_.arm.motion_end()) cell_.arm.control(link::Controller::kTracking);
    return;
  }
  if (now >= since_ + kLeftAlone && !weighing_->tick(now)) return;
  cell_.keep_clear(now);
  if (!cell_.held || now < since_ + kLeftAlone) return;
  since_ = now;
  laying_ = set_down_.begin(now).has_value();
}

void Rest::park(Time now) {
  tick(now);
  if (!cell_.arm.operational() || laying_ || cell_.held || now < cell_.arm.motion_end()) return;
  if (parked_ || now < tried_ + kTryEvery) return;
  tried_ = now;
  parked_ = cell_.step_aside(now);
}

}  // namespace pons::skills
