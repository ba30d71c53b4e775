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
  explicit Fallen(double belt_ends_m) : belt_ends_m_(belt_ends_m) {}

  // It lands about there, world frame, while `objects` are believed.
  void fell(std::string code, const Vector3& size_m, const Vector3& lands_m, const std::vector<ObjectBelief>& objects,
            Time now);
  // Each tick, with the belt having ridden on: the tracks that are recognised now, by their codes. Nothing is while two
  // might be it, or while anything as large that was believed then no longer is: it may be that, found again.
  [[nodiscard]] std::vector<std::pair<std::uint32_t, std::string>> recognise(const std::vector<ObjectBelief>& objects,
                                                                             double rode_m, Time now);
  // The same beyond the cameras' view, where it stands no higher than `top_m`.
  void fell_unseen(std::string code, const Vector3& size_m, const Vector3& lands_m, double top_m);
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
    Time fell;
    std::vector<std::uint32_t> known, as_large;  // tracks then, and those of its size
  };
  [[nodiscard]] static const ObjectBelief* only_one(const Load& load, const std::vector<ObjectBelief>& objects);

  struct Unseen {
    std::string code;
    ObjectBelief room;
  };

  double belt_ends_m_;
  std::vector<Load> loads_;
  std::vector<Unseen> unseen_;
};

}  // namespace pons::skills
