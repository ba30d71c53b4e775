// What cameras see, as ROS 2 has pictures: raw, compressed, depth, and how their pixels lie in space.
//
// A picture lies in the cameras' own memory for as long as perception looks at it. What somebody wants of it is made
// beside the bridge's thread: in real time by a thread of its own; in lockstep by the one that perceives, so that what
// a recording holds does not depend on how fast threads are. The bridge's thread passes on bytes, each picture when
// perception's beliefs of it are due.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/image.hpp"
#include "pons/core/time.hpp"
#include "pons/perception/sight.hpp"
#include "pons/runner/aside.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/wire/types/geometry_msgs/msg/transform_stamped.hpp"
#include "pons/wire/types/sensor_msgs/msg/camera_info.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"
#include "pons/wire/types/sensor_msgs/msg/image.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// Where perception gets its frames, with a look at each on its way. Whatever else is asked of it, `sight` answers.
class CamerasView final : public View, public perception::Sight {
 public:
  // Pictures that wait to be made into messages, in real time; more are left out, and counted.
  static constexpr std::size_t kWaitingMost = 4;

  // All outlive it. Errors: those of the outlets; a camera's name is no part of a topic's.
  [[nodiscard]] static Expected<std::unique_ptr<CamerasView>> open(Outlets& outlets, const world::World& world,
                                                                   perception::Sight& sight, runner::Pace pace);
  // From the world to each camera's frame, NAME_optical_frame: x right, y down, z forward (REP 103).
  [[nodiscard]] std::vector<wire::geometry_msgs::msg::TransformStamped> frames() const;

  // On the bridge's thread.
  void show(Time now) override;
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }

  // On the thread that perceives.
  void process(const RgbdFrame& frame, const perception::Moment& moment) override;
  [[nodiscard]] std::vector<ObjectBelief> beliefs(Time now, double belt_travel_m) const override {
    return sight_.beliefs(now, belt_travel_m);
  }
  [[nodiscard]] std::vector<ObjectBelief> cut(Time now, double belt_travel_m) const override {
    return sight_.cut(now, belt_travel_m);
  }
  [[nodiscard]] bool sees_belt() const override { return sight_.sees_belt(); }
  [[nodiscard]] bool wants_labels() const override { return sight_.wants_labels(); }
  void forget(std::uint32_t track) override { sight_.forget(track); }
  [[nodiscard]] int occupancy(std::string_view place) const override { return sight_.occupancy(place); }
  [[nodiscard]] std::optional<BaseBelief> base() const override { return sight_.base(); }

 private:
  using Image = wire::sensor_msgs::msg::Image;
  using CameraInfo = wire::sensor_msgs::msg::CameraInfo;
  using CompressedImage = wire::sensor_msgs::msg::CompressedImage;
  struct Wanted {
    std::atomic<bool> raw{false}, compressed{false}, depth{false}, compressed_depth{false};
  };
  struct Camera {
    const world::CameraSpec* spec;
    Outlet<Image> raw, depth;
    Outlet<CompressedImage> compressed, compressed_depth;
    Outlet<CameraInfo> info, depth_info;
  };
  // What is to be made of one frame.
  struct Task {
    std::size_t camera = 0;
    bool raw = false, compressed = false, depth = false, compressed_depth = false;
    [[nodiscard]] bool any() const { return raw || compressed || depth || compressed_depth; }
  };
  // Of one frame, encoded; empty where it was not wanted.
  struct Made {
    std::size_t camera = 0;
    Time due;
    std::vector<std::byte> raw, compressed, depth, compressed_depth, info;
  };

  CamerasView(const world::World& world, perception::Sight& sight, runner::Pace pace);
  void look_who_wants();
  void make(const Task& task, const RgbdFrame& frame);

  const world::World& world_;
  perception::Sight& sight_;
  std::vector<Camera> cameras_;
  std::deque<Wanted> wanted_;  // a camera
  std::mutex mutex_;
  std::deque<Made> made_;  // under mutex_
  std::atomic<std::uint64_t> left_out_ = 0;
  std::optional<runner::Aside> aside_;  // in real time. Last: it uses the others
};

}  // namespace pons::apps
