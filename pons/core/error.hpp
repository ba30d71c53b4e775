// What a boundary returns when it cannot do what was asked. The three parts are what a person needs to mend it.
#pragma once

#include <expected>
#include <string>
#include <utility>

namespace pons {

struct Error {
  std::string what;   // what is wrong: "column 'mass_kg' is missing"
  std::string where;  // where: "orders.csv:1"
  std::string mend;   // how to mend it: "add the column; the header is parcel_id,destination,…"

  // One line: "orders.csv:1: column 'mass_kg' is missing; add the column …"
  [[nodiscard]] std::string line() const {
    std::string text = where.empty() ? what : where + ": " + what;
    if (!mend.empty()) text += "; " + mend;
    return text;
  }
};

template <typename T>
using Expected = std::expected<T, Error>;

[[nodiscard]] inline std::unexpected<Error> fail(std::string what, std::string where = {}, std::string mend = {}) {
  return std::unexpected(Error{std::move(what), std::move(where), std::move(mend)});
}

}  // namespace pons
