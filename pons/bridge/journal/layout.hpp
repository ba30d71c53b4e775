// How a journal lies in its database: tables, identity, and the way from older versions.
#pragma once

#include "pons/bridge/journal/sqlite.hpp"
#include "pons/core/error.hpp"

namespace pons::bridge {

enum class Layout : std::uint8_t {
  kNone,   // an empty database
  kOlder,  // upgrade() brings it to Journal::kVersion
  kThis,
};

// Error: not a journal, or one of a newer version.
[[nodiscard]] Expected<Layout> layout_of(const Database& database, const std::string& file);
// Of an empty database.
[[nodiscard]] Expected<void> create_layout(const Database& database);
// Wholly or, after an error, not at all.
[[nodiscard]] Expected<void> upgrade_layout(const Database& database);

}  // namespace pons::bridge
