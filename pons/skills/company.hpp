// What lay so close to a parcel that it may have come along when that was lifted: tape, a flap or film that hooks. The
// wrist feels most of it at once. What it does not feel is missed later, and went where the load was let go of.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/time.hpp"

namespace pons::skills {

struct Companion {
  std::uint32_t track = 0;
  std::string code;         // empty: not read
  Eigen::Vector2d aside_m;  // the middle of its top from that of the load's, tip frame
};
using Company = std::vector<Companion>;

// Of `target`, taken hold of with the tip turned like that.
[[nodiscard]] Company company_of(const ObjectBelief& target, const std::vector<ObjectBelief>& objects,
                                 const Eigen::Matrix3d& world_from_tip);

struct Stray {
  std::string code;  // empty: nobody has read it
  std::string place;
};

// Who may lie in a chute that was not theirs. One thread.
class Strays {
 public:
  // A load with that company was let go of, or fell, into that place.
  void let_go(const Company& company, const std::string& place, Time now);
  // Each tick's beliefs: whoever is seen has stayed. Who is believed to lie nowhere any more, and was to be seen up to
  // `view_end_m` along the belt, has gone.
  void look(const std::vector<ObjectBelief>& objects, double view_end_m);
  // It was taken off the belt by itself.
  void taken(std::uint32_t track);
  // Where it went, if it did; nullptr: it was nobody's company, or was seen since.
  [[nodiscard]] const std::string* place_of(const std::string& code) const;
  // The cups met nothing where it should lie. True once they have before, with no camera's having seen it meanwhile.
  [[nodiscard]] bool missed_twice(const std::string& code);
  // Those found gone since the last call.
  [[nodiscard]] std::vector<Stray> take_found_gone() { return std::exchange(found_gone_, {}); }

 private:
  struct Doubted {
    std::uint32_t track;
    Stray stray;
    Time since;
    std::optional<double> at_m = {};  // along the belt, as it was last believed to lie
    bool missed = false, gone = false;
  };
  std::vector<Doubted> doubted_;
  std::vector<Stray> found_gone_;
};

}  // namespace pons::skills
