// Who may run: resources that only one task may hold, and the queue before them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "pons/core/time.hpp"
#include "pons/world/world.hpp"

namespace pons::bridge {

// What a task asks the arbiter for.
struct Claim {
  std::string id;
  int priority = 50;                                   // 0 … 100, or kFirst
  std::optional<Time> deadline;                        // to start by
  Time accepted;                                       // it waits since then
  std::vector<std::string> resources;                  // twice named is once
  std::vector<std::vector<std::string>> instead = {};  // other ways to do it, of which any one will do
};

// A task takes all its resources at once or waits; it never asks for more while it holds some, so that no circle of
// waiting can close (pons/bridge/models/claims.pml). Tasks wait in the order of priority (higher first), deadline
// (earlier first, none last), acceptance. A waiting task keeps later ones off every resource it needs: it cannot be
// starved by tasks that need less. And with every `ageing` that it has waited it counts one priority more, at last more
// than any brain may ask for, where acceptance alone decides: nor can it be starved by a stream of more important ones.
//
// Where a task can be done in several ways, as by either of two robots, it is granted the first that is free. Whoever
// grants may say of each way whether it fits now; a way that does not keeps nobody waiting (models/ways.pml).
//
// Tasks that need no resource need a seat; there are `running` of them, all alike. Who needs resources needs no seat.
// Seats are given in the same order. Trees may go round for ever, so seats are also shared by turns: who has waited for
// one for `ageing` may have that of one that counts no more, and has had it for as long (models/seats.pml).
//
// Of n waiting ones, O(log n) are the cost of add, remove, release, of each task granted, and each time that one comes
// to count more (about a hundred times in its life, at most). Besides, grant() costs O(m²) of the m different sets of
// resources that are waited for. Where it is asked what fits, at most kLooks of those that wait for the same are looked
// at in one grant(): the first, and as many from where the last one ended. So nobody waits behind those for ever.
class Arbiter {
 public:
  static constexpr std::size_t kMaxResources = 64;
  static constexpr int kFirst = 102;  // the priority of a task that goes before all others
  static constexpr int kLooks = 256;
  // Whether a queued task could be done in that way (0: Claim::resources, then Claim::instead) now.
  using Fits = std::function<bool(std::string_view id, std::size_t way)>;

  // At most kMaxResources names, each once.
  Arbiter(const std::vector<std::string>& resources, const world::Schedule& schedule);

  // Queues a task whose resources are all known and whose id is neither queued nor running (asserted).
  void add(const Claim& claim);
  // The tasks that may start now, in order; they hold their resources from here on. `now` must not run back.
  [[nodiscard]] std::vector<std::string> grant(Time now, const Fits& fits = {});
  // Which of the ways that it waited for a task that runs was granted. It keeps to that one: once handed over, it waits
  // for no other.
  [[nodiscard]] std::size_t way(std::string_view id) const { return running_.find(id)->second.way; }
  // A task that was granted has ended.
  void release(std::string_view id);
  // A task that was granted waits again, for the same way, at the place in the queue that the age gives it with which
  // it was granted; its deadline was met.
  void hand_over(std::string_view id);
  // Withheld, no resource is given from the next grant() on, but to those of kFirst, which may hold something; nor, of
  // all, a seat.
  enum class Withheld : std::uint8_t { kNothing, kResources, kAll };
  void withhold(Withheld what);
  // A task in the queue leaves it, and comes back at the age that it had; whether it is granted, and its deadline, are
  // nobody's concern meanwhile. `now` as for grant().
  void park(std::string_view id, Time now);
  void unpark(std::string_view id, Time now);
  // Takes out a task that waits or is parked; false when there is none.
  bool remove(std::string_view id);
  // Takes out the queued tasks whose deadline is before `now`, in the queue's order.
  [[nodiscard]] std::vector<std::string> take_expired(Time now);

  // Running tasks that stand in the way of others, and of which: of a waiting task whose own priority is urgent, where
  // all who hold what it needs count less than it, aged or not; of one that is urgent by its age, where they have held
  // it for `ageing` besides; of a seat, the one that counts least, also where its turn is over. Of who sits, `stays`
  // says who cannot give way. After grant().
  struct Preemption {
    std::string running, by;
  };
  using Stays = std::function<bool(std::string_view id)>;
  [[nodiscard]] std::vector<Preemption> preemptions(const Stays& stays = {}, const Fits& fits = {}) const;

