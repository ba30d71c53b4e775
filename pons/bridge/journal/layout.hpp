// How journals and the order book lie in their databases: tables, identity, and the way from older versions. The SQL
// that differs between SQLite and PostgreSQL is here.
//
// A file holds one journal. A PostgreSQL database holds one for each bridge, in the schema "pons_NAME", and one order
// book for all of them, in the schema "pons"; a comment on the schema says what it is, and of which version.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pons/bridge/journal/database.hpp"
#include "pons/core/error.hpp"

namespace pons::bridge {

inline constexpr int kBookVersion = 1;
inline constexpr const char* kBookSchema = "pons";
[[nodiscard]] std::string journal_schema(std::string_view bridge);

enum class Layout : std::uint8_t {
  kNone,   // an empty database
  kOlder,  // upgrade_layout() brings it to Journal::kVersion
  kThis,
};

// Error: not a journal, or one of a newer version.
[[nodiscard]] Expected<Layout> layout_of(Database& database);
// Of an empty database.
[[nodiscard]] Expected<void> create_layout(Database& database);
// Wholly or, after an error, not at all.
[[nodiscard]] Expected<void> upgrade_layout(Database& database);

// The same of the order book, which a PostgreSQL database may have beside any journal; of several who create it at once
// one does.
[[nodiscard]] Expected<Layout> book_layout_of(Database& database);
[[nodiscard]] Expected<void> ensure_book(Database& database);

// What a query reads acceptances from, as `a`.
[[nodiscard]] std::string_view acceptances(Dialect dialect);
// Likewise, one after the other in the order of their sequences, so that a few are found without looking at all.
[[nodiscard]] std::string_view in_their_order(Dialect dialect);
// Whether it is whole, as far as the database itself can tell. Error: what is not.
[[nodiscard]] Expected<void> check_layout(Database& database);
// Gives space that was freed back to the disk.
[[nodiscard]] Expected<void> give_back_space(Database& database);

}  // namespace pons::bridge
