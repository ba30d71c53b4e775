// How well perception sees: pose and size of every belief against the simulator's truth, and how many labels are read.
// The arm stands still with its brakes on; parcels ride by under the cameras, with noise and dropouts as in the world's
// file.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "apps/paths.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/perception/perception.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/sim/truth.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;

struct Errors {
  std::vector<double> xy_m, z_m, yaw_rad, size_m;

  static double at(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
  void print(std::string_view name) const {
    fmt::print(
        "{:<10} {:>6} poses   xy {:.2f} / {:.2f} mm   z {:.2f} / {:.2f} mm   yaw {:.2f} / {:.2f} deg   size {:.1f} / "
        "{:.1f} mm"
        "   (median / 95 %)\n",
        name, xy_m.size(), 1e3 * at(xy_m, 0.5), 1e3 * at(xy_m, 0.95), 1e3 * at(z_m, 0.5), 1e3 * at(z_m, 0.95),
        57.2958 * at(yaw_rad, 0.5), 57.2958 * at(yaw_rad, 0.95), 1e3 * at(size_m, 0.5), 1e3 * at(size_m, 0.95));
  }
};

double yaw_of(const Pose& pose) { return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)); }

// Where beliefs should be good: wholly in view and seen a few times.
bool counts(const ObjectBelief& belief, const world::World& world) {
  const double x = belief.world_from_top.translation().x();
  return belief.frames_seen >= 3 && x > world.belt.x_start_m + 0.75 && x < world.belt.pick_x_min_m + 0.3;
}

class Bench {
 public:
  Bench(const world::World& world, const world::Manifest& manifest, sim::Simulation& simulation,
        perception::Perception& perception)
      : world_(world), manifest_(manifest), simulation_(simulation), perception_(perception), truth_(simulation) {}

  void run() {
    body::Sensors sensors;
    std::vector<Time> next;
    for (const auto& camera : world_.cameras) next.emplace_back(from_s(camera.phase_s));
    RgbdFrame frame;
    simulation_.run_belt();
    for (Time now; !simulation_.finished(); now += from_s(0.01)) {
      simulation_.advance_to(now);
      simulation_.body().read(sensors);
      for (std::size_t i = 0; i < next.size(); ++i) {
        if (now < next[i] || world_.cameras[i].watches != "belt") continue;
        next[i] += from_s(world_.cameras[i].period_s);
        simulation_.cameras()[i]->begin(now);
        if (!simulation_.cameras()[i]->finish(frame)) std::abort();
        frame.camera = world_.cameras[i].name;
        frame.stamp = now;
        perception_.process(frame, {sensors.position, sensors.belt_travel_m});
        compare(perception_.beliefs(now, sensors.belt_travel_m));
      }
    }
  }

  void print() const {
    alone_.print("alone");
    crowded_.print("crowded");
    for (const auto& [kind, errors] : of_kind_) errors.print(world::name(kind));
    std::size_t readable = 0, read = 0, wrong = 0;
    for (std::size_t i = 0; i < truth_.parcels().size(); ++i) {
      const auto& parcel = truth_.parcels()[i];
      if (parcel.label == sim::LabelTruth::kReadable) {
        ++readable;
        read += codes_.contains(parcel.parcel_id) ? 1U : 0U;
      }
    }
    for (const std::string& code : codes_) {
      wrong += std::none_of(manifest_.begin(), manifest_.end(), [&](const auto& row) { return row.parcel_id == code; })
                   ? 1U
                   : 0U;
    }
    fmt::print("labels: {} of {} readable ones read ({:.2f} %), {} codes that no parcel of the manifest has\n", read,
               readable, 100.0 * static_cast<double>(read) / static_cast<double>(std::max<std::size_t>(1, readable)),
               wrong);
    fmt::print("beliefs without a parcel: {} of {}\n", ghosts_, beliefs_);
  }

 private:
  void compare(const std::vector<ObjectBelief>& beliefs) {
    for (const ObjectBelief& belief : beliefs) {
      if (!belief.code.empty()) codes_.insert(belief.code);
      if (!counts(belief, world_)) continue;
      ++beliefs_;
      const auto nearest = nearest_parcel(belief);
      if (!nearest) {
        ++ghosts_;
        continue;
      }
      const sim::ParcelTruth& parcel = truth_.parcels()[*nearest];
      const Pose top = *truth_.top(*nearest);
      const Vector3 off = belief.world_from_top.translation() - top.translation();
      const double aspect = parcel.size_m.x() / parcel.size_m.y();
      const double turn = aspect > 1.15 ? M_PI : M_PI / 2;
      const double longer_off = belief.size_m.x() - std::max(parcel.size_m.x(), parcel.size_m.y());
      const double shorter_off = belief.size_m.y() - std::min(parcel.size_m.x(), parcel.size_m.y());
      for (Errors* errors : {parcel.touching ? &crowded_ : &alone_, &of_kind_[manifest_[*nearest].kind]}) {
        errors->xy_m.push_back(off.head<2>().norm());
        errors->z_m.push_back(std::abs(off.z()));
        errors->yaw_rad.push_back(std::abs(std::remainder(yaw_of(belief.world_from_top) - yaw_of(top), turn)));
        errors->size_m.push_back(std::max(std::abs(longer_off), std::abs(shorter_off)));
      }
    }
  }

  std::optional<std::size_t> nearest_parcel(const ObjectBelief& belief) const {
    std::optional<std::size_t> nearest;
    double least = 0.05;
    for (std::size_t i = 0; i < truth_.parcels().size(); ++i) {
      const auto top = truth_.top(i);
      if (!top) continue;
      const double off = (top->translation() - belief.world_from_top.translation()).norm();
      if (off >= least) continue;
      least = off;
      nearest = i;
    }
    return nearest;
  }

  const world::World& world_;
  const world::Manifest& manifest_;
  sim::Simulation& simulation_;
  perception::Perception& perception_;
  sim::Truth truth_;
  Errors alone_, crowded_;
  std::map<world::ParcelKind, Errors> of_kind_;
  std::set<std::string> codes_;
  std::size_t ghosts_ = 0, beliefs_ = 0;
};

template <typename T>
T must(Expected<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "pose_error: {}\n", result.error().line());
  std::exit(2);
}

}  // namespace

int main(int argc, char** argv) {
  const int parcels = argc > 1 ? std::atoi(argv[1]) : 100;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  const world::World world = must(world::load(apps::worlds_folder(), "parcel_cell"));
  const world::Manifest manifest = must(world::draw_manifest(world, parcels, seed));
  const auto simulation = must(sim::Simulation::create(world, manifest, seed));
  perception::Perception perception(world, must(model::RobotModel::load(world.robot)));
  Bench bench(world, manifest, *simulation, perception);
  bench.run();
  bench.print();
}
