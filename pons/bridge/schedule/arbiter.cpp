#include "pons/bridge/schedule/arbiter.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace pons::bridge {
namespace {

constexpr Time kNever{Duration::max()};
constexpr int kAged = Arbiter::kFirst - 1;  // above what any brain may ask for

}  // namespace

Arbiter::Arbiter(const std::vector<std::string>& resources, const world::Schedule& schedule) : schedule_(schedule) {
  assert(resources.size() <= kMaxResources);
  for (const std::string& name : resources) {
    [[maybe_unused]] const bool added = bits_.emplace(name, bits_.size()).second;
    assert(added);
  }
}

// ---- the queue ----

void Arbiter::add(const Claim& claim) {
  assert(waiting_.find(claim.id) == waiting_.end() && running_.find(claim.id) == running_.end() &&
         parked_.find(claim.id) == parked_.end());
  Entry& entry = waiting_[claim.id];
  entry.claim = claim;
  entry.number = added_++;
  entry.since = entry.ages_from = claim.accepted;
  entry.ways = {mask_of(claim.resources)};
  for (const auto& resources : claim.instead) entry.ways.push_back(mask_of(resources));
  wait(entry);
}

bool Arbiter::has_holder(std::string_view resource) const {
  const auto bit = bits_.find(resource);
  return bit != bits_.end() && (held_ >> bit->second & 1U) != 0;
}

bool Arbiter::is_waited_for(std::string_view resource) const {
  const auto bit = bits_.find(resource);
  if (bit == bits_.end()) return false;
  return std::ranges::any_of(lanes_, [&](const auto& lane) {
    return std::ranges::any_of(lane.first, [&](Mask needs) { return (needs >> bit->second & 1U) != 0; });
  });
}

Arbiter::Mask Arbiter::mask_of(const std::vector<std::string>& resources) const {
  Mask mask = 0;
  for (const std::string& name : resources) {
    const auto bit = bits_.find(name);
    assert(bit != bits_.end());
    mask |= Mask{1} << bit->second;
  }
  return mask;
}

void Arbiter::park(std::string_view id, Time now) {
  const auto found = waiting_.find(id);
  assert(found != waiting_.end());
  wait_no_more(found->second);
  found->second.parked_at = now;
  parked_.insert(waiting_.extract(found));
}

void Arbiter::unpark(std::string_view id, Time now) {
  const auto found = parked_.find(id);
  assert(found != parked_.end());
  Entry& entry = found->second;
  entry.since += now - entry.parked_at;
  entry.ages_from += now - entry.parked_at;
  waiting_.insert(parked_.extract(found));
  wait(entry);
}

bool Arbiter::remove(std::string_view id) {
  if (const auto parked = parked_.find(id); parked != parked_.end()) return parked_.erase(parked), true;
  const auto found = waiting_.find(id);
  if (found == waiting_.end()) return false;
  wait_no_more(found->second);
  waiting_.erase(found);
  return true;
}

// What it counts for now, and when for more.
void Arbiter::take_rank(Entry& entry) const {
  const Claim& claim = entry.claim;
  const auto waited = std::max<std::int64_t>(0, (now_ - entry.ages_from) / schedule_.ageing);
  const auto missing = std::max(0, kAged - claim.priority);
  const int gained = static_cast<int>(std::min<std::int64_t>(waited, missing));
  const int counts = claim.priority + gained;
  entry.counts_more.reset();
  if (gained < missing) entry.counts_more = entry.ages_from + (gained + 1) * schedule_.ageing;
  // Who gave up a turn comes after all who count as much: what it gave to one of them must not be its own again.
  const bool again = entry.started && (entry.needs() == 0 || counts == kAged);
  const Time deadline = counts == kAged || again ? kNever : claim.deadline.value_or(kNever);
  entry.rank = {-counts, deadline, again ? entry.since : claim.accepted, entry.number};
}

void Arbiter::wait(Entry& entry) {
  take_rank(entry);
  lanes_[entry.ways].emplace(entry.rank, &entry);
  if (entry.counts_more) ageing_.emplace(std::pair(*entry.counts_more, entry.number), &entry);
  if (entry.claim.deadline && !entry.started)
    deadlines_.emplace(std::pair(*entry.claim.deadline, entry.number), &entry);
  changed_ = true;
}

void Arbiter::wait_no_more(Entry& entry) {
  const auto lane = lanes_.find(entry.ways);
  lane->second.erase(entry.rank);
  if (lane->second.empty()) lanes_.erase(lane);
  if (entry.counts_more) ageing_.erase({*entry.counts_more, entry.number});
  if (entry.claim.deadline) deadlines_.erase({*entry.claim.deadline, entry.number});
  changed_ = true;
}

void Arbiter::age() {
  while (!ageing_.empty() && ageing_.begin()->first.first <= now_) {
    Entry& entry = *ageing_.begin()->second;
    wait_no_more(entry);
    wait(entry);
  }
}

