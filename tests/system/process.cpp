#include "tests/system/process.hpp"

#include <algorithm>
#include <utility>

#include "apps/assembly.hpp"
#include "tests/system/skills.hpp"

namespace pons::tests {
namespace {

using bridge::Resumption;
using task::Json;

// No camera looks: beliefs come from the plant.
class Blind final : public perception::Sight {
 public:
  void process(const RgbdFrame&, const perception::Moment&) override {}
};

// The product's dispatcher, which sees what the plant shows. For what others ask for the belt waits, too.
class BesideTheBelt final : public brain::Brain {
 public:
  BesideTheBelt(const Outside& outside, const bridge::Bridge& bridge)
      : plant_(outside.plant), belt_(outside.world.belt), bridge_(bridge), dispatcher_(outside.orders, outside.world) {}
  brain::Decisions observe(const std::vector<ObjectBelief>&, Time now,
                           const std::set<std::string>& set_aside) override {
    const std::vector<ObjectBelief> beliefs = plant_.beliefs(now);
    brain::Decisions decisions = dispatcher_.observe(beliefs, now, set_aside);
    // What others ask for is no order of its own.
    std::erase_if(decisions.rides, [](const brain::Ride& ride) { return ride.reason == brain::kRideUnknown; });
    if (comes_yet(beliefs)) {
      decisions.belt_waits = false;
      return decisions;
    }
    for (const ObjectBelief& belief : beliefs) {
      const double x_m = belief.world_from_top.translation().x();
      const bool leaves = x_m > belt_.waits_at_m() - kStops_m && x_m < belt_.pick_x_max_m;
      const std::string_view state = leaves ? bridge_.state(belief.code) : std::string_view{};
      decisions.belt_waits = decisions.belt_waits || state == "waiting" || state == "running";
    }
    return decisions;
  }
  bool heard(std::string_view id, task::Outcome outcome) override { return dispatcher_.heard(id, outcome); }
  void recall(const task::Task& task, std::optional<task::Outcome> outcome) override {
    dispatcher_.recall(task, outcome);
  }
  void recall_ride(std::string_view code) override { dispatcher_.recall_ride(code); }
  [[nodiscard]] std::vector<std::string> unseen() const override { return dispatcher_.unseen(); }

 private:
  // The arm waits for one that is not in its zone yet: what waits for the arm must not hold that up.
  [[nodiscard]] bool comes_yet(const std::vector<ObjectBelief>& beliefs) const {
    return std::ranges::any_of(beliefs, [&](const ObjectBelief& belief) {
      return belief.world_from_top.translation().x() < belt_.pick_x_min_m + kStops_m &&
             bridge_.state(belief.code) == "running";
    });
  }

