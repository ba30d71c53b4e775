// Says something.
#include <utility>

#include "pons/skills/base/base_skills.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

class Speak final : public task::Skill {
 public:
  Speak(task::Speech& speech, std::string text) : speech_(speech), text_(std::move(text)) {}
  ~Speak() override { fall_silent(); }
  Speak(const Speak&) = delete;
  Speak& operator=(const Speak&) = delete;

  Progress tick(Time now) override {
    if (!stopped_.empty()) return ended({Status::kFailed, stopped_});
    if (paused_) return ended({Status::kPaused});
    if (!speaks_) {
      if (auto begun = speech_.begin(text_, now); !begun) return {Status::kFailed, begun.error().line()};
      speaks_ = true;
    }
    const auto spoken = speech_.look(now);
    if (!spoken) return {};
    speaks_ = false;
    if (!*spoken) return {Status::kFailed, spoken->error().line()};
    return {Status::kSucceeded, {}, {{"file", (*spoken)->file}, {"length_s", (*spoken)->length_s}, {"text", text_}}};
  }
  // Half a sentence helps nobody: it is said anew.
  void pause(Time, task::Pause) override {
    fall_silent();
    paused_ = true;
  }
  void resume(Time) override { paused_ = false; }
  void cancel(Time) override {
    fall_silent();
    stopped_ = "cancelled";
  }
  void halt(Time) override {
    fall_silent();
    stopped_ = "halted";
  }

 private:
  static Progress ended(Progress progress) {
    progress.stop = task::StopResult::kConfirmed;
    return progress;
  }
  void fall_silent() {
    if (std::exchange(speaks_, false)) speech_.stop();
  }

  task::Speech& speech_;
  std::string text_;
  bool speaks_ = false, paused_ = false;
  std::string stopped_;  // how, once it is
};

}  // namespace

task::SkillType speak(task::Speech& speech) {
  return {.name = "speak",
          .summary = "Say something aloud: into a WAV file, for as long as that takes to hear",
          .schema = {{"type", "object"},
                     {"properties", {{"text", {{"type", "string"}, {"minLength", 1}, {"maxLength", 500}}}}},
                     {"required", {"text"}},
                     {"additionalProperties", false}},
          .resources = {"voice"},
          .timeout = std::chrono::seconds(120),
          .attempts = 2,
          .outputs = {"file", "length_s"},
          .safe_points = {"at once; what was begun is said anew"},
          .start = [&speech](const task::Json& arguments, Time) {
            return std::make_unique<Speak>(speech, arguments.at("text").get<std::string>());
          }};
}

void add_base_skills(task::SkillRegistry& registry, Chassis& chassis, task::Speech& speech,
                     std::function<bool()> wanted) {
  registry.add(navigate(chassis));
  registry.add(drive(chassis, std::move(wanted)));
  registry.add(scan(chassis));
  registry.add(speak(speech));
  if (chassis.world.base->station("dock") != nullptr) registry.add(dock(chassis));
}

}  // namespace pons::skills