std::vector<std::string> Arbiter::take_expired(Time now) {
  std::map<Rank, std::string> expired;
  for (const auto& [when, entry] : deadlines_) {
    if (when.first >= now) break;
    expired.emplace(entry->rank, entry->claim.id);
  }
  std::vector<std::string> ids;
  for (auto& [rank, id] : expired) {
    remove(id);
    ids.push_back(std::move(id));
  }
  return ids;
}

std::vector<std::string> Arbiter::queue() const {
  Lane all;
  for (const auto& [needs, lane] : lanes_) all.insert(lane.begin(), lane.end());
  std::vector<std::string> ids;
  ids.reserve(all.size());
  for (const auto& [rank, entry] : all) ids.push_back(entry->claim.id);
  return ids;
}

// ---- resources ----

const Arbiter::Entry* Arbiter::next(const std::set<Ways>& passed, const std::map<Ways, Looked>& looked) const {
  const Lane::value_type* first = nullptr;
  for (const auto& [ways, lane] : lanes_) {
    if (passed.contains(ways)) continue;
    const auto last = looked.find(ways);
    const auto head = last == looked.end() ? lane.begin() : lane.upper_bound(last->second.rank);
    if (head != lane.end() && (first == nullptr || head->first < first->first)) first = &*head;
  }
  return first == nullptr ? nullptr : first->second;
}

bool Arbiter::look_on(const Ways& ways, Looked& looked) {
  const auto resumes = looked_to_.find(ways);
  if (++looked.looks == kLooks / 2 && resumes != looked_to_.end()) {
    const auto last = waiting_.find(resumes->second);
    if (last != waiting_.end()) looked.rank = std::max(looked.rank, last->second.rank);
    looked_to_.erase(resumes);  // unless it ends before the lane does once more
  }
  if (looked.looks < kLooks) return true;
  looked_to_.insert_or_assign(ways, looked.id);
  return false;
}

std::vector<std::size_t> Arbiter::fitting(const Entry& entry, const Fits& fits) const {
  std::vector<std::size_t> ways;
  for (std::size_t way = 0; way < entry.ways.size(); ++way) {
    if (!fits || fits(entry.claim.id, way)) ways.push_back(way);
  }
  return ways;
}

std::vector<std::string> Arbiter::grant(Time now, const Fits& fits) {
  now_ = now;
  age();
  std::vector<std::string> granted;
  if (!changed_ && !fits) return granted;
  Mask taken = held_;
  std::set<Ways> passed;
  std::map<Ways, Looked> looked;
  while (const Entry* const entry = next(passed, looked)) {
    const Ways ways = entry->ways;  // the entry may be elsewhere soon
    Looked& there = looked[ways];
    there.id = entry->claim.id, there.rank = entry->rank;
    const bool bars = withheld_ != Withheld::kNothing && entry->claim.priority != kFirst;
    const Mask barred = bars ? ~Mask{0} : 0;
    const std::vector<std::size_t> fit = fitting(*entry, fits);
    const auto free = std::ranges::find_if(fit, [&](std::size_t way) { return is_free(ways[way], taken | barred); });
    if (free != fit.end()) {
      taken |= ways[*free];
      give(*entry, *free, granted);
    } else {
      // It has to wait: nobody behind it, in its lane or another, may take what it waits for.
      for (const std::size_t way : fit) taken |= ways[way];
    }
    const bool all_taken = std::ranges::none_of(ways, [&](Mask needs) { return has_left(needs, taken | barred); });
    if (all_taken || (fits && !look_on(ways, there))) passed.insert(ways);
  }
  changed_ = false;
  return granted;
}

void Arbiter::give(const Entry& waits, std::size_t way, std::vector<std::string>& granted) {
  Entry& entry = waiting_.find(waits.claim.id)->second;
  wait_no_more(entry);  // and the lane may be no more
  entry.started = true;
  entry.since = now_;
  entry.way = way;
  entry.ways = {entry.ways[way]};
  held_ |= entry.needs();
  seated_ += entry.needs() == 0 ? 1 : 0;
  granted.push_back(entry.claim.id);
  running_.insert(waiting_.extract(entry.claim.id));
}

bool Arbiter::is_free(Mask needs, Mask taken) const { return needs != 0 ? (needs & taken) == 0 : has_seat(); }

// Whether any of it may be given, or kept for who waits for all of it.
bool Arbiter::has_left(Mask needs, Mask taken) const { return needs != 0 ? (needs & ~taken) != 0 : has_seat(); }

bool Arbiter::has_seat() const { return seated_ < schedule_.running && withheld_ != Withheld::kAll; }

void Arbiter::withhold(Withheld what) {
  changed_ = changed_ || what != withheld_;
  withheld_ = what;
}

