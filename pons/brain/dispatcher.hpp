// A brain that holds the day's orders, as a warehouse system would: turns what perception believes into tasks, and says
// why it lets the rest ride into the exception chute.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/brain/brain.hpp"
#include "pons/core/belief.hpp"
#include "pons/core/time.hpp"
#include "pons/task/task.hpp"
#include "pons/world/world.hpp"

namespace pons::brain {

struct Order {
  std::string destination;  // a place's name
  int priority = 0;         // 0 … 100; express is kExpressPriority and above
};
using Orders = std::map<std::string, Order, std::less<>>;  // by the label's code

inline constexpr int kExpressPriority = 80;
inline constexpr int kOrdinaryPriority = 50;  // among ordinary parcels the one that leaves first goes first

inline constexpr std::string_view kRideUnreadable = "label unreadable";
inline constexpr std::string_view kRideUnknown = "unknown code";
inline constexpr std::string_view kRideTooLarge = "too large";
inline constexpr std::string_view kRideTwoCodes = "shows two codes";
inline constexpr std::string_view kRideTwice = "code seen twice";
inline constexpr std::string_view kRideLate = "identified out of reach";
inline constexpr std::string_view kRideCovered = "covered by another";
inline constexpr std::string_view kRideHalfSeen = "a part of it was never seen";

// Parcels, as far as labels tell them apart.
struct Tally {
  std::int64_t sorted = 0;
  std::int64_t settled = 0;  // sorted, given up, or let ride; one that failed and is asked for again is not
};

// Asks for a parcel by its code; for one whose task failed and that turns up again, by code and try ("P000123.2"). What
// lies on or leans on another is asked for first; express parcels overtake, but nothing is lost for them that need not
// be. Pure and deterministic; one thread.
class Dispatcher final : public Brain {
 public:
  // `world` must outlive it.
  Dispatcher(Orders orders, const world::World& world);

  [[nodiscard]] Decisions observe(const std::vector<ObjectBelief>& beliefs, Time now,
                                  const std::set<std::string>& set_aside = {}) override;
  void taken_until(double x_m) override { belt_.pick_x_max_m = x_m; }
  bool heard(std::string_view id, task::Outcome outcome) override;
  void recall(const task::Task& task, std::optional<task::Outcome> outcome) override;
  void recall_ride(std::string_view code) override;
  [[nodiscard]] const Tally& tally() const { return tally_; }

  // Orders that nothing was decided about, in their order.
  [[nodiscard]] std::vector<std::string> unseen() const override;
  // Where, along the belt, labels can no longer be read (m).
  [[nodiscard]] double label_view_end_m() const { return label_view_end_m_; }

 private:
  struct Known {
    std::uint32_t track = 0;          // that carries the code now
    int tries = 0;                    // tasks asked for
    bool asked = false;               // the last of them has no outcome yet
    bool sorted = false;              // one of them succeeded: whoever else shows the code is a copy
    bool rode = false;                // it was let go by
    std::optional<double> rode_to_m;  // so far along the belt it was seen then, under this code alone
    bool failed = false;              // the last one failed, and the parcel may turn up again
    std::optional<Time> seen_again;
  };

  void decide(const ObjectBelief& belief, const std::vector<ObjectBelief>& all, Time now, Decisions& decisions);
  void follow(const ObjectBelief& belief);
  [[nodiscard]] bool too_large(const Vector3& size_m, const Order& order) const;
  // Whether one downstream would ride past for an express parcel that itself can wait.
  [[nodiscard]] bool must_wait(const ObjectBelief& express, const std::vector<ObjectBelief>& all) const;
  [[nodiscard]] bool would_ride_past(const ObjectBelief& belief) const;
  // Asked for, or about to be again, and not `set_aside`.
  [[nodiscard]] bool is_waited_for(const ObjectBelief& belief, Time now, const std::set<std::string>& set_aside) const;
  // What lies on it is waited for.
  [[nodiscard]] bool will_be_bare(const ObjectBelief& belief, const std::vector<ObjectBelief>& all, Time now,
                                  const std::set<std::string>& set_aside) const;
  // Unread, since its label lies or lay below what is asked for, or half seen and bare; and about to leave the view of
  // whoever could read it.
  [[nodiscard]] bool is_to_be_read(const ObjectBelief& belief, const std::vector<ObjectBelief>& all, Time now,
                                   const std::set<std::string>& set_aside);
  [[nodiscard]] bool past_label_view(const ObjectBelief& belief) const;
  [[nodiscard]] Json task_for(const ObjectBelief& belief, const Order& order, int tries, Time now) const;
  void ride(const ObjectBelief& belief, std::string_view reason, Decisions& decisions);
  void let_ride(const std::string& code);

  Orders orders_;
  const world::World& world_;
  world::Belt belt_;  // as far as robots take from it
  double label_view_end_m_;
  std::map<std::string, Known, std::less<>> known_;        // codes seen on some track
  std::map<std::string, std::string, std::less<>> asked_;  // code by task id
  std::set<std::uint32_t> decided_;                        // tracks
  // By track, what lay unread below what is asked for, or was waited for bare; and since when the belt waits for it at
  // the end of the view.
  std::map<std::uint32_t, std::optional<Time>> to_be_read_;
  Tally tally_;
};

}  // namespace pons::brain
