// Who decides, as the bridge's side asks it: what is believed goes in, tasks come out. Pure and deterministic; one
// thread.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/json_value.hpp"
#include "pons/task/task.hpp"

namespace pons::brain {

using task::Json;

// Something that will not be asked for. `code` is empty when none was read.
struct Ride {
  std::uint32_t track = 0;
  std::string code;
  std::string reason;  // one of the kRide… texts of dispatcher.hpp
};

struct Decisions {
  std::vector<Json> tasks;  // to submit, in this order; from an honest brain an id comes once in its life
  std::vector<Ride> rides;
  bool belt_waits = false;  // what is asked for would ride past the pick zone
  bool silent = false;      // nothing came from it in this period; what is here was on its way for longer
};

// What a task is part of, or else its id.
[[nodiscard]] inline std::string code_of(const Json& task) {
  std::string order = task::text_of(task, "order");
  return order.empty() ? task::text_of(task, "id") : order;
}

class Brain {
 public:
  virtual ~Brain() = default;
  // Once a period. `beliefs` are all live tracks, predicted to `now`; the belt does not wait for the tasks `set_aside`,
  // which somebody has paused before they began: what they are about rides on.
  [[nodiscard]] virtual Decisions observe(const std::vector<ObjectBelief>& beliefs, Time now,
                                          const std::set<std::string>& set_aside) = 0;
  // Before observe(): what rides past there, along the belt, no robot that works takes any more.
  virtual void taken_until(double /*x_m*/) {}
  // The outcome of a task that it asked for. False: another's, ignored.
  virtual bool heard(std::string_view id, task::Outcome outcome) = 0;
  // The bridge has taken a task of its decisions; also one that it has had already.
  virtual void taken(const Json& /*task*/) {}
  // Or it has not, and what it is about rides by unless it is asked for again. False: that means nothing to the brain.
  virtual bool refused(const Json& task, const Error& /*why*/) {
    return heard(task::text_of(task, "id"), task::Outcome::kFailed);
  }
  // What an earlier one asked for in this run, and what became of it, in that order, before the first observe():
  // nothing when it is still open. Tasks that no brain asked for are passed over.
  virtual void recall(const task::Task& task, std::optional<task::Outcome> outcome) = 0;
  // What it let ride; `code` may be empty.
  virtual void recall_ride(std::string_view code) = 0;
  // What it was to ask for and decided nothing about, in its order.
  [[nodiscard]] virtual std::vector<std::string> unseen() const = 0;
  // Whether it is sure to ask for something yet, whatever it sees: the run goes on until then.
  [[nodiscard]] virtual bool waits() const { return false; }
};

}  // namespace pons::brain
