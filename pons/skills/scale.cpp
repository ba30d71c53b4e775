#include "pons/skills/scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pons/core/gravity.hpp"
#include "pons/skills/grasp.hpp"

namespace pons::skills {
namespace {

// How long a load swings once on the bellows, which are springs: the heavier the slower. Rounded up, for they rub.
constexpr double kSwing_s_per_root_kg = 0.08;
constexpr double kQuickest_s = 0.05,
                 kSlowest_s = 0.15;  // of the swings: a few readings; the heaviest load that is sorted
constexpr double kAgreeLeast_kg = 0.3, kAgreeShare = 0.3;
constexpr double kNearEdge = 0.45;  // of the way from the middle to an edge
constexpr double kFelt_nm = 0.2;    // a moment below that the cups bear easily
// Between where a load's middle seems to be and where it weighs: both are measured, and contents lie to one side.
constexpr double kUneven_m = 0.008, kUnevenMost_m = 0.035;
constexpr double kDensest_kg_m3 = 600;  // of what hardly any parcel holds; two weigh as much for the size of one
constexpr double kFeltLeast_nm = 0.05;  // the wrist's own error
constexpr int kTimeAndAgain = 2;
constexpr double kFellOff = 1.5;                 // of the mass of the latest readings: over all of them
constexpr double kTowards = 0.6;                 // cosine: a companion may reach around a corner
constexpr double kMore = 0.06, kMore_kg = 0.02;  // between two weighings of one load,
constexpr double kLess = 0.15;                   // and of two, one of which drags on the belt
constexpr double kLower_m = 0.01;                // than measured: where it lies, and its sides

Eigen::Matrix3d world_from_flange(Cell& cell) {
  const Pose tip = cell.model.world_from_tip(cell.arm.state().position);
  return tip.linear() * cell.world.robot.tool.flange_from_tip.linear().transpose();
}

// What pulls the wrist down.
double pull_n(Cell& cell) {
  const auto& force = cell.arm.state().wrist_force_n;
  return -(world_from_flange(cell) * Vector3(force[0], force[1], force[2])).z();
}

// Of the load, at half its height, across the tip's axis, tip frame: where it hangs straight below the tip, there is
// none however the tool leans. The tool's own is taken off, which leans as far and may be heavier than the load.
Eigen::Vector2d moment_nm(Cell& cell) {
  const link::State& state = cell.arm.state();
  const world::Tool& tool = cell.world.robot.tool;
  const Eigen::Map<const Vector3> force(state.wrist_force_n.data()), torque(state.wrist_torque_nm.data());
  const Vector3 tool_n = world_from_flange(cell).transpose() * Vector3(0, 0, -kGravity_m_s2 * tool.mass_kg);
  const double middle_m = cell.held ? 0.5 * cell.held->load.size_m.z() : 0;
  const Vector3 middle = tool.flange_from_tip * Vector3(0, 0, middle_m);
  const Vector3 about_middle = torque - tool.com_m.cross(tool_n) - middle.cross(force - tool_n);
  return (tool.flange_from_tip.linear().transpose() * about_middle).head<2>();
}

constexpr double kBoth = 1.3, kSame = 0.9;  // of the mass of one of them

}  // namespace

bool may_be_who_hung(double mass_kg, double top_m, const Hooked& before) {
  return before.most_kg > kBoth * mass_kg && mass_kg > kSame * before.mass_kg && top_m > before.lowest_m;
}

double highest_top_m(const Cell& cell) {
  if (!cell.held->from_m) return std::numeric_limits<double>::infinity();
  return cell.held->from_m->z() + cell.world.robot.tool.stroke_m + kLower_m - cell.world.belt.surface_z_m;
}

std::optional<Beside> hangs_beside(const Load& load, const Weight& weight, const Company& company,
                                   const std::optional<Hooked>& before) {
  const bool heavier = before && weight.mass_kg > (1 + kMore) * before->mass_kg + kMore_kg;
  const bool lighter = before && (1 + kLess) * weight.mass_kg + kMore_kg < before->most_kg;
  const Eigen::Vector2d beside_m = weight.beside_tip_m - load.offset_in_tip_m.head<2>();
  const bool as_before = before && !heavier && (lighter || before->times >= kTimeAndAgain);
  const bool uneven = as_before && beside_m.norm() < kUnevenMost_m;
  if (before && weight.mass_kg > kDensest_kg_m3 * load.size_m.prod()) return Beside{};
  const double moment_nm = weight.mass_kg * kGravity_m_s2 * beside_m.norm();
  if (beside_m.norm() > kUneven_m && moment_nm > kFeltLeast_nm) {
    for (const Companion& companion : company) {
      const bool has_code = !companion.code.empty();
      if (beside_m.dot(companion.aside_m.normalized()) > kTowards * beside_m.norm() &&
          (!uneven || (has_code && !lighter)))
        return has_code ? Beside{companion.code} : Beside{};
    }
    if (heavier) return Beside{};
  }
  const bool still_there = before && std::ranges::any_of(company, [&](const Companion& companion) {
                             return !companion.code.empty() && companion.code == before->whose;
                           });
  if (still_there && as_before && !lighter) return Beside{before->whose};
  const Eigen::Vector2d in_load_m = Eigen::Rotation2Dd(-load.yaw_in_tip_rad) * beside_m;
  const double share = in_load_m.cwiseAbs().cwiseQuotient(0.5 * load.size_m.head<2>()).maxCoeff();
  return share > kNearEdge && moment_nm > kFelt_nm ? std::optional(Beside{}) : std::nullopt;
}

Hooked hooked_again(const Held& held, double mass_kg, const std::optional<Beside>& beside,
                    const std::optional<Hooked>& before) {
  double lowest_m = before ? before->lowest_m : std::numeric_limits<double>::infinity();
  for (const Companion& companion : held.company) lowest_m = std::min(lowest_m, companion.size_m.minCoeff());
  return {.code = held.code,
          .mass_kg = mass_kg,
          .most_kg = std::max(mass_kg, before ? before->most_kg : 0),
          .times = before ? before->times + 1 : 1,
          .whose = beside ? beside->whose : "",
          .lowest_m = std::isfinite(lowest_m) ? lowest_m : 0};
}

// By so much more at one end as it weighs beside its middle, twice: farther beside, another bears it or hangs on it.
Load reaching(const Load& load, const Weight& weight) {
  const Eigen::Rotation2Dd tip_from_load(load.yaw_in_tip_rad);
  const Eigen::Vector2d beside_m = weight.beside_tip_m - load.offset_in_tip_m.head<2>();
  const Eigen::Vector2d along_m((tip_from_load.inverse() * beside_m).x(), 0);
  const double felt_nm = weight.mass_kg * kGravity_m_s2 * along_m.norm();
  if (along_m.norm() <= kUneven_m || felt_nm <= kFeltLeast_nm || beside_m.norm() > kUnevenMost_m) return load;
  Load whole = load;
  whole.size_m.x() += 2 * along_m.norm();
  whole.offset_in_tip_m.head<2>() += tip_from_load * along_m;
  return whole;
}

double weigh_now(Cell& cell) { return pull_n(cell) / kGravity_m_s2 - cell.world.robot.tool.mass_kg; }

void Scale::add(Cell& cell) {
  const link::State& state = cell.arm.state();
  if (!readings_.empty() && state.stamp.s() <= readings_.back().time_s) return;
  const double speed_m_s = (cell.model.tip_jacobian(state.position) * state.speed)(2);
  readings_.push_back({state.stamp.s(), pull_n(cell), speed_m_s, moment_nm(cell)});
}

// By the trapezoidal rule.
template <typename Value>
Value Scale::impulse(Value Reading::* felt, std::size_t first, std::size_t last) const {
  Value sum = 0 * readings_[first].*felt;
  for (std::size_t i = first; i < last; ++i) {
    const double step_s = readings_[i + 1].time_s - readings_[i].time_s;
    sum += 0.5 * step_s * (readings_[i].*felt + readings_[i + 1].*felt);
  }
  return sum;
}

// Of tool and load together.
double Scale::mass_kg(std::size_t first, std::size_t last) const {
  const double span_s = readings_[last].time_s - readings_[first].time_s;
  const double per_kg = kGravity_m_s2 * span_s + readings_[last].speed_m_s - readings_[first].speed_m_s;
  return impulse(&Reading::force_n, first, last) / std::max(per_kg, 0.1 * kGravity_m_s2 * span_s);
}

std::optional<Weight> Scale::weigh(const Cell& cell, double expected_kg) const {
  const double tool_kg = cell.world.robot.tool.mass_kg;
  if (readings_.size() < 3) return std::nullopt;
  const std::size_t last = readings_.size() - 1;
  const auto since = [&](double span_s) {
    std::size_t first = last;
    while (first > 0 && readings_[last].time_s - readings_[first].time_s < span_s) --first;
    return first;
  };
  const double about_kg = std::max(expected_kg, mass_kg(since(kSlowest_s), last) - tool_kg);
  const double swing_s = std::clamp(kSwing_s_per_root_kg * std::sqrt(about_kg), kQuickest_s, kSlowest_s);
  const std::size_t first = since(swing_s), middle = since(swing_s / 2);
  if (readings_[last].time_s - readings_[first].time_s < swing_s) return std::nullopt;
  const double whole_kg = mass_kg(first, last) - tool_kg;
  const double change_kg = std::abs(mass_kg(first, middle) - mass_kg(middle, last));
  if (change_kg > std::max(kAgreeLeast_kg, kAgreeShare * whole_kg)) return std::nullopt;
  // What hangs beside the cups tilts them, and swings far more slowly than up and down: over a part of that the moment
  // is anything from none to twice its mean. But what has fallen off meanwhile is felt no more.
  const std::size_t since_then = mass_kg(0, last) - tool_kg > kFellOff * whole_kg + kAgreeLeast_kg ? first : 0;
  const double pull_ns = impulse(&Reading::force_n, since_then, last) * whole_kg / (whole_kg + tool_kg);
  if (pull_ns <= 0) return Weight{whole_kg};
  const Eigen::Vector2d moment_nms = impulse(&Reading::moment_nm, since_then, last);
  return Weight{whole_kg, Eigen::Vector2d(-moment_nms.y(), moment_nms.x()) / pull_ns};
}

}  // namespace pons::skills
