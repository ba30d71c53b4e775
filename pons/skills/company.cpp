#include "pons/skills/company.hpp"

#include <utility>

namespace pons::skills {
namespace {

constexpr double kMayCling_m = 0.04;  // between the two, as measured

}  // namespace

Company company_of(const ObjectBelief& target, const std::vector<ObjectBelief>& objects,
                   const Eigen::Matrix3d& world_from_tip) {
  Company company;
  for (const ObjectBelief& other : objects) {
    if (other.track == 0 || other.track == target.track || apart_m(other, target) > kMayCling_m) continue;
    const Vector3 aside_m = other.world_from_top.translation() - target.world_from_top.translation();
    company.push_back({other.code, (world_from_tip.transpose() * aside_m).head<2>()});
  }
  return company;
}

void Strays::let_go(const Company& company, const std::string& place, Time now) {
  for (const Companion& companion : company) {
    if (!companion.code.empty()) gone_[companion.code] = {place, now};
  }
}

void Strays::look(const std::vector<ObjectBelief>& objects) {
  if (gone_.empty()) return;
  for (const ObjectBelief& object : objects) {
    const auto found = gone_.find(object.code);
    if (found != gone_.end() && object.last_seen > found->second.since) gone_.erase(found);
  }
}

bool Strays::missed_twice(const std::string& code) {
  const auto found = gone_.find(code);
  return found != gone_.end() && std::exchange(found->second.missed, true);
}

const std::string* Strays::place_of(const std::string& code) const {
  const auto found = gone_.find(code);
  return found == gone_.end() ? nullptr : &found->second.place;
}

}  // namespace pons::skills
