#include "pons/bridge/journal/place.hpp"

#include <fmt/format.h>
#include <libpq-fe.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace pons::bridge {
namespace {

constexpr std::size_t kLongestName = 40;  // PostgreSQL cuts names after 63 bytes without a word

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};

}  // namespace

bool in_database(std::string_view place) {
  return place.starts_with("postgresql://") || place.starts_with("postgres://");
}

DatabasePlace split(std::string_view place) {
  const std::size_t mark = place.find('#');
  if (mark == std::string_view::npos) return {std::string(place), {}};
  return {std::string(place.substr(0, mark)), std::string(place.substr(mark + 1))};
}

std::string named(const std::string& place, std::string_view name) {
  if (!in_database(place) || place.find('#') != std::string::npos) return place;
  return fmt::format("{}#{}", place, name);
}

Expected<void> check_name(std::string_view name) {
  const auto good = [](char letter) {
    return (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') || letter == '_';
  };
  if (!name.empty() && name.size() <= kLongestName && std::ranges::all_of(name, good)) return {};
  return fail(name.empty() ? "no bridge is named" : "this is no name that a bridge can have", "postgresql://…#NAME",
              fmt::format("end the address with # and a name of 1 to {} of a-z, 0-9 and _", kLongestName));
}

std::string shown(const std::string& place) {
  if (!in_database(place)) return place;
  const auto [connection, name] = split(place);
  const std::unique_ptr<PQconninfoOption, FreeOptions> options(PQconninfoParse(connection.c_str(), nullptr));
  if (!options) return "postgresql://…";
  const auto value = [&](std::string_view keyword) -> std::string {
    for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
      if (option->keyword == keyword && option->val != nullptr) return option->val;
    }
    return {};
  };
  std::string text = "postgresql://";
  if (const auto user = value("user"); !user.empty()) text += user + "@";
  text += value("host");
  if (const auto port = value("port"); !port.empty()) text += ":" + port;
  if (const auto database = value("dbname"); !database.empty()) text += "/" + database;
  if (!name.empty()) text += "#" + name;
  return text;
}

}  // namespace pons::bridge
