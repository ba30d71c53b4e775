#include "pons/skills/conduct.hpp"

#include <optional>
#include <utility>

#include "pons/skills/late_weighing.hpp"
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
    if (std::exchange(fresh_, false)) take_over_arm();
    note_stop();
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
    if (mode_ != Mode::kRests && mode_ != Mode::kSeeksRest) return;
    skill_->go_on(now, mode_ == Mode::kRests ? now - rests_since_ : Duration{0});
    mode_ = Mode::kGoes;
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
    stands_.reset();
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
        return go(now);
      case Mode::kSeeksRest:
        if (unweighed_ || !skill_->may_rest(now, pause_)) return go(now);
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

  // The control loop has the last word: what it refused, and why it stands, belongs to the story of the task.
  void note_stop() {
    const bool operational = cell_.arm.operational();
    if (!operational && std::exchange(operational_, operational))
      cell_.note("stopped", {{"by", "the control loop"}, {"cause", link::name(cell_.arm.state().cause)}});
    operational_ = operational;
  }

  // As it was left by whoever had it before: a skill that was halted may have left something on the cups that nobody
  // knows of, and a force that its tip might meet.
  void take_over_arm() {
    cell_.let_go_of_unknown();
    cell_.arm.expect_contact(0);
    unweighed_ = cell_.held && cell_.held->mass_kg <= 0;
    weighing_.emplace(cell_);
  }

  Progress go(Time now) {
    if (unweighed_ && cell_.arm.operational()) {
      unweighed_ = !weighing_->tick(now);
      if (unweighed_) return {};
    } else if (unweighed_) {
      weighing_.emplace(cell_);  // a stop broke it off
    }
    return skill_->tick(now);
  }

  void begin_rest(Time now) {
    mode_ = Mode::kRests;
    rests_since_ = now;
    stands_.reset();
    if (cell_.arm.operational() && now < cell_.arm.motion_end()) (void)cell_.stop(now);
    standstill_.expect(now);
  }

  Progress rest(Time now) {
    fresh_ = true;  // others may have the arm meanwhile
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

  // Before the command has arrived the cerebellum tells nothing of a stop. And what is being let go of is not known to
  // have gone: what was done by then is done.
  Progress halted(Time now) {
    const bool overdue = now >= halted_at_ + kHaltWithin;
    if (!stands_ && cell_.arm.operational()) cell_.arm.halt();
    if (!stands_ && !cell_.arm.operational()) stands_ = standstill_.look(now);
    const bool lets_go = cell_.arm.cups().phase == link::VacuumPhase::kReleasing;
    if ((!stands_ || lets_go) && !overdue) return {};
    Progress progress = verdict_.value_or(Progress{});
    if (!verdict_ && !cell_.arm.operational()) progress = skill_->tick(now);
    if (progress.status != Status::kSucceeded) progress = {Status::kFailed, "halted"};
    progress.stop = stands_.value_or(task::StopResult::kFailed);
    return progress;
  }

  Cell& cell_;
  std::unique_ptr<ArmSkill> skill_;
  Standstill standstill_;
  std::optional<LateWeighing> weighing_;
  bool unweighed_ = false, operational_ = true;
  Mode mode_ = Mode::kGoes;
  Pause pause_ = Pause::kStand;
  Time rests_since_, halted_at_;
  std::optional<task::StopResult> stands_;  // resting or halted
  std::optional<Progress> verdict_;         // cancelled
  bool fresh_ = true;                       // the arm may not be as this skill left it
};

}  // namespace

std::unique_ptr<task::Skill> conduct(Cell& cell, std::unique_ptr<ArmSkill> skill) {
  (void)cell.take_notes();  // of what the arm did between tasks
  return std::make_unique<Conducted>(cell, std::move(skill));
}

}  // namespace pons::skills