  // Whether somebody holds that resource; whether somebody waits for it.
  [[nodiscard]] bool has_holder(std::string_view resource) const;
  [[nodiscard]] bool is_waited_for(std::string_view resource) const;

  [[nodiscard]] std::vector<std::string> queue() const;  // in order
  [[nodiscard]] std::size_t queue_length() const { return waiting_.size(); }

 private:
  using Mask = std::uint64_t;
  // Priority negated, aged; deadline, or the end of time; acceptance, or since when after a turn; what came first.
  using Rank = std::tuple<int, Time, Time, std::uint64_t>;
  using Ways = std::vector<Mask>;
  struct Entry {
    Claim claim;
    Ways ways;                                                 // those it may take
    std::size_t way = 0;                                       // of a running one: which of those that it might take
    [[nodiscard]] Mask needs() const { return ways.front(); }  // of a running one: what it holds
    std::uint64_t number = 0;
    Rank rank;                        // by which it waits, or was granted
    std::optional<Time> counts_more;  // while it waits: from when on
    Time since;                       // it waits, or holds what it needs
    Time ages_from;                   // it has waited as long as if ever since then
    bool started = false;             // then its deadline was met
    Time parked_at;                   // of a parked one
  };
  using Entries = std::map<std::string, Entry, std::less<>>;
  // Those that wait for the same resources; with none, for a seat.
  using Lane = std::map<Rank, const Entry*>;
  using Lanes = std::map<Ways, Lane>;
  // Of waiting entries, by a time of theirs.
  using Agenda = std::map<std::pair<Time, std::uint64_t>, Entry*>;

  [[nodiscard]] Mask mask_of(const std::vector<std::string>& resources) const;
  void wait(Entry& entry);
  void wait_no_more(Entry& entry);
  void age();
  void take_rank(Entry& entry) const;
  struct Looked {
    std::string id;  // who was looked at last
    Rank rank;       // behind which the next one is
    int looks = 0;
  };
  // The first entry of all lanes that are none of `passed`, and in each behind the one looked at last; null: none.
  [[nodiscard]] const Entry* next(const std::set<Ways>& passed, const std::map<Ways, Looked>& looked) const;
  // One more look at that lane. False: it was the last.
  [[nodiscard]] bool look_on(const Ways& ways, Looked& looked);
  [[nodiscard]] std::vector<std::size_t> fitting(const Entry& entry, const Fits& fits) const;
  void give(const Entry& entry, std::size_t way, std::vector<std::string>& granted);
  [[nodiscard]] bool gives_way(const Entry& waits, Mask needs, std::vector<std::string>& holders) const;
  [[nodiscard]] bool is_free(Mask needs, Mask taken) const;
  [[nodiscard]] bool has_left(Mask needs, Mask taken) const;
  [[nodiscard]] bool has_seat() const;
  void give_back(const Entry& entry);
  [[nodiscard]] bool gives_seat(const Entry& sits, const Entry& waits) const;
  void make_way(const Entry& waits, const std::vector<std::size_t>& fit, Mask& claimed,
                std::map<std::string, std::string>& by) const;
  void free_seats(const Lane& lane, const Stays& stays, std::map<std::string, std::string>& by) const;

  world::Schedule schedule_;
  std::map<std::string, std::size_t, std::less<>> bits_;
  Entries waiting_, running_, parked_;
  Lanes lanes_;  // none empty
  // At whom the looks of the last grant() ended that had not come to the lane's end. By id: it grows older.
  std::map<Ways, std::string> looked_to_;
  Agenda ageing_, deadlines_;
  Mask held_ = 0;
  Withheld withheld_ = Withheld::kNothing;
  int seated_ = 0;
  std::uint64_t added_ = 0;
  Time now_;
  bool changed_ = false;  // since the last grant(): otherwise there is nothing new to give
};

}  // namespace pons::bridge
