// Looks around for a while, standing: what the lidar measures, and what of it is not on the map.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "pons/skills/base/base_skills.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr double kSeconds = 0.5;
constexpr Duration kScanComesWithin = std::chrono::seconds(2);
constexpr double kApart_m = 0.25;  // what is unmapped and nearer to its neighbour is one thing
constexpr std::size_t kThingsTold = 16;

// Nothing moves; it only needs the base to stay where it is.
class Scan final : public task::Skill {
 public:
  Scan(Chassis& chassis, Duration looks, Time now) : chassis_(chassis), looks_(looks), begun_(now) {}

  Progress tick(Time now) override {
    if (!stopped_.empty()) return ended({Status::kFailed, stopped_});
    if (paused_) return ended({Status::kPaused});
    const auto& belief = chassis_.belief();
    if (belief && belief->stamp >= begun_ && (scans_ == 0 || belief->stamp > last_)) take_in(*belief);
    if (now >= begun_ + looks_ && scans_ > 0) return {Status::kSucceeded, {}, detail()};
    if (scans_ == 0 && now >= begun_ + looks_ + kScanComesWithin) return {Status::kFailed, "no scan came"};
    return {};
  }
  void pause(Time, task::Pause) override { paused_ = true; }
  // Somebody else may have driven on: it looks anew.
  void resume(Time now) override {
    if (!paused_) return;
    paused_ = false;
    begun_ = now;
    scans_ = 0;
  }
  void cancel(Time) override { stopped_ = "cancelled"; }
  void halt(Time) override { stopped_ = "halted"; }

 private:
  static Progress ended(Progress progress) {
    progress.stop = task::StopResult::kConfirmed;
    return progress;
  }

  void take_in(const BaseBelief& belief) {
    last_ = belief.stamp;
    ++scans_;
    newest_ = belief;
  }

  // The middles of what stands apart, as the newest scan has it: rays in their order, cut where they leap.
  [[nodiscard]] task::Json things() const {
    task::Json things = task::Json::array();
    std::optional<Vector2> before;
    Vector2 sum = Vector2::Zero();
    int count = 0;
    const auto close = [&] {
      if (count > 2 && things.size() < kThingsTold) things.push_back({sum.x() / count, sum.y() / count});
      sum.setZero();
      count = 0;
    };
    for (const Vector2& at : newest_.unmapped) {
      if (before && (at - *before).norm() > kApart_m) close();
      sum += at;
      ++count;
      before = at;
    }
    close();
    return things;
  }

  [[nodiscard]] task::Json detail() const {
    const Pose2& here = newest_.map_from_base;
    return {{"scans", scans_},
            {"returns", newest_.returns},
            {"nearest_m", newest_.nearest_m},
            {"matched", newest_.matched},
            {"unmapped", newest_.unmapped.size()},
            {"things", things()},
            {"pose", {{"x", here.x}, {"y", here.y}, {"yaw", wrapped(here.yaw)}}},
            {"sigma_m", std::sqrt(std::max(newest_.covariance(0, 0), newest_.covariance(1, 1)))}};
  }

  Chassis& chassis_;
  Duration looks_;
  Time begun_, last_;
  int scans_ = 0;
  BaseBelief newest_;
  bool paused_ = false;
  std::string stopped_;  // how, once it is
};

}  // namespace

task::SkillType scan(Chassis& chassis) {
  return {.name = "scan",
          .summary = "Look around, and tell what the lidar measures and what of it the map does not show",
          .schema = {{"type", "object"},
                     {"properties", {{"seconds", {{"type", "number"}, {"minimum", 0.1}, {"maximum", 60}}}}},
                     {"additionalProperties", false}},
          .resources = {"base"},
          .timeout = std::chrono::seconds(70),
          .attempts = 2,
          .outputs = {"scans", "returns", "nearest_m", "matched", "unmapped"},
          .safe_points = {"at once: nothing moves"},
          .start = [&chassis](const task::Json& arguments, Time now) {
            return std::make_unique<Scan>(chassis, from_s(arguments.value("seconds", kSeconds)), now);
          }};
}

}  // namespace pons::skills
