#include "pons/gate/ros/outside_skill.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "pons/gate/ros/interface_folders.hpp"

namespace pons::gate::ros {
namespace {

using task::Progress;
using task::Status;
using task::StopResult;
using How = OutsideCall::End::How;

constexpr std::size_t kMostKept = 4096;  // characters of a result or a feedback that the journal keeps

task::Json kept(task::Json json) {
  const std::size_t length = json.dump(-1, ' ', false, task::Json::error_handler_t::replace).size();
  return length <= kMostKept ? std::move(json) : task::Json{{"left_out", fmt::format("{} characters", length)}};
}

class OutsideSkill final : public task::Skill {
 public:
  OutsideSkill(std::shared_ptr<const OutsideForm> form, std::shared_ptr<OutsideLine> line,
               std::shared_ptr<OutsideCall> call, Time now)
      : form_(std::move(form)), line_(std::move(line)), call_(std::move(call)), began_(now) {
    line_->put(call_);
  }

  Progress tick(Time now) override {
    OutsideCall::News news = call_->look();
    Progress progress = come_to(news, now);
    progress.notes = notes(news, now);
    return progress;
  }
  // There is no way to let others' work rest: it goes on, and the task stands behind it.
  void pause(Time, task::Pause) override {}
  void resume(Time) override {}
  void cancel(Time now) override { end_within(now, OutsideSkills::kCancelledWithin); }
  void halt(Time now) override { end_within(now, OutsideSkills::kHaltedWithin); }

 private:
  [[nodiscard]] const std::string& server() const { return form_->skill().server.text; }

  void end_within(Time now, Duration within) {
    if (ends_by_) {
      ends_by_ = std::min(*ends_by_, now + within);
      return;
    }
    ends_by_ = now + within;
    if (call_->withdraw()) return;
    call_->cancel();
    line_->wake();
  }

  Progress come_to(OutsideCall::News& news, Time now) {
    if (news.end) return ended(*news.end);
    if (!news.sent) {
      if (ends_by_) return stopped({Status::kFailed, "cancelled before it was asked for"}, StopResult::kConfirmed);
      if (now < began_ + form_->skill().server_wait || !call_->withdraw()) return {};
      return {Status::kFailed,
              fmt::format("{}: {} within {:g} s", server(), news.several ? "several servers, not one" : "no server",
                          to_s(form_->skill().server_wait))};
    }
    if (!ends_by_) return {};
    if (!form_->acts())
      return stopped(
          {Status::kFailed, fmt::format("{}: a service cannot be cancelled, and may still be at it", server())},
          StopResult::kUncertain);
    if (news.goes_on)
      return stopped({Status::kFailed, fmt::format("{}: the server refuses to cancel, and goes on", server())},
                     StopResult::kFailed);
    if (now < *ends_by_) return {};
    return stopped({Status::kFailed, fmt::format("{}: the server was told to cancel and does not answer", server())},
                   StopResult::kUncertain);
  }

  Progress ended(OutsideCall::End& end) const {
    const bool known = end.how != How::kServerGone && end.how != How::kLost;
    Progress progress{Status::kFailed, fmt::format("{}: {}", server(), why(end)), kept(std::move(end.reply.result))};
    if (progress.detail.is_null()) progress.detail = task::Json::object();
    if (end.how == How::kDone && end.reply.success) progress.status = Status::kSucceeded, progress.reason.clear();
    return ends_by_ ? stopped(std::move(progress), known ? StopResult::kConfirmed : StopResult::kUncertain) : progress;
  }

  [[nodiscard]] static std::string why(const OutsideCall::End& end) {
    const std::string told = end.reply.reason.empty() ? "" : ": " + end.reply.reason;
    switch (end.how) {
      case How::kDone:
        return "not done" + told;
      case How::kCanceled:
        return "cancelled" + told;
      case How::kAborted:
        return "aborted" + told;
      case How::kServerGone:
        return end.why + ", and what it was at is not known";
      case How::kRejected:
      case How::kUnsent:
      case How::kLost:
        break;
    }
    return end.why;
  }

