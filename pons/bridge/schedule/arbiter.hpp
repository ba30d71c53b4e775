// Who may run: resources that only one task may hold, and the queue before them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "pons/core/time.hpp"

namespace pons::bridge {

// A task takes all its resources at once or waits. The order is priority (higher first), deadline (earlier first, none
// last), acceptance. A waiting task keeps later ones off every resource it needs, so that it cannot be starved by tasks
// that need less.
class Arbiter {
 public:
  static constexpr std::size_t kMaxResources = 64;

  // At most kMaxResources names, each once.
  explicit Arbiter(const std::vector<std::string>& resources);

  [[nodiscard]] bool knows(std::string_view resource) const;
  // Queues a task whose resources are all known and whose id is neither queued nor running (asserted).
  void add(std::string id, int priority, std::optional<Time> deadline, const std::vector<std::string>& resources);
  // The tasks that may start now, in order; they hold their resources from here on.
  [[nodiscard]] std::vector<std::string> grant();
  // A task that was granted has ended.
  void release(std::string_view id);
  // Takes a task out of the queue; false when it is not in it.
  bool remove(std::string_view id);
  // Takes out the queued tasks whose deadline is before `now`, in the queue's order.
  [[nodiscard]] std::vector<std::string> take_expired(Time now);

  [[nodiscard]] std::vector<std::string> queue() const;  // in order
  [[nodiscard]] std::size_t queue_length() const { return queue_.size(); }

 private:
  using Mask = std::uint64_t;
  // Priority negated, deadline (or the end of time), acceptance.
  using Rank = std::tuple<int, Time, std::uint64_t>;
  struct Entry {
    std::string id;
    Mask needs = 0;
  };

  std::map<std::string, std::size_t, std::less<>> bits_;
  std::map<Rank, Entry> queue_;
  std::map<std::string, Rank, std::less<>> rank_of_;  // queued ids
  std::set<std::pair<Time, Rank>> deadlines_;         // of queued tasks that have one
  std::map<std::string, Mask, std::less<>> running_;
  Mask held_ = 0;
  std::uint64_t accepted_ = 0;
  bool changed_ = false;  // since the last grant(): otherwise there is nothing new to give
};

}  // namespace pons::bridge
