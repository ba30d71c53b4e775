#include "apps/story_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <map>
#include <numbers>
#include <string_view>
#include <vector>

#include "pons/bridge/journal/story.hpp"

namespace pons::apps {
namespace {

using task::Json;

// Journals may be of other programs' events: what is not there, or of another form, is passed over.
std::string text(const Json& detail, const char* key) {
  const auto found = detail.is_object() ? detail.find(key) : detail.end();
  if (found == detail.end()) return {};
  return found->is_string() ? found->get<std::string>() : found->dump();
}

double number(const Json& detail, const char* key) {
  const auto found = detail.is_object() ? detail.find(key) : detail.end();
  return found != detail.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string metres(const Json& detail, const char* key) {
  const auto found = detail.is_object() ? detail.find(key) : detail.end();
  if (found == detail.end() || !found->is_array()) return "?";
  std::vector<double> values;
  for (const Json& value : *found) {
    if (value.is_number()) values.push_back(value.get<double>());
  }
  return fmt::format("{:.3f}", fmt::join(values, ", "));
}

std::string seen(const Json& d) {
  return fmt::format("at ({}) m, {:.0f}° turned, ± {:.1f} mm; {} m large; in {} frames, the last at {:.3f} s",
                     metres(d, "position_m"), number(d, "yaw_rad") * 180 / std::numbers::pi, 1e3 * number(d, "sigma_m"),
                     metres(d, "size_m"), text(d, "frames"), number(d, "seen_s"));
}

std::string accepted(const Json& d) {
  std::string line = fmt::format("priority {}:", text(d, "priority"));
  const auto tree = d.is_object() ? d.find("tree") : d.end();
  if (tree != d.end() && tree->is_object()) {
    const std::string name = text(*tree, "name");
    return fmt::format("{} tree {} {}", line, name.empty() ? "that was sent along" : name,
                       tree->value("inputs", Json::object()).dump());
  }
  const auto steps = d.is_object() ? d.find("steps") : d.end();
  if (steps == d.end() || !steps->is_array()) return line;
  for (const Json& step : *steps) {
    const auto arguments = step.is_object() ? step.find("arguments") : step.end();
    const bool any = arguments != step.end() && !arguments->empty();
    line += fmt::format(" {}{}{}", text(step, "skill"), any ? " " : "", any ? arguments->dump() : "");
  }
  return line;
}

std::string started(const Json& d) { return fmt::format("after waiting {:.2f} s", number(d, "waited_s")); }

std::string reason(const Json& d) { return text(d, "reason"); }

std::string step(const Json& d) { return fmt::format("step {}", text(d, "step")); }

std::string attempt(const Json& d) {
  return fmt::format("step {}, {}, try {}", text(d, "step"), text(d, "skill"), text(d, "attempt"));
}

std::string attempt_ended(const Json& d) {
  const std::string why = text(d, "reason");
  const auto detail = d.is_object() ? d.find("detail") : d.end();
  const bool more = detail != d.end() && !detail->empty();
  return fmt::format("{}: {}{}{}{}{}", attempt(d), text(d, "status"), why.empty() ? "" : ", ", why, more ? " " : "",
                     more ? detail->dump() : "");
}

std::string plan(const Json& d) {
  if (text(d, "to") == "meet") {
    return fmt::format("take it at ({}) m at {:.3f} s; believed at ({}) m, ± {:.1f} mm", metres(d, "meets_m"),
                       number(d, "meets_s"), metres(d, "object_m"), 1e3 * number(d, "sigma_m"));
  }
  if (text(d, "to") == "carry") {
    return fmt::format("carry {:.2f} kg over {} by {:.3f} s", number(d, "mass_kg"), text(d, "place"),
                       number(d, "arrives_s"));
  }
  return d.dump();
}

std::string motion(const Json& d) {
  return fmt::format("ticks {} to {} of the control loop", text(d, "first_tick"), text(d, "last_tick"));
}

std::string carries(const Json& d) {
  const auto load = d.is_object() ? d.find("load") : d.end();
  if (load == d.end() || !load->is_object()) return "the cups hold nothing";
  const double mass_kg = number(*load, "mass_kg");
  if (load->value("gone", false)) return fmt::format("the cups have lost {}", text(*load, "code"));
  return mass_kg > 0 ? fmt::format("the cups hold {}, {:.2f} kg", text(*load, "code"), mass_kg)
                     : fmt::format("the cups hold {}, not weighed yet", text(*load, "code"));
}

// Whether it stood then.
std::string stop(const Json& d) {
  const std::string result = text(d, "stop");
  return result.empty() ? reason(d) : "standstill " + result;
}

std::string ended(const Json& d) {
  const std::string why = text(d, "reason");
  const auto detail = d.is_object() ? d.find("detail") : d.end();
  const bool tree = detail != d.end() && detail->is_object() && detail->contains("blackboard");
  const std::string left = tree ? "; blackboard " + detail->at("blackboard").dump() : "";
  const std::string stopped = detail != d.end() && detail->contains("stop") ? "; " + stop(*detail) : "";
  return fmt::format("{}{}{}{}{}", text(d, "outcome"), why.empty() ? "" : ": ", why, stopped, left);
}

std::string left_out(const Json& d) { return fmt::format("{} earlier events", text(d, "events")); }

std::string preempting(const Json& d) { return "for " + text(d, "by"); }

std::string held(const Json& d) { return "stopped: " + text(d, "cause"); }

// A submission, or a step that was not begun.
std::string refused(const Json& d) {
  const std::string sent = text(d, "text"), untold = text(d, "untold");
  return fmt::format("{}{}{}{}{}", reason(d), sent.empty() ? "" : "; sent: ", sent, untold.empty() ? "" : "; and ",
                     untold.empty() ? "" : untold + " more before it");
}

std::string asked(const Json& d) {
  const auto wanted = d.is_object() ? d.find("wanted") : d.end();
  if (wanted == d.end() || !wanted->is_array()) return {};
  std::string line = "for leave:";
  for (const Json& one : *wanted)
    line += fmt::format(" {} ({}: {})", text(one, "tier"), text(one, "rule"), text(one, "use"));
  return line + fmt::format(", within {:.0f} s", number(d, "within_s"));
}

std::string allowed(const Json& d) { return fmt::format("by {}, {}", text(d, "by"), text(d, "tier")); }

std::string stopped(const Json& d) { return fmt::format("by {}: {}", text(d, "by"), text(d, "cause")); }

// What has no code needs another subject: the event is of no order.
std::string stray(const Json& d) {
  const std::string place = text(d, "fell_into");
  const bool unread = text(d, "code").empty();
  const std::string who = unread ? "a parcel that nobody has read " : "";
  const bool counted = !d.is_object() || d.value("counted", true);
  if (!place.empty()) return who + "fell into " + place + (counted ? "" : ", or beside: its light curtain counted one");
  return unread ? who + "hung on another that fell, and no camera has seen it since"
                : "its chute's light curtain has not counted it";
}

std::string recognised(const Json& d) { return "on the belt again, as track " + text(d, "track"); }
std::string mistaken(const Json& d) { return "track " + text(d, "track") + " is larger: another"; }

const std::map<std::string_view, std::string (*)(const Json&)> kTellers = {
    {"seen", seen},
    {"accepted", accepted},
    {"started", started},
    {"attempt", attempt},
    {"plan", plan},
    {"motion", motion},
    {"carries", carries},
    {"ride", reason},
    {"stray", stray},
    {"attempt_ended", attempt_ended},
    {"resumed", step},
    {"found_done", step},
    {"cancelling", reason},
    {"halting", reason},
    {"pausing", reason},
    {"paused", stop},
    {"preempted", stop},
    {"held", held},
    {"preempting", preempting},
    {"ended", ended},
    {"refused", refused},
    {"asked", asked},
    {"allowed", allowed},
    {"stopped", stopped},
    {"left_out", left_out},
    {"recognised", recognised},
    {"mistaken", mistaken},
};

// What an event says of its kind.
std::string told(const Json& event) {
  const auto detail = event.is_object() ? event.find("detail") : event.end();
  if (detail == event.end()) return {};
  const auto teller = kTellers.find(text(event, "kind"));
  if (teller != kTellers.end()) return teller->second(*detail);
  return detail->empty() ? std::string() : detail->dump();
}

}  // namespace

std::string story_line(const Json& event) {
  const std::string kind = text(event, "kind");
  if (kind == bridge::kCheckpointEvent) return {};
  return fmt::format("{:>10.3f} s  {:<14} {:<13} {}\n", number(event, "time_s"), text(event, "task"), kind,
                     told(event));
}

std::string stray_text(const Json& detail) { return stray(detail); }

std::string story_text(const Json& event) {
  const std::string kind = text(event, "kind");
  if (kind == bridge::kCheckpointEvent) return {};
  const std::string said = told(event);
  return said.empty() ? kind : fmt::format("{}: {}", kind, said);
}

}  // namespace pons::apps
