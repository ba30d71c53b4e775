#include "pons/model/collision.hpp"

#include <coal/distance_func_matrix.h>
#include <coal/narrowphase/narrowphase.h>
#include <coal/shape/geometric_shapes.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include "pons/core/random.hpp"

namespace pons::model {
namespace {

constexpr std::uint64_t kProbeSeed = 1;
constexpr double kTolerance_m = 1e-6;             // of coal's distances
constexpr double kWidest_rad = std::numbers::pi;  // of an axis' range, from zero, that is probed
constexpr std::size_t kBodies = kMaxAxes + 1;

// One value a body: distances beyond the margins, or ways.
using PerBody = std::array<double, kBodies>;

struct Shape {
  std::unique_ptr<coal::ShapeBase> geometry;
  coal::Transform3s world_from_shape;
  Vector3 half_m = Vector3::Zero();  // of the box along the world's axes around it
};

Shape box_shape(const Vector3& size_m) { return {std::make_unique<coal::Box>(size_m), {}, {}}; }

void place(Shape& shape, const Pose& world_from_shape, const Vector3& half_m) {
  shape.world_from_shape = {world_from_shape.linear(), world_from_shape.translation()};
  shape.half_m = world_from_shape.linear().cwiseAbs() * half_m;
}

void place(Shape& shape, const PlacedCapsule& capsule) {
  const Vector3 along = capsule.to - capsule.from;
  Pose pose = Pose::Identity();
  if (!along.isZero()) pose.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), along).toRotationMatrix();
  pose.translation() = 0.5 * (capsule.from + capsule.to);
  place(shape, pose, Vector3::Zero());
  shape.half_m = 0.5 * along.cwiseAbs() + Vector3::Constant(capsule.radius_m);
}

// Between the boxes around them: never more than between the shapes.
double least_distance(const Shape& a, const Shape& b) {
  const Vector3 apart = (a.world_from_shape.translation() - b.world_from_shape.translation()).cwiseAbs();
  return (apart - a.half_m - b.half_m).cwiseMax(0).norm();
}

// coal's own entry makes a solver for each question, which costs more than the answer.
class Ruler {
 public:
  // Below zero where they touch, by no more than the tolerance; m.
  double distance(const Shape& a, const Shape& b) {
    const auto function = table_.distance_matrix[a.geometry->getNodeType()][b.geometry->getNodeType()];
    coal::DistanceResult result;
    return function(a.geometry.get(), a.world_from_shape, b.geometry.get(), b.world_from_shape, &solver_, request_,
                    result) -
           kTolerance_m;
  }

 private:
  coal::DistanceFunctionMatrix table_;
  coal::DistanceRequest request_{false, false};  // neither nearest points nor depth
  coal::GJKSolver solver_{request_};
};

}  // namespace

struct CollisionModel::Impl {
  RobotModel model;
  CollisionMargins margins;
  std::vector<PlacedCapsule> placed;  // scratch
  std::vector<Shape> capsules, boxes;
  std::vector<std::size_t> bodies;                                   // of the capsules
  std::vector<std::pair<std::size_t, std::size_t>> pairs, left_out;  // of capsules; the second is farther out
  std::vector<std::array<double, kMaxAxes>> reach_m;                 // of each body from each axis
  std::optional<Shape> load;
  CarriedBox carried;
  std::size_t axes;
  Ruler ruler;

  Impl(RobotModel robot, const CollisionMargins& kept)
      : model(std::move(robot)), margins(kept), axes(static_cast<std::size_t>(model.axes())) {
    for (const world::Capsule& capsule : model.robot().capsules) {
      capsules.push_back(
          {std::make_unique<coal::Capsule>(capsule.radius_m, (capsule.to - capsule.from).norm()), {}, {}});
    }
    for (const int axis : model.capsule_axes()) bodies.push_back(static_cast<std::size_t>(axis));
    measure_reach();
    choose_pairs();
  }

  void place_at(const AxisVector& q) {
    model.place_capsules(q, placed);
    for (std::size_t i = 0; i < capsules.size(); ++i) place(capsules[i], placed[i]);
    if (load) place(*load, model.world_from_tip(q) * carried.tip_from_box, 0.5 * carried.size_m);
  }

