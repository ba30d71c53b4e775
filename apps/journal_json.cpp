#include "apps/journal_json.hpp"

namespace pons::apps {

task::Json to_json(const bridge::TaskRecord& record) {
  task::Json json{{"id", record.task.id},
                  {"sequence", record.sequence},
                  {"priority", record.task.priority},
                  {"accepted_s", record.accepted.s()},
                  {"started", record.started}};
  if (record.outcome) {
    json["outcome"] = task::name(record.outcome->outcome);
    json["reason"] = record.outcome->reason;
    json["ended_s"] = record.outcome->stamp.s();
  }
  return json;
}

task::Json to_json(const bridge::Event& event) {
  return {{"sequence", event.sequence},
          {"task", event.task},
          {"time_s", event.stamp.s()},
          {"kind", event.kind},
          {"detail", event.detail}};
}

task::Json to_json(const std::vector<bridge::Event>& events) {
  task::Json json = task::Json::array();
  for (const bridge::Event& event : events) json.push_back(to_json(event));
  return json;
}

}  // namespace pons::apps
