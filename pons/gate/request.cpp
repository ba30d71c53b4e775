#include "pons/gate/request.hpp"

#include <functional>
#include <map>
#include <string>

#include "pons/task/json_text.hpp"
#include "pons/task/schema.hpp"

namespace pons::gate {
namespace {

using task::Json;
using task::Schema;

constexpr std::string_view kSchema = R"({
  "type": "object", "required": ["op"], "additionalProperties": false,
  "properties": {
    "op": {"enum": ["submit", "list", "show", "robot", "stop", "emergency_stop", "reset", "arm"]},
    "task": {"type": "object"},
    "id": {"type": "string", "minLength": 1, "maxLength": 64}
  }
})";

// Those with nothing beside their name.
const std::map<std::string, Operation, std::less<>> kBare = {
    {"list", Operation::kList},   {"robot", Operation::kRobot},
    {"stop", Operation::kStop},   {"emergency_stop", Operation::kEmergencyStop},
    {"reset", Operation::kReset}, {"arm", Operation::kArm},
};

const Schema& schema() {
  static const Schema compiled = Schema::compile(Json::parse(kSchema)).value();
  return compiled;
}

}  // namespace

Expected<Asked> asked_from(std::string_view text) {
  const auto json = task::parse_json(text);
  if (!json) return std::unexpected(json.error());
  if (auto fits = schema().check(*json); !fits) return std::unexpected(fits.error());
  const auto operation = json->at("op").get<std::string>();
  const bool submit = operation == "submit", show = operation == "show";
  if (json->contains("task") != submit) {
    return fail(submit ? "'task' is missing" : "'task' does not belong there", "/task", "give it with submit, only");
  }
  if (json->contains("id") != show) {
    return fail(show ? "'id' is missing" : "'id' does not belong there", "/id", "give it with show, only");
  }
  if (submit) return Asked{Operation::kSubmit, json->at("task").dump()};
  if (show) return Asked{Operation::kShow, json->at("id").get<std::string>()};
  return Asked{kBare.at(operation), {}};
}

Json refusal(const Error& error) { return {{"ok", false}, {"error", error.line()}}; }

}  // namespace pons::gate
