// What a world's file says about how tasks may be asked for in the words of others (`dialects:`, docs/dialects.md).
// Names of topics and skills are texts here: what they mean, only who knows the skills can say (apps/dialects/).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/world/filling.hpp"

namespace pons::world {

// A step of the task that a phrase becomes; its arguments name the parameters of what was heard.
struct DialectStep {
  Placed skill;
  Filling arguments;
};

// What a word of theirs means: steps, or a verb that is told to the task of that id.
struct Phrase {
  std::string word;  // "PICK"; empty: whatever is heard
  std::string where;
  std::vector<DialectStep> steps;
  std::string verb;                     // "pause", "resume", "cancel", "halt"; empty: it has steps
  std::vector<std::string> parameters;  // that the steps name, each once; of places ("0", "1"), in their order
};

struct Dialect {
  enum class Kind : std::uint8_t { kAgent, kBrain, kUniversal, kHighLevel, kMotion, kSetPoints };
  Kind kind = Kind::kAgent;
  Placed topic, feedback;
  std::optional<Placed> status;  // kAgent
  std::vector<Phrase> phrases;   // of kHighLevel one; of kAgent, kMotion and kSetPoints none
  std::string where;
};

[[nodiscard]] std::string_view name(Dialect::Kind kind);  // "agent", …

}  // namespace pons::world
