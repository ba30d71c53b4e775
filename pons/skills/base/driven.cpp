#include "pons/skills/base/driven.hpp"

#include <utility>

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr Duration kHaltWithin = std::chrono::seconds(3);

}  // namespace

Progress Driven::tick(Time now) {
  switch (mode_) {
    case Mode::kGoes:
      return go(now);
    case Mode::kRests:
      return rest(now, {Status::kPaused});
    case Mode::kEnds:
      return rest(now, ends_as_.value_or(Progress{Status::kFailed, "cancelled"}));
    case Mode::kHalts:
      return halted(now);
  }
  return {Status::kFailed, "unreachable"};
}

void Driven::pause(Time now, task::Pause) {
  if (mode_ == Mode::kGoes) stop(now, Mode::kRests);
}

void Driven::resume(Time) {
  if (mode_ != Mode::kRests) return;
  mode_ = Mode::kGoes;
  begin_anew();
}

void Driven::cancel(Time now) {
  if (mode_ == Mode::kHalts) return;
  ends_as_.reset();
  if (mode_ != Mode::kEnds) stop(now, Mode::kEnds);
}

void Driven::halt(Time now) {
  if (mode_ == Mode::kHalts) return;
  mode_ = Mode::kHalts;
  halted_at_ = now;
  stands_.reset();
  chassis_.wheels.halt();
}

void Driven::end(Time now, Progress verdict) {
  ends_as_ = std::move(verdict);
  stop(now, Mode::kEnds);
}

void Driven::stop(Time now, Mode mode) {
  mode_ = mode;
  stands_.reset();
  brake(now);
  standstill_.expect(now);
}

void Driven::brake(Time now) {
  if (chassis_.wheels.operational() && now < chassis_.wheels.motion_end()) (void)chassis_.wheels.stop(now);
}

// Stopped on purpose: what is said then, once it stands.
Progress Driven::rest(Time now, Progress verdict) {
  if (!stands_) stands_ = standstill_.look(now);
  if (!stands_) return {};
  verdict.stop = stands_;
  return verdict;
}

// Before the command has arrived the cerebellum tells nothing of a stop.
Progress Driven::halted(Time now) {
  if (!stands_ && chassis_.wheels.operational()) chassis_.wheels.halt();
  if (!stands_ && !chassis_.wheels.operational()) stands_ = standstill_.look(now);
  if (!stands_ && now < halted_at_ + kHaltWithin) return {};
  Progress progress{Status::kFailed, "halted"};
  progress.stop = stands_.value_or(task::StopResult::kFailed);
  return progress;
}

}  // namespace pons::skills
