#include "pons/bridge/tree/tree.hpp"

#include <fmt/format.h>

#include <cassert>
#include <optional>
#include <utility>

namespace pons::bridge::tree {
namespace {

// `stop`: of what came before it.
Progress broken_off(std::optional<task::StopResult> stop = {}) {
  Progress progress{Status::kFailed, "cancelled before it started", Json::object()};
  progress.stop = stop;
  return progress;
}

// Ticks its children one after the other; `goes_on` says after which status the next one is tried.
class Series final : public Node {
 public:
  Series(std::vector<NodePtr> children, bool (*goes_on)(Status)) : children_(std::move(children)), goes_on_(goes_on) {
    assert(!children_.empty());
  }

  Progress tick(Time now) override {
    for (;;) {
      Progress progress = children_[current_]->tick(now);
      if (!task::is_end(progress.status) || !goes_on_(progress.status)) return progress;
      if (current_ + 1 == children_.size()) return progress;
      if (cancelled_) return progress.status == Status::kSucceeded ? broken_off(progress.stop) : progress;
      ++current_;
      if (pause_) children_[current_]->pause(now, *pause_);
    }
  }
  void pause(Time now, Pause pause) override {
    pause_ = pause;
    children_[current_]->pause(now, pause);
  }
  void resume(Time now) override {
    pause_.reset();
    children_[current_]->resume(now);
  }
  void cancel(Time now) override {
    cancelled_ = true;
    children_[current_]->cancel(now);
  }
  void halt(Time now) override {
    cancelled_ = true;
    children_[current_]->halt(now);
  }
  void stand_still(Time now) override { children_[current_]->stand_still(now); }
  void reset() override {
    for (NodePtr& child : children_) child->reset();
    current_ = 0;
    pause_.reset();
    cancelled_ = false;
  }

 private:
  std::vector<NodePtr> children_;
  bool (*goes_on_)(Status);
  std::size_t current_ = 0;
  std::optional<Pause> pause_;
  bool cancelled_ = false;
};

// A node with one child, which hears what it hears.
class Decorator : public Node {
 public:
  explicit Decorator(NodePtr child) : child_(std::move(child)) {}
  void pause(Time now, Pause pause) override { child_->pause(now, pause); }
  void resume(Time now) override { child_->resume(now); }
  void cancel(Time now) override { child_->cancel(now); }
  void halt(Time now) override { child_->halt(now); }
  void stand_still(Time now) override { child_->stand_still(now); }
  void reset() override { child_->reset(); }

 protected:
  [[nodiscard]] Node& child() { return *child_; }

 private:
  NodePtr child_;
};

class Retry final : public Decorator {
 public:
  Retry(int attempts, NodePtr child) : Decorator(std::move(child)), attempts_(attempts) { assert(attempts_ >= 1); }

  Progress tick(Time now) override {
    Progress progress = child().tick(now);
    if (progress.status != Status::kRetry) return progress;
    ++done_;
    if (done_ < attempts_ && !cancelled_) {
      child().reset();
      if (pause_) child().pause(now, *pause_);
      return {};
    }
    progress.status = Status::kFailed;
    if (done_ > 1) progress.reason = fmt::format("{}; gave up after {} attempts", progress.reason, done_);
    return progress;
  }
  void pause(Time now, Pause pause) override {
    pause_ = pause;
    Decorator::pause(now, pause);
  }
  void resume(Time now) override {
    pause_.reset();
    Decorator::resume(now);
  }
  void cancel(Time now) override {
    cancelled_ = true;
    Decorator::cancel(now);
  }
  void halt(Time now) override {
    cancelled_ = true;
    Decorator::halt(now);
  }
  void reset() override {
    Decorator::reset();
    done_ = 0;
    pause_.reset();
    cancelled_ = false;
  }

 private:
  int attempts_;
  int done_ = 0;
  std::optional<Pause> pause_;
  bool cancelled_ = false;
};

class Timeout final : public Decorator {
 public:
  Timeout(Duration limit, NodePtr child) : Decorator(std::move(child)), limit_(limit) {}

