// How each part of a running system fares, in one table: what a person looks at first when something is slow, what the
// journal tells of, and what decides how much the robot still does. One thread, the bridge's.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/time.hpp"
#include "pons/task/json_value.hpp"

namespace pons::runner {

enum class Condition : std::uint8_t {
  kGood,
  kPoor,  // it works, and somebody should look
  kBad,   // it does not
};

[[nodiscard]] std::string_view name(Condition condition);  // "good", "poor", "bad"

struct PartHealth {
  Condition condition = Condition::kGood;
  std::string why;  // of the moment when it came to be so; empty when good
  Time since;
  std::int64_t alerts = 0;  // times that it came to be worse
};

class Health {
 public:
  // What is worse counts at once. What is better counts when it has been so for this long: nothing flaps.
  static constexpr Duration kBetterFor = std::chrono::seconds(1);

  // Hears of each change. What is good from its beginning is no change.
  using Told = std::function<void(std::string_view part, const PartHealth& health, Time now)>;
  explicit Health(Told told) : told_(std::move(told)) {}

  // For the report, before the first tell(): so often each part had come to be worse before there was this table.
  void begin_with(const std::map<std::string, std::int64_t, std::less<>>& alerts, Time now);

  // How it is measured to fare now. Called once a period for each part that there is; `why` is for people.
  void tell(std::string_view part, Condition measured, std::string_view why, Time now);

  // By name; a part that nobody has told of is none.
  [[nodiscard]] const std::map<std::string, PartHealth, std::less<>>& parts() const { return parts_; }
  [[nodiscard]] bool is_bad(std::string_view part) const;
  // Times that any part came to be worse.
  [[nodiscard]] std::int64_t alerts() const { return alerts_; }
  // Those since the last call, a line each: "camera overhead is bad at 12.340 s: no picture for 1.5 s".
  [[nodiscard]] std::vector<std::string> take_alerts();

  // {"alerts": 2, "parts": [{"part", "condition", "why", "since_s", "alerts"}, …]}, by name.
  [[nodiscard]] task::Json describe() const;

 private:
  void change(std::string_view part, PartHealth& known, Condition condition, std::string_view why, Time now);

  // Measured better than it counts, without a break, and at the worst of it so.
  struct Better {
    Time since;
    Condition at_worst = Condition::kGood;
    std::string why;
  };

  Told told_;
  std::map<std::string, PartHealth, std::less<>> parts_;
  std::map<std::string, Better, std::less<>> better_;
  std::int64_t alerts_ = 0;
  std::vector<std::string> untold_;
};

}  // namespace pons::runner
