// The schema of a task as a brain writes it. docs/schema/task.json is this text.
#pragma once

#include <string_view>

namespace pons::task {

inline constexpr std::size_t kMaxSteps = 32;

inline constexpr std::string_view kTaskSchema = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "task",
  "description": "What a brain asks the bridge for: steps, run in order, or a behaviour tree.",
  "type": "object",
  "required": ["id"],
  "additionalProperties": false,
  "properties": {
    "id": {
      "description": "Yours to choose and never used twice. Sending the same task again is harmless.",
      "type": "string",
      "minLength": 1,
      "maxLength": 64,
      "pattern": "^[A-Za-z0-9._:-]+$"
    },
    "order": {
      "description": "What it is part of, where that is more than this task: another try of it, another piece of it.",
      "type": "string",
      "minLength": 1,
      "maxLength": 64,
      "pattern": "^[A-Za-z0-9._:-]+$"
    },
    "priority": {
      "description": "Higher goes first.",
      "type": "integer",
      "minimum": 0,
      "maximum": 100,
      "default": 50
    },
    "deadline_s": {
      "description": "Seconds of run time. A task that could not start by then is of no use and fails.",
      "type": "number",
      "minimum": 0,
      "maximum": 1000000000
    },
    "steps": {
      "type": "array",
      "minItems": 1,
      "maxItems": 32,
      "items": {
        "type": "object",
        "required": ["skill"],
        "additionalProperties": false,
        "properties": {
          "skill": {
            "description": "A name that `pons skills` lists.",
            "type": "string",
            "minLength": 1,
            "maxLength": 64
          },
          "arguments": {
            "description": "As the skill's own schema says.",
            "type": "object"
          },
          "params": {
            "description": "Another name of arguments; not both.",
            "type": "object"
          }
        }
      }
    },
    "tree": {
      "description": "A tree of the world's, by its name, or one sent along. A task has either steps or a tree.",
      "type": "object",
      "additionalProperties": false,
      "properties": {
        "name": {
          "description": "A name that `pons trees` lists; with xml, which of its trees.",
          "type": "string",
          "minLength": 1,
          "maxLength": 64
        },
        "xml": {
          "description": "BehaviorTree.CPP 4 XML, as Groot2 writes it.",
          "type": "string",
          "minLength": 1,
          "maxLength": 65536
        },
        "inputs": {
          "description": "Entries of the tree's blackboard at the beginning.",
          "type": "object"
        }
      }
    }
  }
}
)";

}  // namespace pons::task
