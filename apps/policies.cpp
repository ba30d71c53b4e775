#include "apps/policies.hpp"

#include <memory>
#include <optional>

#include "pons/brain/hover.hpp"

namespace pons::apps {
namespace {

constexpr const char* kHover = "hover";

}  // namespace

brain::PolicyMakers policies_of(const world::World& world, const model::RobotModel& model) {
  return {{kHover, [&world, &model](const task::Json& arguments) {
             auto own = std::make_shared<model::RobotModel>(model.copy());
             return brain::hover(
                 world,
                 [own](const Pose& pose, const AxisVector& seed) -> std::optional<AxisVector> {
                   auto q = own->inverse(pose, seed);
                   if (!q) return std::nullopt;
                   return *q;
                 },
                 arguments);
           }}};
}

std::vector<std::string> policy_names() { return {kHover}; }

}  // namespace pons::apps
