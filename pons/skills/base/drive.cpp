// As somebody steers: with the speed and the turning that were wished for last, within the base's limits, and no nearer
// to anything than a base that finds its way itself would go. Who falls silent stops it, and so does a task that waits.
#include <algorithm>
#include <functional>
#include <utility>

#include "pons/skills/base/base_skills.hpp"
#include "pons/skills/base/driven.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr Duration kRenewed = std::chrono::milliseconds(50);

class Drive final : public Driven {
 public:
  Drive(Chassis& chassis, std::function<bool()> wanted)
      : Driven(chassis),
        steer_(chassis.floor, *chassis.world.base, chassis.world.robot.limits),
        wanted_(std::move(wanted)) {}

 private:
  Progress go(Time now) override {
    const auto& wish = chassis_.wish();
    if (!wish || now >= wish->at + kSteeredFor) return leave(now, "nobody steers");
    if (wanted_ && wanted_()) return leave(now, "a task waits for the base");
    if (!chassis_.wheels.operational() || (renewed_at_ && now < *renewed_at_ + kRenewed)) return {};
    renewed_at_ = now;
    const Time from = chassis_.wheels.splice_time(now);
    const auto steered =
        steer_.hold(chassis_.expected(from), from, wish->twist, chassis_.sure() ? Room::kKnown : Room::kUnknown);
    if (!steered) {
      brake(now);
      return {};
    }
    // A link that is full is a loop that no longer listens: what it has leads to rest.
    (void)chassis_.wheels.stream(*steered);
    return {};
  }
  void begin_anew() override { renewed_at_.reset(); }

  Progress leave(Time now, const char* why) {
    end(now, {Status::kSucceeded, {}, {{"why", why}}});
    return {};
  }

  Steer steer_;
  std::function<bool()> wanted_;
  std::optional<Time> renewed_at_;
};

}  // namespace

task::SkillType drive(Chassis& chassis, std::function<bool()> wanted) {
  return {.name = "drive",
          .summary = "Drive as somebody steers, until nobody does or a task waits for the base",
          .schema = {{"type", "object"}, {"properties", task::Json::object()}, {"additionalProperties", false}},
          .resources = {"base"},
          .timeout = std::chrono::hours(24),
          .attempts = 1,
          .outputs = {"why"},
          .safe_points = {"anywhere, at rest"},
          .start = [&chassis, wanted = std::move(wanted)](const task::Json&, Time) {
            return std::make_unique<Drive>(chassis, wanted);
          }};
}

}  // namespace pons::skills
