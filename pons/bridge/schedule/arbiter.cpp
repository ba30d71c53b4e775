#include "pons/bridge/schedule/arbiter.hpp"

#include <cassert>

namespace pons::bridge {
namespace {

constexpr Time kNever{Duration::max()};

}  // namespace

Arbiter::Arbiter(const std::vector<std::string>& resources) {
  assert(resources.size() <= kMaxResources);
  for (const std::string& name : resources) {
    [[maybe_unused]] const bool added = bits_.emplace(name, bits_.size()).second;
    assert(added);
  }
}

bool Arbiter::knows(std::string_view resource) const { return bits_.find(resource) != bits_.end(); }

void Arbiter::add(std::string id, int priority, std::optional<Time> deadline,
                  const std::vector<std::string>& resources) {
  assert(rank_of_.find(id) == rank_of_.end() && running_.find(id) == running_.end());
  Mask needs = 0;
  for (const std::string& name : resources) {
    const auto bit = bits_.find(name);
    assert(bit != bits_.end());
    needs |= Mask{1} << bit->second;
  }
  const Rank rank(-priority, deadline.value_or(kNever), accepted_++);
  if (deadline) deadlines_.emplace(*deadline, rank);
  rank_of_.emplace(id, rank);
  queue_.emplace(rank, Entry{std::move(id), needs});
  changed_ = true;
}

std::vector<std::string> Arbiter::grant() {
  std::vector<std::string> granted;
  if (!changed_) return granted;
  changed_ = false;
  Mask taken = held_;
  for (const auto& [rank, entry] : queue_) {
    if ((entry.needs & taken) == 0) {
      held_ |= entry.needs;
      running_.emplace(entry.id, entry.needs);
      granted.push_back(entry.id);
    }
    // Also where it has to wait: nobody behind it may take what it waits for.
    taken |= entry.needs;
  }
  for (const std::string& id : granted) remove(id);
  changed_ = false;
  return granted;
}

void Arbiter::release(std::string_view id) {
  const auto found = running_.find(id);
  assert(found != running_.end());
  held_ &= ~found->second;
  running_.erase(found);
  changed_ = true;
}

bool Arbiter::remove(std::string_view id) {
  const auto found = rank_of_.find(id);
  if (found == rank_of_.end()) return false;
  const Rank rank = found->second;
  deadlines_.erase({std::get<Time>(rank), rank});
  queue_.erase(rank);
  rank_of_.erase(found);
  changed_ = true;
  return true;
}

std::vector<std::string> Arbiter::take_expired(Time now) {
  std::set<Rank> expired;
  for (const auto& [deadline, rank] : deadlines_) {
    if (deadline >= now) break;
    expired.insert(rank);
  }
  std::vector<std::string> ids;
  for (const Rank& rank : expired) ids.push_back(queue_.at(rank).id);
  for (const std::string& id : ids) remove(id);
  return ids;
}

std::vector<std::string> Arbiter::queue() const {
  std::vector<std::string> ids;
  for (const auto& [rank, entry] : queue_) ids.push_back(entry.id);
  return ids;
}

}  // namespace pons::bridge
