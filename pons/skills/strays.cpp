#include "pons/skills/strays.hpp"

#include <algorithm>
#include <utility>

namespace pons::skills {
namespace {

constexpr std::size_t kRemembered = 64;                         // of those who are gone
constexpr Duration kTornOff = std::chrono::milliseconds(3000);  // off a rim, too, after the load was let go of
constexpr Duration kFalls = std::chrono::milliseconds(1000);    // from letting go to a curtain, perhaps another's
constexpr Duration kClaimed = std::chrono::seconds(5);          // what fell: by then, or nobody knows whose it was
constexpr Duration kLooked = std::chrono::seconds(2);           // after a fall: who lies in view has been seen again
constexpr Duration kAstray = std::chrono::seconds(30);          // after a load was dropped: something may push it
constexpr std::uint32_t kNoTrack = 0xFFFF'FFFF;
// Of the belt's travel, between what was to ride off and what a light curtain says did: pushed, it may have slid.
constexpr double kSooner_m = 0.05, kLater_m = 0.30;

void forget_oldest(auto& list) {
  if (list.size() > kRemembered) list.erase(list.begin(), list.end() - static_cast<std::ptrdiff_t>(kRemembered));
}

}  // namespace

void Strays::lifted(const std::string& arm, const std::string& load, const Company& company) {
  // Somebody may have put it back, of whom nobody told.
  std::erase_if(doubted_, [&](const Doubted& one) { return one.load == load && !one.let_go; });
  std::erase_if(torn_, [&](const Torn& torn) { return torn.load == load; });
  std::erase_if(doubted_, [&](const Doubted& one) { return one.track == kNoTrack && one.stray.code == load; });
  for (const Companion& companion : company) {
    if (companion.track == 0) continue;
    std::erase_if(doubted_, [&](const Doubted& one) { return one.put_back && one.stray.code == companion.code; });
    Doubted one;
    one.track = companion.track;
    one.arm = arm;
    one.load = load;
    one.stray.code = companion.code;
    doubted_.push_back(std::move(one));
  }
  forget_oldest(doubted_);
}

void Strays::felt(const std::string& load) {
  for (Doubted& one : doubted_) one.felt = one.felt || (one.load == load && !one.let_go);
}

void Strays::put_back(const std::string& arm, const std::string& load, Time now) { leave(arm, load, now, true); }

// What a curtain counted while it hung there may be itself: the cups are open a while before they are known to be.
void Strays::leave(const std::string& arm, const std::string& load, Time now, bool put_back) {
  const auto torn = std::ranges::find(torn_, load, &Torn::load);
  const std::string place = torn != torn_.end() ? torn->place : std::string();
  leave_company(load, now);
  doubt_itself(arm, load, now, put_back);
  if (!place.empty()) fell_beside(load, place, now);
}

// Whose label is known: of the others nobody could tell who it was.
void Strays::leave_company(const std::string& load, Time now) {
  const auto hung = [&](const Doubted& one) { return one.load == load && !one.let_go; };
  std::erase_if(doubted_, [&](const Doubted& one) { return hung(one) && one.stray.code.empty(); });
  for (Doubted& one : doubted_) {
    if (!hung(one)) continue;
    one.let_go = now;
    one.put_back = true;
    one.gone = false;
  }
  std::erase_if(torn_, [&](const Torn& each) { return each.load == load; });
}

void Strays::doubt_itself(const std::string& arm, const std::string& load, Time now, bool put_back) {
  std::erase_if(doubted_, [&](const Doubted& one) { return one.stray.code == load; });
  Doubted one;
  one.track = kNoTrack;
  one.arm = arm;
  one.load = one.stray.code = load;
  one.let_go = now;
  one.put_back = put_back;
  doubted_.push_back(std::move(one));
  forget_oldest(doubted_);
}

void Strays::let_go(const std::string& load, const std::string& place, Time now) {
  std::vector<Doubted> own;
  for (const Doubted& one : doubted_)
    if (one.load == load && !one.let_go) own.push_back(one);
  std::erase_if(doubted_, [&](const Doubted& one) { return one.load == load && !one.let_go; });
  for (Doubted& one : own) {
    // Who may have gone with an earlier one has gone with the last.
    std::erase_if(doubted_, [&](const Doubted& earlier) {
      return earlier.track == one.track || (!one.stray.code.empty() && one.stray.code == earlier.stray.code);
    });
    one.let_go = now;
    one.stray.place = place;
    one.stray.counted = false;
    doubted_.push_back(std::move(one));
  }
}

// With others, whatever is counted next may be one of them.
void Strays::dropped(const std::string& arm, const std::string& load, Time now) {
  const bool with_others = std::ranges::any_of(
      doubted_, [&](const Doubted& one) { return one.load == load && !one.let_go && !one.stray.code.empty(); });
  // Who was not read is forgotten with its load, but who was felt is known to have fallen.
  for (Doubted& one : doubted_)
    if (one.load == load && one.felt && one.stray.code.empty() && !one.let_go) one.let_go = now;
  leave(arm, load, now, with_others);
}

void Strays::lost(const std::string& arm, const std::string& load, Time when, Time now) {
  dropped(arm, load, now);
  const auto since = [&](const Fall& one) { return one.arm == arm && one.time > when; };
  const auto fall = std::ranges::find_if(nobodys_, since);
  if (fall == nobodys_.end()) return;
  const std::string place = fall->place;
  nobodys_.erase(fall);
  fell(arm, place, now);
}

void Strays::fell(const std::string& arm, const std::string& place, Time now) {
  const auto torn = std::ranges::find_if(doubted_.rbegin(), doubted_.rend(), [&](const Doubted& one) {
    const bool told = one.told || (one.put_back && !one.stray.place.empty());
    const Duration within = one.stray.place.empty() && one.seen == Time{} ? kAstray : kTornOff;
    const bool there = one.arm == arm || one.put_back;  // the belt carries it on to the next arm
    return there && !told && !(one.let_go && now > *one.let_go + within) && !have_all_fallen(one.load);
  });
  if (torn == doubted_.rend()) return void(nobodys_.push_back({arm, place, now}));
  if (torn->put_back) return fell_beside(torn->load, place, now);
  torn_.push_back({torn->load, arm, place, now});
  forget_oldest(torn_);
  if (!torn->let_go || !torn->stray.place.empty()) return;
  torn->gone = true;
  found_gone(*torn);
}

// Each is counted once, and what is counted beyond them is another's.
bool Strays::have_all_fallen(const std::string& load) const {
  return std::ranges::count(torn_, load, &Torn::load) >=
         std::ranges::count_if(doubted_, [&](const Doubted& one) { return one.load == load && !one.told; });
}

void Strays::uncounted(const std::string& arm, const std::string& load, Time let_go) {
  const auto fall =
      std::ranges::find_if(nobodys_, [&](const Fall& one) { return one.arm == arm && one.time > let_go; });
  found_gone_.push_back({load, fall != nobodys_.end() ? fall->place : std::string()});
  if (fall != nobodys_.end()) nobodys_.erase(fall);
}

// Who of those that were put back together is not known; who is seen after that is not in doubt.
void Strays::fell_beside(const std::string& load, const std::string& place, Time now) {
  for (Doubted& one : doubted_)
    if (one.put_back && one.load == load && one.stray.place.empty()) one.stray.place = place, one.fell = now;
}

// Who was put back may lean on a neighbour, or hang on the belt's edge, where it is seen, and then fall off.
bool Strays::has_stayed(const Doubted& one) {
  if (!one.let_go || one.seen <= one.fell.value_or(*one.let_go)) return false;
  return !one.put_back || one.fell || one.seen > *one.let_go + kTornOff;
}

// The last one to be seen again, of a load's company or of those that one fell beside, leaves a fall that was
// another's.
void Strays::forget_stayed() {
  for (auto one = doubted_.begin(); one != doubted_.end();) {
    if (!has_stayed(*one)) {
      ++one;
      continue;
    }
    const Doubted stayed = *one;
    one = doubted_.erase(one);
    if (stayed.fell && !stayed.told && may_have_fallen_of(stayed.load) == 0)
      nobodys_.push_back({stayed.arm, stayed.stray.place, *stayed.fell});
    const auto own = [&](const auto& each) { return each.load == stayed.load; };
    if (std::ranges::any_of(doubted_, own)) continue;
    for (const Torn& torn : torn_)
      if (own(torn)) nobodys_.push_back({torn.arm, torn.place, torn.time});
    std::erase_if(torn_, own);
  }
}

std::ptrdiff_t Strays::may_have_fallen_of(const std::string& load) const {
  return std::ranges::count_if(doubted_, [&](const Doubted& one) { return one.fell && one.load == load; });
}

void Strays::find_fallen(Time now) {
  for (Doubted& one : doubted_) {
    if (!one.put_back || one.gone || !one.fell || now < *one.fell + kLooked || may_have_fallen_of(one.load) > 1)
      continue;
    one.gone = one.told = true;
    found_gone_.push_back(one.stray);
  }
}

// As many of a load's company as were counted were torn off; the others, if they are gone, went with it.
const std::string& Strays::place_of(const Doubted& one) const {
  if (one.told) return one.stray.place;
  const auto torn = std::ranges::find(torn_, one.load, &Torn::load);
  return torn != torn_.end() ? torn->place : one.stray.place;
}

void Strays::found_gone(Doubted& one) {
  const auto torn = std::ranges::find(torn_, one.load, &Torn::load);
  if (torn != torn_.end()) {
    one.stray.place = torn->place;
    one.stray.counted = true;
    torn_.erase(torn);
  }
  one.told = true;
  found_gone_.push_back(one.stray);
}

void Strays::rode_off(double travel_m) {
  rode_off_.push_back(travel_m);
  forget_oldest(rode_off_);
}

void Strays::taken(std::uint32_t track) {
  std::erase_if(doubted_, [&](const Doubted& one) { return one.track == track; });
}

void Strays::look(const std::vector<ObjectBelief>& objects, const BeltAt& belt, Time now) {
  std::erase_if(nobodys_, [&](const Fall& fall) {
    const bool unclaimed = now > fall.time + kClaimed;
    if (unclaimed) found_gone_.push_back({{}, fall.place});
    return unclaimed;
  });
  if (doubted_.empty()) return;
  for (const ObjectBelief& object : objects) {
    for (Doubted& one : doubted_) {
      const bool same = one.track == object.track || (!one.stray.code.empty() && one.stray.code == object.code);
      if (same && one.let_go && object.last_seen > *one.let_go) one.seen = std::max(one.seen, object.last_seen);
    }
  }
  forget_stayed();
  find_fallen(now);
  for (Doubted& one : doubted_) {
    const auto object = std::ranges::find(objects, one.track, &ObjectBelief::track);
    const bool believed = object != objects.end();
    if (believed) {
      one.at_m = object->world_from_top.translation().x();
      one.half_m = 0.5 * object->size_m.head<2>().norm();
      one.ends_m = belt.travel_m + belt.end_m - *one.at_m;
      if (one.stray.code.empty()) one.stray.code = object->code;
    }
    if (one.gone || one.put_back || !one.at_m) continue;
    const bool unseen = !believed && *one.at_m < belt.view_end_m;
    if (!unseen && !(is_over(one, belt) && !has_ridden_off(one))) continue;
    one.gone = true;
  }
  for (Doubted& one : doubted_)
    if (one.gone && !one.told && one.let_go && now > *one.let_go + kFalls) found_gone(one);
  std::erase_if(doubted_, [&](const Doubted& one) {
    return !one.gone && one.let_go && one.at_m && is_over(one, belt) && has_ridden_off(one);
  });
}

// It must have come to the belt's end.
bool Strays::is_over(const Doubted& one, const BeltAt& belt) { return belt.travel_m > one.ends_m + kLater_m; }

bool Strays::has_ridden_off(const Doubted& one) const {
  return std::ranges::any_of(rode_off_, [&](double travel_m) {
    return travel_m > one.ends_m - one.half_m - kSooner_m && travel_m < one.ends_m + kLater_m;
  });
}

const Strays::Doubted* Strays::of(const std::string& code) const {
  if (code.empty()) return nullptr;
  const auto found =
      std::ranges::find_if(doubted_, [&](const Doubted& one) { return one.let_go && one.stray.code == code; });
  return found == doubted_.end() ? nullptr : &*found;
}

bool Strays::is_gone(const std::string& code) const {
  const Doubted* const found = of(code);
  return found != nullptr && found->gone;
}

bool Strays::may_have_fallen(const std::string& code) const {
  const Doubted* const found = of(code);
  return found != nullptr && found->put_back && found->fell;
}

bool Strays::missed_twice(const std::string& code) {
  const Doubted* const found = of(code);
  return found != nullptr && !(found->put_back && found->stray.place.empty()) &&
         std::exchange(doubted_[static_cast<std::size_t>(found - doubted_.data())].missed, true);
}

const std::string* Strays::place_of(const std::string& code) const {
  const Doubted* const found = of(code);
  const std::string* const place = found == nullptr ? nullptr : &place_of(*found);
  return place == nullptr || place->empty() ? nullptr : place;
}

}  // namespace pons::skills
