#include "pons/skills/company.hpp"

namespace pons::skills {
namespace {

constexpr double kMayCling_m = 0.04;  // between the two, as measured

}  // namespace

Company company_of(const ObjectBelief& target, const std::vector<ObjectBelief>& objects,
                   const Eigen::Matrix3d& world_from_tip) {
  Company company;
  for (const ObjectBelief& other : objects) {
    const bool is_thing = other.track != 0 || other.half_seen;  // else room that may be taken
    if (!is_thing || other.track == target.track || apart_m(other, target) > kMayCling_m) continue;
    const Vector3 aside_m = other.world_from_top.translation() - target.world_from_top.translation();
    company.push_back({other.track, other.code, (world_from_tip.transpose() * aside_m).head<2>(), other.size_m});
  }
  return company;
}

}  // namespace pons::skills
