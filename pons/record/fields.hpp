// Members of a JSON object that another process wrote, one by one, each of its kind; what is not is told by its place.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace pons::record {

// Thrown within a loader only, which makes an Error of it: `place` is a JSON pointer.
struct BadField {
  std::string place, what;
};

class Fields {
 public:
  using Json = nlohmann::ordered_json;

  explicit Fields(const Json& json, std::string place = "") : json_(json), place_(std::move(place)) {
    if (!json_.is_object()) throw BadField{place_, "is no object"};
  }

  [[nodiscard]] bool has(const char* key) const { return json_.contains(key); }
  [[nodiscard]] Fields of(const char* key) const { return Fields(at(key), place(key)); }
  [[nodiscard]] const Json& at(const char* key) const;

  [[nodiscard]] std::int64_t count(const char* key) const;   // 0 or more
  [[nodiscard]] std::uint64_t whole(const char* key) const;  // likewise, up to 2^64 - 1
  [[nodiscard]] double number(const char* key) const;        // NaN for null
  [[nodiscard]] std::string text(const char* key) const;
  [[nodiscard]] std::vector<std::string> texts(const char* key) const;
  [[nodiscard]] std::string place(const std::string& key) const { return place_ + "/" + key; }
  [[nodiscard]] const Json& all() const { return json_; }

 private:
  const Json& json_;
  std::string place_;
};

}  // namespace pons::record
