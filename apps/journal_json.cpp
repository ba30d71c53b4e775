#include "apps/journal_json.hpp"

namespace pons::apps {

task::Json to_json(const bridge::TaskRecord& record) {
  task::Json json{{"id", record.task.id},
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
  return {{"time_s", event.stamp.s()}, {"kind", event.kind}, {"detail", event.detail}};
}

}  // namespace pons::apps
