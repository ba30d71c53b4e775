#include "pons/skills/company.hpp"

#include <algorithm>
#include <utility>

namespace pons::skills {
namespace {

constexpr double kMayCling_m = 0.04;     // between the two, as measured
constexpr std::size_t kRemembered = 64;  // of those who are gone

}  // namespace

Company company_of(const ObjectBelief& target, const std::vector<ObjectBelief>& objects,
                   const Eigen::Matrix3d& world_from_tip) {
  Company company;
  for (const ObjectBelief& other : objects) {
    if (other.track == 0 || other.track == target.track || apart_m(other, target) > kMayCling_m) continue;
    const Vector3 aside_m = other.world_from_top.translation() - target.world_from_top.translation();
    company.push_back({other.track, other.code, (world_from_tip.transpose() * aside_m).head<2>()});
  }
  return company;
}

void Strays::let_go(const Company& company, const std::string& place, Time now) {
  for (const Companion& companion : company) {
    taken(companion.track);
    std::erase_if(doubted_,
                  [&](const Doubted& one) { return one.stray.code == companion.code && !companion.code.empty(); });
    doubted_.push_back({companion.track, {companion.code, place}, now});
  }
  if (doubted_.size() > kRemembered) doubted_.erase(doubted_.begin(), doubted_.end() - kRemembered);
}

void Strays::taken(std::uint32_t track) {
  std::erase_if(doubted_, [&](const Doubted& one) { return one.track == track; });
}

void Strays::look(const std::vector<ObjectBelief>& objects, double view_end_m) {
  if (doubted_.empty()) return;
  for (const ObjectBelief& object : objects) {
    std::erase_if(doubted_, [&](const Doubted& one) {
      const bool same = one.track == object.track || (!one.stray.code.empty() && one.stray.code == object.code);
      return same && object.last_seen > one.since;
    });
  }
  for (Doubted& one : doubted_) {
    const auto believed = std::ranges::find(objects, one.track, &ObjectBelief::track);
    if (believed != objects.end()) {
      one.at_m = believed->world_from_top.translation().x();
      if (one.stray.code.empty()) one.stray.code = believed->code;
    } else if (!one.gone && one.at_m && *one.at_m < view_end_m) {
      one.gone = true;
      found_gone_.push_back(one.stray);
    }
  }
}

bool Strays::missed_twice(const std::string& code) {
  const auto found = std::ranges::find(doubted_, code, [](const Doubted& one) { return one.stray.code; });
  return !code.empty() && found != doubted_.end() && std::exchange(found->missed, true);
}

const std::string* Strays::place_of(const std::string& code) const {
  const auto found = std::ranges::find(doubted_, code, [](const Doubted& one) { return one.stray.code; });
  return code.empty() || found == doubted_.end() ? nullptr : &found->stray.place;
}

}  // namespace pons::skills
