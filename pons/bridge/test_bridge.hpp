// For the bridge's tests: a bridge on a journal of its own, and skills that do what they are told.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/test_kit.hpp"

namespace pons::bridge {

class BridgeTest : public testing::Test {
 protected:
  BridgeTest() {
    world_.resources = {{"arm"}};
    skills_.add(pick_.type(3));
    skills_.add(place_.type());
    skills_.add(slow_.type(1, from_s(5)));
    skills_.add(deaf_.type(1, from_s(5)));
    skills_.add(heavy_.type());
    reopen();
  }
  // As after a kill: what was not made durable is not there.
  void reopen() {
    bridge_.reset();
    if (journal_) journal_->abandon();
    journal_.reset();
    journal_ = std::move(*Journal::open(folder_ / "day.db"));
    bridge_ = std::make_unique<Bridge>(*journal_, skills_, world_);
  }
  Expected<Admission> submit(const std::string& id, const std::string& skill, const std::string& rest = "") {
    return bridge_->submit(fmt::format(R"({{"id":"{}","steps":[{{"skill":"{}"}}]{}}})", id, skill, rest), now_);
  }
  // Ticks until idle, or for `longest_s`.
  std::vector<OutcomeReport> run(double longest_s = 60) {
    std::vector<OutcomeReport> all;
    const Time end = now_ + from_s(longest_s);
    for (; now_ < end && !bridge_->idle(); now_ += from_s(0.01)) {
      bridge_->tick(now_);
      for (OutcomeReport& report : bridge_->take_outcomes()) all.push_back(std::move(report));
    }
    return all;
  }
  std::vector<std::string> kinds(const std::string& id) {
    std::vector<std::string> result;
    const auto events = id.empty() ? journal_->notes().value() : journal_->task(id).value()->events;
    for (const Event& event : events) result.push_back(event.kind);
    return result;
  }
  std::optional<OutcomeRecord> recorded(const std::string& id) {
    return journal_->task(id).value().value().record.outcome;
  }

  Actor pick_{"pick", {{.ticks = 5, .end = ends(Status::kSucceeded, "", {{"mass_kg", 1.5}})}}};
  Actor place_{"place", {{.ticks = 5}}};
  Actor slow_{"slow", {{.ticks = 1'000'000, .ticks_after_cancel = 3}}};
  Actor deaf_{"deaf", {{.ticks = 1'000'000, .ticks_after_cancel = 1'000'000}}};
  Actor heavy_{"heavy", {{.end = ends(Status::kException, "too heavy", {{"mass_kg", 7}})}}};
  TemporaryFolder folder_;
  world::World world_;
  task::SkillRegistry skills_;
  std::unique_ptr<Journal> journal_;
  std::unique_ptr<Bridge> bridge_;
  Time now_;
};

}  // namespace pons::bridge
