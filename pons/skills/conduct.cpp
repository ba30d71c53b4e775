#include "pons/skills/conduct.hpp"

#include <optional>
#include <utility>

#include "pons/skills/standstill.hpp"

namespace pons::skills {
namespace {

using task::Pause;
using task::Progress;
using task::Status;

constexpr Duration kHaltWithin = std::chrono::seconds(3);

class Conducted final : public task::Skill {
 public:
  Conducted(Cell& cell, std::unique_ptr<ArmSkill> skill)
      : cell_(cell), skill_(std::move(skill)), standstill_(cell.arm) {}

  Progress tick(Time now) override {
    if (!std::exchange(began_, true)) cell_.let_go_of_unknown();
    Progress progress = advance(now);
    progress.notes = cell_.take_notes();
    return progress;
  }

  void pause(Time, Pause pause) override {
    if (mode_ == Mode::kEnds || mode_ == Mode::kHalts) return;
    pause_ = pause;
    if (mode_ == Mode::kGoes) mode_ = Mode::kSeeksRest;
  }

  void resume(Time now) override {
    if (mode_ == Mode::kRests) skill_->go_on(now, now - rests_since_);
    if (mode_ == Mode::kRests || mode_ == Mode::kSeeksRest) mode_ = Mode::kGoes;
  }

  void cancel(Time now) override {
    if (mode_ == Mode::kEnds || mode_ == Mode::kHalts) return;
    resume(now);
    mode_ = Mode::kEnds;
    skill_->cancel(now);
  }

  void halt(Time now) override {
    if (mode_ == Mode::kHalts) return;
    mode_ = Mode::kHalts;
    halted_at_ = now;
    cell_.arm.halt();
  }

 private:
  enum class Mode : std::uint8_t {
    kGoes,
    kSeeksRest,  // a pause is wanted
    kRests,      // the arm was told to stop, and nobody to go on
    kEnds,       // was cancelled
    kHalts
  };

  Progress advance(Time now) {
    switch (mode_) {
      case Mode::kGoes:
        return skill_->tick(now);
      case Mode::kSeeksRest:
        if (!skill_->may_rest(now, pause_)) return skill_->tick(now);
        begin_rest(now);
        return rest(now);
      case Mode::kRests:
        return rest(now);
      case Mode::kEnds:
        return end(now);
      case Mode::kHalts:
        return halted(now);
    }
    return {Status::kFailed, "unreachable"};
  }

  void begin_rest(Time now) {
    mode_ = Mode::kRests;
    rests_since_ = now;
    stands_.reset();
    if (cell_.arm.operational() && now < cell_.arm.motion_end()) (void)cell_.arm.stop(now);
    standstill_.expect(now);
  }

  Progress rest(Time now) {
    if (!stands_) stands_ = standstill_.look(now);
    if (!stands_) return {};
    if (pause_ == Pause::kStand) cell_.keep_clear(now);
    Progress progress{Status::kPaused};
    progress.stop = stands_;
    return progress;
  }

  Progress end(Time now) {
    if (!verdict_) {
      Progress progress = skill_->tick(now);
      if (!task::is_end(progress.status)) return progress;
      verdict_ = std::move(progress);
      standstill_.expect(now);
    }
    verdict_->stop = standstill_.look(now);
    return verdict_->stop ? *verdict_ : Progress{};
  }

  Progress halted(Time now) {
    // Before the command has arrived the cerebellum tells nothing of a stop.
    const bool takes_effect = !cell_.arm.operational();
    Progress progress{Status::kFailed, "halted"};
    if (takes_effect) progress.stop = standstill_.look(now);
    if (!progress.stop && now >= halted_at_ + kHaltWithin) progress.stop = task::StopResult::kFailed;
    return progress.stop ? progress : Progress{};
  }

  Cell& cell_;
  std::unique_ptr<ArmSkill> skill_;
  Standstill standstill_;
  Mode mode_ = Mode::kGoes;
  Pause pause_ = Pause::kStand;
  Time rests_since_, halted_at_;
  std::optional<task::StopResult> stands_;  // resting
  std::optional<Progress> verdict_;         // cancelled
  bool began_ = false;
};

}  // namespace

std::unique_ptr<task::Skill> conduct(Cell& cell, std::unique_ptr<ArmSkill> skill) {
  (void)cell.take_notes();  // of what the arm did between tasks
  return std::make_unique<Conducted>(cell, std::move(skill));
}

}  // namespace pons::skills
