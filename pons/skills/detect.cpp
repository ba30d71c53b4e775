#include "pons/skills/detect.hpp"

#include <cmath>
#include <optional>
#include <utility>

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

class Detect final : public task::Skill {
 public:
  Detect(Cell& cell, std::string code, Time until) : cell_(cell), code_(std::move(code)), until_(until) {}

  Progress tick(Time now) override {
    if (stopped_) return stands({Status::kFailed, *stopped_});
    // Nobody else may have what hangs on the cups.
    if (pause_ && (pause_ == task::Pause::kStand || !cell_.held)) {
      if (!paused_at_) paused_at_ = now;
      return stands({Status::kPaused});
    }
    if (const ObjectBelief* object = cell_.find(code_)) {
      const Vector3 p = object->world_from_top.translation();
      const auto& r = object->world_from_top.linear();
      return {Status::kSucceeded,
              {},
              {{"position_m", {p.x(), p.y(), p.z()}},
               {"yaw_rad", std::atan2(r(1, 0), r(0, 0))},
               {"size_m", {object->size_m.x(), object->size_m.y(), object->size_m.z()}},
               {"confidence", object->confidence}}};
    }
    return now < until_ ? Progress{} : Progress{Status::kFailed, "not seen", {}};
  }

  void pause(Time, task::Pause pause) override { pause_ = pause; }
  void resume(Time now) override {
    pause_.reset();
    if (paused_at_) until_ += now - *std::exchange(paused_at_, {});
  }
  void cancel(Time) override { stopped_ = "cancelled"; }
  void halt(Time) override { stopped_ = "halted"; }

 private:
  // It only looks.
  static Progress stands(Progress progress) {
    progress.stop = task::StopResult::kConfirmed;
    return progress;
  }

  Cell& cell_;
  std::string code_;
  Time until_;
  std::optional<task::Pause> pause_;
  std::optional<Time> paused_at_;
  std::optional<std::string> stopped_;
};

}  // namespace

task::SkillType detect(Cell& cell) {
  return {.name = "detect",
          .summary = "Wait until a labelled object is seen, and say where it is",
          .schema = {{"type", "object"},
                     {"properties",
                      {{"object", {{"type", "string"}, {"minLength", 1}, {"maxLength", 64}}},
                       {"within_s", {{"type", "number"}, {"minimum", 0}, {"maximum", 60}}}}},
                     {"required", {"object"}},
                     {"additionalProperties", false}},
          .resources = {},
          .timeout = std::chrono::seconds(70),
          .attempts = 1,
          .outputs = {"position_m", "yaw_rad", "size_m", "confidence"},
          .safe_points = {"at once; with something on the cups nobody else gets the arm"},
          .start = [&cell](const task::Json& arguments, Time now) {
            return std::make_unique<Detect>(cell, arguments.at("object").get<std::string>(),
                                            now + from_s(arguments.value("within_s", 5.0)));
          }};
}

}  // namespace pons::skills
