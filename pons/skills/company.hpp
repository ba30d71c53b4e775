// What lay so close to a parcel that it may have come along when that was lifted: tape, a flap or film that hooks. The
// wrist feels most of it at once. What it does not feel is missed later, and went where the load was let go of.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/time.hpp"

namespace pons::skills {

struct Companion {
  std::string code;         // empty: not read
  Eigen::Vector2d aside_m;  // the middle of its top from that of the load's, tip frame
};
using Company = std::vector<Companion>;

// Of `target`, taken hold of with the tip turned like that.
[[nodiscard]] Company company_of(const ObjectBelief& target, const std::vector<ObjectBelief>& objects,
                                 const Eigen::Matrix3d& world_from_tip);

// Who may lie in a chute that was not theirs. One thread.
class Strays {
 public:
  // A load with that company was let go of, or fell, into that place.
  void let_go(const Company& company, const std::string& place, Time now);
  // Each tick's beliefs: whoever is seen has stayed.
  void look(const std::vector<ObjectBelief>& objects);
  // Where it went, if it did; nullptr: it was nobody's company, or was seen since.
  [[nodiscard]] const std::string* place_of(const std::string& code) const;
  // The cups met nothing where it should lie. True once they have before, with no camera's having seen it meanwhile.
  [[nodiscard]] bool missed_twice(const std::string& code);

 private:
  struct Gone {
    std::string place;
    Time since;
    bool missed = false;
  };
  std::map<std::string, Gone> gone_;  // by code
};

}  // namespace pons::skills