  Progress tick(Time now) override {
    if (!ends_) {
      ends_ = now + limit_;
    } else if (paused_) {
      *ends_ += now - last_tick_;
    }
    last_tick_ = now;
    Progress progress = child().tick(now);
    paused_ = progress.status == Status::kPaused;
    if (!task::is_end(progress.status)) {
      if (!expired_ && progress.status == Status::kRunning && now >= *ends_) {
        expired_ = true;
        child().cancel(now);
      }
      return progress;
    }
    if (!expired_ || progress.status == Status::kSucceeded || progress.status == Status::kException) return progress;
    progress.status = Status::kFailed;
    progress.reason = fmt::format("timed out after {} s: {}", to_s(limit_), progress.reason);
    return progress;
  }
  void stand_still(Time now) override {
    paused_ = true;
    Decorator::stand_still(now);
  }
  void reset() override {
    Decorator::reset();
    ends_.reset();
    paused_ = false;
    expired_ = false;
  }

 private:
  Duration limit_;
  std::optional<Time> ends_;
  Time last_tick_;
  bool paused_ = false;  // since the last tick
  bool expired_ = false;
};

class Action final : public Node {
 public:
  Action(const task::SkillType& type, Json arguments, std::size_t step, const Observer& observer)
      : type_(type), arguments_(std::move(arguments)), step_(step), observer_(observer) {}

  Progress tick(Time now) override {
    if (!skill_) {
      if (cancelled_) return broken_off();
      if (auto told = observer_({step_, type_.name, ++attempts_}, now); !told) {
        return {Status::kFailed, told.error().line(), Json::object()};
      }
      skill_ = type_.start(arguments_, now);
      if (!skill_) return end({Status::kFailed, "the skill did not start", Json::object()}, now);
      if (pause_) skill_->pause(now, *pause_);
    }
    Progress progress = skill_->tick(now);
    for (const task::Note& note : std::exchange(progress.notes, {}))
      (void)observer_({step_, type_.name, attempts_, nullptr, &note}, now);
    return task::is_end(progress.status) ? end(std::move(progress), now) : progress;
  }
  // What comes before the skill has begun, it hears when it does.
  void pause(Time now, Pause pause) override {
    pause_ = pause;
    if (skill_) skill_->pause(now, pause);
  }
  void resume(Time now) override {
    pause_.reset();
    if (skill_) skill_->resume(now);
  }
  void cancel(Time now) override {
    if (skill_ && !cancelled_) skill_->cancel(now);
    cancelled_ = true;
  }
  void stand_still(Time) override {}
  void halt(Time now) override {
    if (skill_) skill_->halt(now);
    cancelled_ = true;
  }
  // Attempts go on counting: a retry is the same step.
  void reset() override {
    skill_.reset();
    pause_.reset();
    cancelled_ = false;
  }

 private:
  Progress end(Progress progress, Time now) {
    (void)observer_({step_, type_.name, attempts_, &progress}, now);
    return progress;
  }

  const task::SkillType& type_;
  Json arguments_;
  std::size_t step_;
  const Observer& observer_;
  std::unique_ptr<task::Skill> skill_;
  int attempts_ = 0;
  std::optional<Pause> pause_;
  bool cancelled_ = false;
};

}  // namespace

NodePtr sequence(std::vector<NodePtr> children) {
  return std::make_unique<Series>(std::move(children), [](Status status) { return status == Status::kSucceeded; });
}

NodePtr fallback(std::vector<NodePtr> children) {
  return std::make_unique<Series>(std::move(children),
                                  [](Status status) { return status == Status::kFailed || status == Status::kRetry; });
}

NodePtr retry(int attempts, NodePtr child) { return std::make_unique<Retry>(attempts, std::move(child)); }

NodePtr timeout(Duration limit, NodePtr child) { return std::make_unique<Timeout>(limit, std::move(child)); }

NodePtr action(const task::SkillType& type, Json arguments, std::size_t step, const Observer& observer) {
  return std::make_unique<Action>(type, std::move(arguments), step, observer);
}

NodePtr from_steps(const std::vector<task::Step>& steps, const task::SkillRegistry& skills, const Observer& observer) {
  std::vector<NodePtr> children;
  for (const task::Step& step : steps) {
    const task::SkillType* type = skills.find(step.skill);
    assert(type != nullptr);
    children.push_back(
        timeout(type->timeout, retry(type->attempts, action(*type, step.arguments, children.size(), observer))));
  }
  return sequence(std::move(children));
}

}  // namespace pons::bridge::tree
