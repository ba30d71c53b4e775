// Where a journal lies, in one text: a file, or "postgresql://…#NAME" for a bridge of that name in a PostgreSQL
// database (a connection URI of libpq's, "postgres://" as well, and the name as its fragment). Names are made of 1 to
// 40 of a–z 0–9 _.
#pragma once

#include <string>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::bridge {

[[nodiscard]] bool in_database(std::string_view place);

struct DatabasePlace {
  std::string connection;  // as libpq takes it, a password included: for nobody's eyes
  std::string name;        // of the bridge; empty where none is named
};
[[nodiscard]] DatabasePlace split(std::string_view place);

// The same place, named `name` where it is in a database and names none.
[[nodiscard]] std::string named(const std::string& place, std::string_view name);
// Error: it is not one that a bridge can have.
[[nodiscard]] Expected<void> check_name(std::string_view name);

// For people and logs: a password does not show, nor does what cannot be read as a connection URI.
[[nodiscard]] std::string shown(const std::string& place);

}  // namespace pons::bridge