  static constexpr double kStops_m = 0.05;
  const Plant& plant_;
  const world::Belt& belt_;
  const bridge::Bridge& bridge_;
  brain::Dispatcher dispatcher_;
};

}  // namespace

Process::Process(const Outside& outside)
    : outside_(outside),
      end_(outside.link),
      sight_(std::make_unique<Blind>()),
      darkroom_(outside.world),
      cell_(end_, outside.world, outside.model.copy()),
      lay_down_(cell_, outside.steps),
      take_up_(cell_) {}

Process::~Process() {
  if (!journal_) return;
  outside_.steps.doing(Doing::kClosing);
  journal_.reset();
}

Expected<std::unique_ptr<Process>> Process::start(const Outside& outside) {
  Steps& steps = outside.steps;
  std::unique_ptr<Process> self(new Process(outside));
  steps.doing(Doing::kOpening);
  auto journal = bridge::Journal::open(kJournal, outside.disk.vfs());
  if (!journal) return std::unexpected(journal.error());
  self->journal_ = std::move(*journal);
  add_skills(self->registry_, self->cell_, outside.plant, steps);
  self->bridge_ = std::make_unique<bridge::Bridge>(*self->journal_, self->registry_, outside.world);
  auto rules = bridge::Rules::compile(outside.world.review, self->registry_, {});
  if (!rules) return std::unexpected(rules.error());
  self->bridge_->use_rules(*std::move(rules), bridge::Contradictions(outside.world.review.contradictions));
  self->brain_ = std::make_unique<BesideTheBelt>(outside, *self->bridge_);
  const runner::Darkroom& room = self->darkroom_;
  self->observer_ = std::make_unique<runner::Observer>(outside.world, *self->sight_, self->darkroom_.frames, room.pages,
                                                       room.memory(), runner::Pace::kLockstep);
  const auto visitors = [half = self.get()](Time now) {
    half->outside_.steps.doing(Doing::kAnswering);
    half->desk_->attend(now);
    half->outside_.steps.doing(Doing::kTicking);
  };
  self->side_ = std::make_unique<runner::BridgeSide>(*self->bridge_, *self->brain_, std::vector{self->skill_port()},
                                                     outside.world, runner::Recovery::kAllowed, visitors);
  self->desk_ = std::make_unique<apps::Desk>(std::make_unique<Counter>(outside.network, steps, outside.now),
                                             *self->bridge_, *self->journal_, self->side_->armings(),
                                             self->side_->health(), [half = self.get()] { return half->cell_.stream; });
  steps.doing(Doing::kTakingOver);
  auto taken = self->side_->take_over(*self->journal_, outside.now);
  if (!taken) return std::unexpected(taken.error());
  return self;
}

Expected<void> Process::tick() {
  outside_.steps.doing(Doing::kLooking);
  return side_->tick(outside_.now, *observer_);
}

runner::SkillPort Process::skill_port() {
  const auto step = [this](Act act, const auto& what) {
    (void)outside_.steps.at(act, Moment::kBefore);
    what();
    (void)outside_.steps.at(act, Moment::kAfter);
  };
  return {.refresh = [this, step](Time now, const std::vector<ObjectBelief>&,
                                  Time seen) { step(Act::kHeartbeat, [&] { cell_.refresh(now, {}, seen); }); },
          .locate = {},
          .state = [this]() -> const link::State& { return cell_.arm.state(); },
          .take_forgotten = [this] { return cell_.take_forgotten(); },
          .arm = [this, step](Time now) { step(Act::kLeadOut, [&] { cell_.arm.arm(now); }); },
          .outside_rad = [this] { return cell_.arm.outside_rad(); },
          .recover = [this](Time now) { return cell_.arm.recover(now); },
          .rest =
              [this](Time now) {
                cell_.let_go_of_unknown();
                if (cell_.held) lay_down_.tick(now);
              },
          .belt = [this, step](link::Belt wanted) { step(Act::kBelt, [&] { cell_.arm.belt(wanted); }); },
          .holds_belt = [this](Time now) { return cell_.holds_belt(now); },
          .halt = [this, step] { step(Act::kLeadOut, [&] { cell_.arm.halt(); }); },
          .raise_emergency =
              [this] {
                if (outside_.steps.alive()) end_.raise_emergency_stop();
              },
          .release_emergency =
              [this] {
                if (outside_.steps.alive()) end_.clear_emergency_stop();
              },
          .carries = [this]() -> const Json& { return take_up_.carries(); },
          .restore = [this](const Json& carried) { take_up_.restore(carried); },
          .resume = [this](const task::Task& task, std::size_t done) { return resume(task, done); },
          .settle = [this](Time now) { return take_up_.settle(now); }};
}

// A printer remembers what it has printed.
Resumption Process::resume(const task::Task& task, std::size_t done) {
  const task::Step& next = task.steps[done];
  if (next.skill != "print") return apps::resumption(take_up_, task, done);
  const Json& arguments = next.arguments;
  const int printed =
      outside_.plant.printed(arguments.at("task").get<std::string>(), arguments.at("number").get<int>());
  return {.done = done + (printed > 0 ? 1 : 0)};
}

}  // namespace pons::tests
