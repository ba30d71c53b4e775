// Loads that the cups lost over the belt. Where they come to lie is known roughly, how not at all, and the label may be
// below: the first thing that is seen about there and is as large is taken for it. Where no camera sees it, it is in
// the way until it has ridden off the belt's end.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/pose.hpp"
#include "pons/core/time.hpp"

namespace pons::skills {

// One thread.
class Fallen {
 public:
  // Where, along the belt, cameras see it last, and where it ends.
  Fallen(double view_ends_m, double belt_ends_m) : view_ends_m_(view_ends_m), belt_ends_m_(belt_ends_m) {}

  // It lands about there, world frame, while `objects` are believed, and stands no higher than `top_m`.
  void fell(std::string code, const Vector3& size_m, const Vector3& lands_m, double top_m,
            const std::vector<ObjectBelief>& objects, Time now);
  // The same beyond the cameras' view.
  void fell_unseen(std::string code, const Vector3& size_m, const Vector3& lands_m, double top_m);
  // Each tick, with the belt having ridden on: the tracks that are recognised now, by their codes. Nothing is while two
  // might be it, or while anything as large that was believed then no longer is: it may be that, found again. What is
  // awaited in vain near the view's end lies beyond it, maybe.
  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::string>> recognise(const std::vector<ObjectBelief>& objects,
                                                                             double rode_m, Time now);
  // Of those recognised, by a side or two of which more was hidden, as it turns out now: tracks that are too large.
  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::string>> take_mistaken(
      const std::vector<ObjectBelief>& objects);
  // What lies there, without track and label, riding at that speed: room that may be taken.
  void add_unseen(std::vector<ObjectBelief>& objects, double speed_m_s, Time now) const;
  // It is known to lie elsewhere.
  void forget(std::string_view code);
  // Whether it may still be recognised.
  [[nodiscard]] bool awaits(std::string_view code) const;

 private:
  struct Load {
    std::string code;
    Vector3 size_m, lands_m;
    double top_m;
    Time fell;
    std::vector<std::uint32_t> known, as_large;  // tracks then, and those of its size
  };
  [[nodiscard]] static const ObjectBelief* only_one(const Load& load, const std::vector<ObjectBelief>& objects);

  struct Unseen {
    std::string code;
    ObjectBelief room;
  };

  struct Recognised {
    std::uint32_t track;
    std::string code;
    Vector3 size_m;
  };

  double view_ends_m_, belt_ends_m_;
  std::vector<Load> loads_;
  std::vector<Unseen> unseen_;
  std::vector<Recognised> recognised_;  // and believed still
};

}  // namespace pons::skills
