#include "tests/system/steps.hpp"

#include <fmt/format.h>

namespace pons::tests {
namespace {

constexpr auto kBefore = Moment::kBefore, kAfter = Moment::kAfter;

constexpr std::array kSteps = std::to_array<Step>({
    {Doing::kOpening, Act::kWriteFile, kBefore},    {Doing::kOpening, Act::kWriteFile, kAfter},
    {Doing::kOpening, Act::kSyncFile, kBefore},     {Doing::kOpening, Act::kSyncFile, kAfter},
    {Doing::kOpening, Act::kWriteLog, kBefore},     {Doing::kOpening, Act::kWriteLog, kAfter},
    {Doing::kOpening, Act::kSyncLog, kBefore},      {Doing::kOpening, Act::kSyncLog, kAfter},
    {Doing::kOpening, Act::kCutFile, kBefore},      {Doing::kOpening, Act::kCutFile, kAfter},
    {Doing::kTakingOver, Act::kHeartbeat, kBefore}, {Doing::kTakingOver, Act::kHeartbeat, kAfter},
    {Doing::kTakingOver, Act::kLeadOut, kBefore},   {Doing::kTakingOver, Act::kLeadOut, kAfter},
    {Doing::kLooking, Act::kHeartbeat, kBefore},    {Doing::kLooking, Act::kHeartbeat, kAfter},
    {Doing::kLooking, Act::kLeadOut, kBefore},      {Doing::kLooking, Act::kLeadOut, kAfter},
    {Doing::kLooking, Act::kBelt, kBefore},         {Doing::kLooking, Act::kBelt, kAfter},
    {Doing::kAnswering, Act::kHear, kBefore},       {Doing::kAnswering, Act::kHear, kAfter},
    {Doing::kAnswering, Act::kWriteLog, kBefore},   {Doing::kAnswering, Act::kWriteLog, kAfter},
    {Doing::kAnswering, Act::kSyncLog, kBefore},    {Doing::kAnswering, Act::kSyncLog, kAfter},
    {Doing::kAnswering, Act::kReply, kBefore},      {Doing::kAnswering, Act::kReply, kAfter},
    {Doing::kAnswering, Act::kLeadOut, kBefore},    {Doing::kAnswering, Act::kLeadOut, kAfter},
    {Doing::kTicking, Act::kWriteLog, kBefore},     {Doing::kTicking, Act::kWriteLog, kAfter},
    {Doing::kTicking, Act::kSyncLog, kBefore},      {Doing::kTicking, Act::kSyncLog, kAfter},
    {Doing::kTicking, Act::kStart, kBefore},        {Doing::kTicking, Act::kStart, kAfter},
    {Doing::kTicking, Act::kMotion, kBefore},       {Doing::kTicking, Act::kMotion, kAfter},
    {Doing::kTicking, Act::kCups, kBefore},         {Doing::kTicking, Act::kCups, kAfter},
    {Doing::kTicking, Act::kPrint, kBefore},        {Doing::kTicking, Act::kPrint, kAfter},
    {Doing::kClosing, Act::kWriteFile, kBefore},    {Doing::kClosing, Act::kWriteFile, kAfter},
    {Doing::kClosing, Act::kSyncFile, kBefore},     {Doing::kClosing, Act::kSyncFile, kAfter},
    {Doing::kClosing, Act::kCutLog, kBefore},       {Doing::kClosing, Act::kCutLog, kAfter},
    {Doing::kClosing, Act::kWriteLog, kBefore},     {Doing::kClosing, Act::kWriteLog, kAfter},
    {Doing::kClosing, Act::kSyncLog, kBefore},      {Doing::kClosing, Act::kSyncLog, kAfter},
    {Doing::kTakingOver, Act::kWriteLog, kBefore},  {Doing::kTakingOver, Act::kWriteLog, kAfter},
    {Doing::kTakingOver, Act::kSyncLog, kBefore},   {Doing::kTakingOver, Act::kSyncLog, kAfter},
    {Doing::kCompacting, Act::kWriteFile, kBefore}, {Doing::kCompacting, Act::kWriteFile, kAfter},
    {Doing::kClosing, Act::kCutFile, kBefore},      {Doing::kClosing, Act::kCutFile, kAfter},
    {Doing::kCompacting, Act::kWriteLog, kBefore},  {Doing::kCompacting, Act::kWriteLog, kAfter},
    {Doing::kCompacting, Act::kSyncLog, kBefore},   {Doing::kCompacting, Act::kSyncLog, kAfter},
});

std::string_view name(Doing doing) {
  constexpr std::array<std::string_view, 7> kNames{"opening", "taking over", "looking",   "answering",
                                                   "ticking", "closing",     "compacting"};
  return kNames.at(static_cast<std::size_t>(doing));
}

std::string_view name(Act act) {
  constexpr std::array<std::string_view, 15> kNames{"the log is written", "the log is synced",
                                                    "the log is cut",     "the file is written",
                                                    "the file is synced", "the file is cut",
                                                    "visitors are heard", "a visitor is answered",
                                                    "the heartbeat",      "the arm is led out of a stop",
                                                    "the belt is told",   "a motion is sent",
                                                    "the cups are told",  "the printer is told",
                                                    "a skill starts"};
  return kNames.at(static_cast<std::size_t>(act));
}

}  // namespace

std::string name(const Step& step) {
  return fmt::format("{}: {} {}", name(step.doing), step.moment == Moment::kBefore ? "before" : "after",
                     name(step.act));
}

std::span<const Step> all_steps() { return kSteps; }

void Steps::begin(const Plan& plan) {
  plan_ = plan;
  last_end_.reset();
  gone_with_.reset();
}

void Steps::kill(Fate fate) {
  if (gone_with_) return;
  gone_with_ = fate;
  gone_(fate);
}

bool Steps::at(Act act, Moment moment) {
  if (gone_with_) return false;
  const Step step{doing_, act, moment};
  ++passed_[step];
  if (held_up_now_ || plan_.fate == Fate::kLives || (plan_.at && *plan_.at != step) || --plan_.count > 0) return true;
  if (plan_.fate == Fate::kIsHeldUp) {
    plan_.fate = Fate::kLives;
    held_up_now_ = was_held_up_ = true;
    held_up_(plan_.held_up);
    held_up_now_ = false;
    return true;
  }
  ++ends_[step];
  last_end_ = step;
  kill(plan_.fate);
  return false;
}

}  // namespace pons::tests