  static Progress stopped(Progress progress, StopResult result) {
    progress.stop = result;
    return progress;
  }

  std::vector<task::Note> notes(OutsideCall::News& news, Time now) {
    std::vector<task::Note> notes;
    const bool unsent = news.end && news.end->how == How::kUnsent;
    if (news.sent && !unsent && !std::exchange(told_sent_, true)) {
      task::Json detail{{"server", server()}};
      if (form_->acts()) detail["goal"] = fmt::format("{:02x}", fmt::join(call_->id, ""));
      notes.push_back({form_->acts() ? "goal_sent" : "request_sent", std::move(detail)});
    }
    if (news.accepted && !std::exchange(told_accepted_, true))
      notes.push_back({"goal_accepted", {{"server", server()}}});
    if (news.feedback) feedback_ = std::move(news.feedback);
    if (feedback_ && now >= next_feedback_) {
      notes.push_back({"feedback", kept(*std::exchange(feedback_, std::nullopt))});
      next_feedback_ = now + OutsideSkills::kFeedbackPeriod;
    }
    return notes;
  }

  std::shared_ptr<const OutsideForm> form_;
  std::shared_ptr<OutsideLine> line_;
  std::shared_ptr<OutsideCall> call_;
  Time began_, next_feedback_;
  std::optional<Time> ends_by_;  // once it was told to end
  std::optional<task::Json> feedback_;
  bool told_sent_ = false, told_accepted_ = false;
};

task::SkillType skill_type(const std::shared_ptr<const OutsideForm>& form, const std::shared_ptr<OutsideLine>& line) {
  const world::OutsideSkill& skill = form->skill();
  return {.name = skill.name,
          .summary = skill.summary,
          .schema = form->schema(),
          .resources = skill.resources,
          .timeout = skill.timeout,
          .outputs = form->outputs(),
          .safe_points = {"none on its way: it goes on to its end, and the task stands behind it"},
          .feasible = [form](const task::Json& arguments, task::Moment) -> Expected<void> {
            const auto made = form->request(arguments, {});
            return made ? Expected<void>{} : std::unexpected(made.error());
          },
          .start = [form, line](const task::Json& arguments, Time now) -> std::unique_ptr<task::Skill> {
            const GoalId id = new_goal_id();
            auto request = form->request(arguments, id);
            if (!request) return nullptr;  // feasible() has said why
            return std::make_unique<OutsideSkill>(form, line, std::make_shared<OutsideCall>(id, *std::move(request)),
                                                  now);
          }};
}

}  // namespace

Expected<OutsideSkills> OutsideSkills::compile(std::span<const world::OutsideSkill> skills,
                                               std::vector<std::filesystem::path> folders) {
  OutsideSkills compiled;
  wire::InterfaceTypes types = interface_types(std::move(folders));
  for (const world::OutsideSkill& skill : skills) {
    auto form = OutsideForm::compile(skill, types);
    if (!form) return std::unexpected(form.error());
    compiled.skills_.push_back(
        {std::make_shared<const OutsideForm>(*std::move(form)), std::make_shared<OutsideLine>()});
  }
  return compiled;
}

Expected<void> OutsideSkills::add_to(task::SkillRegistry& registry) const {
  for (const auto& [form, line] : skills_) {
    if (registry.find(form->skill().name) != nullptr)
      return fail(fmt::format("'{}' is a skill of this robot's own", form->skill().name), form->skill().where,
                  "give it another name");
    registry.add(skill_type(form, line));
  }
  return {};
}

Expected<void> OutsideSkills::connect(Node& node) const {
  for (const auto& [form, line] : skills_) {
    auto server = OutsideServer::open(node, form, line);
    if (!server) return std::unexpected(server.error());
    node.add_part(*std::move(server));
  }
  return {};
}

bool OutsideSkills::has(std::string_view name) const {
  return std::ranges::any_of(skills_, [&](const Skill& skill) { return skill.form->skill().name == name; });
}

}  // namespace pons::gate::ros
