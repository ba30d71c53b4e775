// Who may lie in a chute that was not theirs, because it came along with another unfelt, or nowhere that was theirs: as
// far as cameras, the light curtains below the mouths and the belt's encoder tell.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/time.hpp"
#include "pons/skills/company.hpp"

namespace pons::skills {

struct Stray {
  std::string code;     // empty: nobody has read it
  std::string place;    // empty: it was let go of over its mouth, and has not fallen into it; nobody knows where to
  bool counted = true;  // by that place's light curtain; else it went with its load: into it, or beside
};

// How far the belt has come, and where along it, world frame, it is seen and ends.
struct BeltAt {
  double travel_m = 0, view_end_m = 0, end_m = 0;
};

// Of all arms of a belt, which are told apart by their names, as loads are by their codes. One thread.
class Strays {
 public:
  // A load with that company hangs on the arm's cups. Who has no track is not told from others, nor missed.
  void lifted(const std::string& arm, const std::string& load, const Company& company);
  // One of its company hangs there: its weight is felt.
  void felt(const std::string& load);
  // It lies on the belt again, and who came along, too, most likely: unless a light curtain tells otherwise, of then or
  // soon after. Who is not seen again then is the one that fell.
  void put_back(const std::string& arm, const std::string& load, Time now);
  // It was let go of, or fell, into that place.
  void let_go(const std::string& load, const std::string& place, Time now);
  // The arm lost it, and nobody knows where to; it may lie on a rim, off which it falls later, or hang on the next
  // load. Once it is lifted again, it is not astray. Who was felt on it fell with it: if no camera sees it where it
  // lay, it is named, even if nobody has read it.
  void dropped(const std::string& arm, const std::string& load, Time now);
  // Likewise, but at `when`: it may have been counted since.
  void lost(const std::string& arm, const std::string& load, Time when, Time now);
  // Something fell into that place of the arm's, over which nothing was let go of: one was torn off a load of this
  // moment, or is what was dropped or put back, by whichever arm. Whose nobody tells soon is named without a code.
  void fell(const std::string& arm, const std::string& place, Time now);
  // What was let go of then is not counted where it should have fallen: it went where something of nobody's fell since.
  void uncounted(const std::string& arm, const std::string& load, Time let_go);
  // Something rode off the belt's end.
  void rode_off(double travel_m);
  // Each tick's beliefs: whoever is seen since the load was let go of has stayed, for until then who hangs beside it
  // may be seen, too; of those put back, whoever is seen after a curtain's count, or much later: where all of them are,
  // what was counted is nobody's. Who is believed to lie nowhere any more, and was to be seen, or should have ridden
  // off the belt's end and did not, has gone.
  void look(const std::vector<ObjectBelief>& objects, const BeltAt& belt, Time now);
  // It was taken off the belt by itself.
  void taken(std::uint32_t track);
  // Where it went, if it did; nullptr: it was nobody's company, or was seen since.
  [[nodiscard]] const std::string* place_of(const std::string& code) const;
  // It was found gone, and not seen since.
  [[nodiscard]] bool is_gone(const std::string& code) const;
  // It was put back beside others, and since a curtain counted one of them no camera has seen it: what lies in its
  // place may be another.
  [[nodiscard]] bool may_have_fallen(const std::string& code) const;
  // The cups met nothing where it should lie. True once they have before, with no camera's having seen it meanwhile.
  [[nodiscard]] bool missed_twice(const std::string& code);
  // For what lies on the belt and no camera has seen: whichever arm put it there, no other has that track.
  [[nodiscard]] std::uint32_t next_unseen_track() { return next_unseen_track_++; }
  // Those found gone since the last call.
  [[nodiscard]] std::vector<Stray> take_found_gone() { return std::exchange(found_gone_, {}); }

 private:
  std::uint32_t next_unseen_track_ = 0x8000'0000;
  struct Doubted {
    std::uint32_t track = 0;
    std::string arm, load;       // with which it may have come along
    Stray stray;                 // the place is the load's; empty as long as nobody knows it
    std::optional<Time> let_go;  // of the load
    std::optional<Time> fell;    // once it was put back: then a light curtain counted it or another of them
    // As it was last believed to lie, along the belt; and the belt's travel when its middle comes to the end.
    std::optional<double> at_m = {};
    double half_m = 0, ends_m = 0;
    Time seen;  // since its load was let go of
    bool missed = false, gone = false, told = false, put_back = false;
    bool felt = false;  // it or another of them, on the load
  };
  // What fell into a place of an arm's, and was nobody's.
  struct Fall {
    std::string arm, place;
    Time time;
  };
  // One of a load's company, where a light curtain has told.
  struct Torn {
    std::string load, arm, place;
    Time time;
  };
  [[nodiscard]] const std::string& place_of(const Doubted& one) const;
  void found_gone(Doubted& one);
  void fell_beside(const std::string& load, const std::string& place, Time now);
  [[nodiscard]] bool have_all_fallen(const std::string& load) const;
  [[nodiscard]] static bool has_stayed(const Doubted& one);
  void forget_stayed();
  [[nodiscard]] std::ptrdiff_t may_have_fallen_of(const std::string& load) const;
  void find_fallen(Time now);
  void leave(const std::string& arm, const std::string& load, Time now, bool put_back);
  void leave_company(const std::string& load, Time now);
  void doubt_itself(const std::string& arm, const std::string& load, Time now, bool put_back);
  [[nodiscard]] const Doubted* of(const std::string& code) const;  // of one whose load was let go of
  [[nodiscard]] static bool is_over(const Doubted& one, const BeltAt& belt);
  [[nodiscard]] bool has_ridden_off(const Doubted& one) const;

  std::vector<Doubted> doubted_;
  std::vector<Torn> torn_;  // and not found gone yet
  std::vector<Fall> nobodys_;
  std::vector<Stray> found_gone_;
  std::vector<double> rode_off_;  // the belt's travel each time
};

}  // namespace pons::skills