void Arbiter::give_back(const Entry& entry) {
  held_ &= ~entry.needs();
  seated_ -= entry.needs() == 0 ? 1 : 0;
}

void Arbiter::release(std::string_view id) {
  const auto found = running_.find(id);
  assert(found != running_.end());
  give_back(found->second);
  running_.erase(found);
  changed_ = true;
}

void Arbiter::hand_over(std::string_view id) {
  const auto found = running_.find(id);
  assert(found != running_.end());
  Entry& entry = found->second;
  give_back(entry);
  entry.ages_from += now_ - entry.since;  // who runs grows no older
  entry.since = now_;
  waiting_.insert(running_.extract(found));
  wait(entry);
}

bool Arbiter::gives_seat(const Entry& sits, const Entry& waits) const {
  const int more = std::get<int>(sits.rank) - std::get<int>(waits.rank);  // that the waiting one counts
  if (waits.claim.priority >= schedule_.urgent_priority && more > 0) return true;
  return more >= 0 && now_ - sits.since >= schedule_.ageing && now_ - waits.since >= schedule_.ageing;
}

// One for each of the first that wait, as far as there are any: who comes after one that gets none gains nothing.
void Arbiter::free_seats(const Lane& lane, const Stays& stays, std::map<std::string, std::string>& by) const {
  std::vector<const Entry*> sitting;
  for (const auto& [id, entry] : running_) {
    if (entry.needs() == 0 && !(stays && stays(id))) sitting.push_back(&entry);
  }
  std::ranges::sort(sitting, [](const Entry* a, const Entry* b) {
    return std::tuple(-std::get<int>(a->rank), a->since, a->number) <
           std::tuple(-std::get<int>(b->rank), b->since, b->number);
  });
  for (const auto& [rank, waits] : lane) {
    const auto found = std::ranges::find_if(sitting, [&](const Entry* sits) { return gives_seat(*sits, *waits); });
    if (found == sitting.end()) return;
    by.emplace((*found)->claim.id, waits->claim.id);
    sitting.erase(found);
  }
}

// Whether all who hold any of it make way, where they count less: at once for what is urgent by its own priority; for
// what is by its age, once they had their turn, for they may never end. Who can grow no older takes turns with its
// like.
bool Arbiter::gives_way(const Entry& waits, Mask needs, std::vector<std::string>& holders) const {
  const bool urgent = waits.claim.priority >= schedule_.urgent_priority;
  holders.clear();
  for (const auto& [id, entry] : running_) {
    if ((entry.needs() & needs) == 0) continue;
    holders.push_back(id);
    const int more = std::get<int>(entry.rank) - std::get<int>(waits.rank);  // that the waiting one counts
    const bool over = now_ - entry.since >= schedule_.ageing && now_ - waits.since >= schedule_.ageing;
    const bool alike = more == 0 && std::get<int>(waits.rank) == -kAged;
    if (!(more > 0 ? urgent || over : alike && over)) return false;
  }
  return true;
}

// In the first of the ways that fit in which it can be helped, and that nobody before it waits for.
void Arbiter::make_way(const Entry& waits, const std::vector<std::size_t>& fit, Mask& claimed,
                       std::map<std::string, std::string>& by) const {
  for (const std::size_t way : fit) {
    const Mask needs = waits.ways[way];
    const bool alone = (claimed & needs) == 0;
    claimed |= needs;
    std::vector<std::string> holders;
    if (!alone || !gives_way(waits, needs, holders)) continue;
    for (std::string& id : holders) by.emplace(std::move(id), waits.claim.id);
    return;
  }
}

std::vector<Arbiter::Preemption> Arbiter::preemptions(const Stays& stays, const Fits& fits) const {
  std::map<std::string, std::string> by;
  Mask claimed = 0;  // by those before: who comes after them gains nothing by a preemption
  std::set<Ways> passed;
  std::map<Ways, Looked> looked;
  while (const Entry* const entry = next(passed, looked)) {
    const Ways& ways = entry->ways;
    if (ways == Ways{0} && withheld_ != Withheld::kAll) free_seats(lanes_.find(ways)->second, stays, by);
    // Who counts less than an urgent task, aged or not, takes nothing from anybody, nor does who is behind it.
    if (ways == Ways{0} || withheld_ != Withheld::kNothing || -std::get<int>(entry->rank) < schedule_.urgent_priority) {
      passed.insert(ways);
      continue;
    }
    make_way(*entry, fitting(*entry, fits), claimed, by);
    Looked& there = looked[ways];
    there.rank = entry->rank;
    const bool all_claimed = std::ranges::none_of(ways, [&](Mask needs) { return has_left(needs, claimed); });
    if (all_claimed || ++there.looks == kLooks) passed.insert(ways);
  }
  std::vector<Preemption> preemptions;
  for (auto& [running, urgent] : by) preemptions.push_back({running, urgent});
  return preemptions;
}

}  // namespace pons::bridge
