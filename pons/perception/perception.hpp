// Frames to beliefs: what lies on the belt, where, how large, with what label; what fell into the tray. Never in the
// loop.
#pragma once

#include <memory>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/both.hpp"
#include "pons/core/image.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/perception/sight.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

// Deterministic; one thread, and what `both` lends it for the halves of a picture. `world` must outlive it.
class Perception final : public Sight {
 public:
  Perception(const world::World& world, model::RobotModel model, Both both = one_after_the_other);
  ~Perception() override;
  // Another robot that the cameras may see; before the first frame.
  void add_robot(model::RobotModel model);

  // Takes in one frame (in the order of their stamps). Frames of a camera that watches the belt update tracks; those of
  // a camera that watches a place update occupancy().
  void process(const RgbdFrame& frame, const Moment& moment) override;

  // Every live track, predicted to `now` by the belt's travel. Ordered by track. World frame; where the top leans by
  // more than 3°, world_from_top leans with it. size_m.z is the top's height above the belt. confidence is 1 − 2⁻ⁿ
  // after n frames that agree (n = 1 again after a push), halved for each frame that looked and did not find it, and at
  // most 0.3 while the object is partly hidden or something lies or leans on it: take what hides it first.
  [[nodiscard]] std::vector<ObjectBelief> beliefs(Time now, double belt_travel_m) const override;

  // What the newest frame of the belt cut at its border, upstream or downstream, and no track knows: how long it is
  // cannot be told, so it is as long as any parcel, along x. Only an obstacle: no track, no label. Downstream not what
  // the robot touches in the picture, for that may be what it carries.
  [[nodiscard]] std::vector<ObjectBelief> cut(Time now, double belt_travel_m) const override;

  // Whether the newest frame of the belt showed all of it that the camera watches, but for what the robot hides: not a
  // black one, and nothing hung before the camera.
  [[nodiscard]] bool sees_belt() const override;

  // Whether a frame of a camera that reads labels could teach anything: the newest frame showed something whole and
  // bare whose code was read less than twice, in fewer than ten attempts, or that seems too large for one parcel.
  [[nodiscard]] bool wants_labels() const override;

  // The arm took this one (or it fell): stop predicting it with the belt. Frames shuttered within half a second after
  // the newest one taken in do not bring it back; what still lies there later is a new track.
  void forget(std::uint32_t track) override;

  // How many separate things lie in a watched place (the tray), as last seen. The place's first three frames must show
  // it empty. 0 for a place that no camera watches.
  [[nodiscard]] int occupancy(std::string_view place) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::perception
