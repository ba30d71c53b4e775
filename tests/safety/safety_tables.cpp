// Prints the safety machine's tables as docs/safety.md shows them.

#include <fmt/core.h>

#include <string>

#include "pons/cerebellum/safety_machine.hpp"

namespace {

using namespace pons;
using cerebellum::SafetyEvent;

std::string joined(std::string_view words) {
  std::string id(words);
  for (char& c : id) c = c == ' ' ? '_' : c;
  return id;
}

void print_states() {
  fmt::print("| state |");
  for (std::size_t i = 0; i < cerebellum::kSafetyEvents; ++i) fmt::print(" {} |", name(static_cast<SafetyEvent>(i)));
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < cerebellum::kSafetyEvents; ++i) fmt::print("---|");
  fmt::print("\n");
  for (const link::SafetyState state : cerebellum::kSafetyStates) {
    fmt::print("| **{}** |", link::name(state));
    for (std::size_t i = 0; i < cerebellum::kSafetyEvents; ++i) {
      const cerebellum::Transition* const row = cerebellum::transition(state, static_cast<SafetyEvent>(i));
      if (row == nullptr) {
        fmt::print(" – |");
        continue;
      }
      fmt::print(" {}{}{} |", link::name(row->to),
                 row->drives == cerebellum::Drives::kAsTheyWere ? "" : fmt::format("; drives {}", name(row->drives)),
                 row->epochs > 0 ? "; epoch + 1" : "");
    }
    fmt::print("\n");
  }
}

void print_diagram() {
  fmt::print("```mermaid\nstateDiagram-v2\n  [*] --> {}\n", joined(link::name(link::SafetyState::kDisarmed)));
  for (const cerebellum::Transition& row : cerebellum::kTransitions)
    fmt::print("  {} --> {}: {}\n", joined(link::name(row.from)), joined(link::name(row.to)), name(row.event));
  fmt::print("```\n");
}

void print_causes() {
  fmt::print("| cause | when | what it is | who may reset it, once it has passed |\n|---|---|---|---|\n");
  for (const cerebellum::CauseRow& row : cerebellum::kCauses)
    fmt::print("| {} | {} | {} | {} |\n", link::name(row.cause), row.when, name(row.event), name(row.resumes));
}

}  // namespace

int main() {
  print_states();
  fmt::print("\n");
  print_diagram();
  fmt::print("\n");
  print_causes();
  return 0;
}