  // Links are rigid: from an axis to a point farther out it is no farther than from axis to axis, and then to the
  // point.
  void measure_reach() {
    const Chain& chain = model.chain();
    const AxisVector zero = AxisVector::Zero(chain.axes());
    place_at(zero);
    reach_m.assign(axes + 1, {});
    const auto widen = [&](std::size_t body, const Vector3& point, double radius_m) {
      double way = radius_m;
      Vector3 from = point;
      for (std::size_t axis = body; axis-- > 0;) {
        const Joint& joint = chain.joint(static_cast<Eigen::Index>(axis));
        way += (from - joint.point).norm();
        reach_m[body][axis] = std::max(reach_m[body][axis], joint.revolute ? way : 1.0);
        if (!joint.revolute) way += longest_slide(chain.limits(), static_cast<Eigen::Index>(axis));
        from = joint.point;
      }
    };
    for (std::size_t i = 0; i < placed.size(); ++i) {
      widen(bodies[i], placed[i].from, placed[i].radius_m);
      widen(bodies[i], placed[i].to, placed[i].radius_m);
    }
    if (load) widen(axes, load->world_from_shape.translation(), 0.5 * carried.size_m.norm());
  }
  static double longest_slide(const AxisLimits& limits, Eigen::Index axis) {
    return std::max(std::abs(limits.position_min[axis]), std::abs(limits.position_max[axis]));
  }

  void choose_pairs() {
    if (!margins.self_m) return;
    std::vector<std::pair<std::size_t, std::size_t>> touching;
    for (std::size_t a = 0; a < capsules.size(); ++a) {
      for (std::size_t b = 0; b < capsules.size(); ++b) {
        if (bodies[a] + 1 < bodies[b]) touching.emplace_back(a, b);
      }
    }
    Random random(kProbeSeed);
    const AxisLimits& limits = model.robot().limits;
    AxisVector q(static_cast<Eigen::Index>(axes));
    for (int probe = 0; probe < kProbes; ++probe) {
      for (Eigen::Index i = 0; i < q.size(); ++i) {
        q[i] = random.uniform(std::max(limits.position_min[i], -kWidest_rad),
                              std::min(limits.position_max[i], kWidest_rad));
      }
      place_at(q);
      const auto apart = [&](const auto& pair) {
        return ruler.distance(capsules[pair.first], capsules[pair.second]) > 0;
      };
      const auto kept = std::partition(touching.begin(), touching.end(), apart);
      pairs.insert(pairs.end(), touching.begin(), kept);
      touching.erase(touching.begin(), kept);
    }
    std::ranges::sort(pairs);
    std::ranges::sort(touching);
    left_out = std::move(touching);
  }

  // Lowers `least` to the distance of these two beyond `margin_m` where it is lower.
  bool lower(double& least, const Shape& a, const Shape& b, double margin_m) {
    if (least_distance(a, b) - margin_m >= least) return false;
    const double apart = ruler.distance(a, b) - margin_m;
    if (apart >= least) return false;
    least = apart;
    return true;
  }

  // Each body's least distance beyond its margin, from all bodies before it and from the boxes.
  PerBody distances(const AxisVector& q) {
    place_at(q);
    PerBody least;
    least.fill(kFar_m);
    for (const auto& [a, b] : pairs) lower(least[bodies[b]], capsules[a], capsules[b], *margins.self_m);
    for (std::size_t i = 0; i < capsules.size(); ++i) {
      if (bodies[i] == 0) continue;  // what stands still does so among them
      for (const Shape& box : boxes) lower(least[bodies[i]], capsules[i], box, margins.scene_m);
    }
    if (!load) return least;
    for (std::size_t i = 0; margins.load_m && i < capsules.size(); ++i) {
      if (bodies[i] < axes) lower(least[axes], capsules[i], *load, *margins.load_m);
    }
    for (const Shape& box : boxes) lower(least[axes], *load, box, margins.scene_m);
    return least;
  }

  [[nodiscard]] double way_of(std::size_t body, const AxisVector& a, const AxisVector& b) const {
    double way = 0;
    for (std::size_t axis = 0; axis < body; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      way += std::abs(b[i] - a[i]) * reach_m[body][axis];
    }
    return way;
  }
  [[nodiscard]] double travel(const AxisVector& a, const AxisVector& b) const {
    double most = 0;
    for (std::size_t body = 1; body <= axes; ++body) most = std::max(most, way_of(body, a, b));
    return most;
  }

