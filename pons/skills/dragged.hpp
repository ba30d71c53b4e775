// Who hung on a load that was put back may have come off on the way, further downstream than it was believed to lie: a
// lift rides along, and the belt may wait meanwhile. As long as a camera shows it where it lay, nothing is in doubt.
// Once it is no longer believed to lie there, and nobody has seen it since, it is in the way from there on as far as
// the load was carried, until it is seen or has ridden off the belt's end.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/time.hpp"
#include "pons/skills/company.hpp"

namespace pons::skills {

// One thread.
class Dragged {
 public:
  // That company hung on a load, and may have been carried so far downstream, m, beside the belt's travel. `objects`
  // are believed as the load is put back.
  void put_back(const Company& company, double by_m, const std::vector<ObjectBelief>& objects, Time now);
  // Each tick: what is believed, and how far the belt has ridden on, m; beyond `belt_ends_m`, world frame, it has gone.
  void look(const std::vector<ObjectBelief>& objects, double rode_m, double belt_ends_m);
  // Room that may be taken, without track and label, riding at that speed.
  void add_unseen(std::vector<ObjectBelief>& objects, double speed_m_s, Time now) const;

 private:
  struct One {
    std::uint32_t track;
    std::string code;
    ObjectBelief room;
    Time since;
    bool gone = false;  // from where it was believed to lie
  };
  [[nodiscard]] static bool is_seen(const One& one, const std::vector<ObjectBelief>& objects);

  std::vector<One> ones_;
};

}  // namespace pons::skills