  [[nodiscard]] bool apart(const PerBody& least) const {
    return std::all_of(least.begin() + 1, least.begin() + static_cast<std::ptrdiff_t>(axes) + 1,
                       [](double m) { return m > 0; });
  }
  struct Looked {
    AxisVector q;
    PerBody least;
  };
  // No pair of bodies can touch between these two.
  [[nodiscard]] bool out_of_touch(const Looked& a, const Looked& b) const {
    for (std::size_t body = 1; body <= axes; ++body) {
      if (a.least[body] + b.least[body] < way_of(body, a.q, b.q)) return false;
    }
    return true;
  }
  // Halves all that is open before it halves anything twice: what is in the way shows early so.
  bool clear(const AxisVector& a, const AxisVector& b) {
    std::vector<Looked> seen{{a, distances(a)}};
    if (!apart(seen[0].least)) return false;
    seen.push_back({b, distances(b)});
    if (!apart(seen[1].least)) return false;
    std::deque<std::pair<std::size_t, std::size_t>> open{{0, 1}};
    for (; !open.empty(); open.pop_front()) {
      const auto [from, to] = open.front();
      if (out_of_touch(seen[from], seen[to]) || travel(seen[from].q, seen[to].q) <= kStep_m) continue;
      const AxisVector middle = 0.5 * (seen[from].q + seen[to].q);
      seen.push_back({middle, distances(middle)});
      if (!apart(seen.back().least)) return false;
      open.emplace_back(from, seen.size() - 1);
      open.emplace_back(seen.size() - 1, to);
    }
    return true;
  }
};

CollisionModel::CollisionModel(RobotModel model, const CollisionMargins& margins)
    : impl_(std::make_unique<Impl>(std::move(model), margins)) {}
CollisionModel::CollisionModel(CollisionModel&&) noexcept = default;
CollisionModel& CollisionModel::operator=(CollisionModel&&) noexcept = default;
CollisionModel::~CollisionModel() = default;

void CollisionModel::surround(std::span<const Box> boxes) {
  impl_->boxes.clear();
  for (const Box& box : boxes) {
    impl_->boxes.push_back(box_shape(box.size_m));
    place(impl_->boxes.back(), box.world_from_box, 0.5 * box.size_m);
  }
}

void CollisionModel::carry(const std::optional<CarriedBox>& load) {
  impl_->load.reset();
  if (load) {
    impl_->carried = *load;
    impl_->load = box_shape(load->size_m);
  }
  impl_->measure_reach();
}

double CollisionModel::clearance(const AxisVector& q) {
  const PerBody least = impl_->distances(q);
  return *std::min_element(least.begin(), least.end());
}

bool CollisionModel::clear(const AxisVector& q) { return impl_->apart(impl_->distances(q)); }

bool CollisionModel::clear(const AxisVector& a, const AxisVector& b) { return impl_->clear(a, b); }

std::string CollisionModel::touching(const AxisVector& q) {
  impl_->place_at(q);
  const auto link = [&](std::size_t i) { return impl_->model.robot().capsules[i].link; };
  const auto& shapes = impl_->capsules;
  for (const auto& [a, b] : impl_->pairs) {
    if (impl_->ruler.distance(shapes[a], shapes[b]) <= *impl_->margins.self_m) return link(a) + " and " + link(b);
  }
  for (std::size_t k = 0; k < impl_->boxes.size(); ++k) {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (impl_->bodies[i] == 0 || impl_->ruler.distance(shapes[i], impl_->boxes[k]) > impl_->margins.scene_m) continue;
      return fmt::format("{} and box {}", link(i), k + 1);
    }
    if (impl_->load && impl_->ruler.distance(*impl_->load, impl_->boxes[k]) <= impl_->margins.scene_m) {
      return fmt::format("the load and box {}", k + 1);
    }
  }
  for (std::size_t i = 0; impl_->load && impl_->margins.load_m && i < shapes.size(); ++i) {
    if (impl_->bodies[i] >= impl_->axes || impl_->ruler.distance(shapes[i], *impl_->load) > *impl_->margins.load_m)
      continue;
    return link(i) + " and the load";
  }
  return {};
}

double CollisionModel::travel(const AxisVector& a, const AxisVector& b) const { return impl_->travel(a, b); }

const std::vector<std::pair<std::size_t, std::size_t>>& CollisionModel::left_out() const { return impl_->left_out; }

}  // namespace pons::model
