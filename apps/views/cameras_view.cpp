#include "apps/views/cameras_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "apps/jpeg.hpp"
#include "apps/png.hpp"
#include "apps/views/frames.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/wire/cdr.hpp"

namespace pons::apps {
namespace {

using wire::sensor_msgs::msg::CameraInfo;
using wire::sensor_msgs::msg::CompressedImage;
using wire::sensor_msgs::msg::Image;

// Pictures are large: who does not keep up gets the newest.
constexpr gate::ros::Qos kPicturesQos{.depth = 2, .publish_mode = gate::ros::Qos::PublishMode::kFlowControlled};

std::string optical_frame(const std::string& camera) { return camera + "_optical_frame"; }

template <typename Message>
Message headed(const RgbdFrame& frame) {
  Message message;
  message.header.stamp = gate::ros::ros_stamp(frame.stamp.ns());
  message.header.frame_id = optical_frame(frame.camera);
  return message;
}

Image sized(const RgbdFrame& frame, std::string encoding, std::size_t bytes_a_pixel) {
  auto image = headed<Image>(frame);
  image.width = static_cast<std::uint32_t>(frame.intrinsics.width);
  image.height = static_cast<std::uint32_t>(frame.intrinsics.height);
  image.encoding = std::move(encoding);
  image.step = image.width * static_cast<std::uint32_t>(bytes_a_pixel);
  image.data.resize(static_cast<std::size_t>(image.step) * image.height);
  return image;
}

Image raw_image(const RgbdFrame& frame) {
  Image image = sized(frame, "rgb8", 3);
  std::ranges::copy(frame.rgb, image.data.begin());
  return image;
}

// REP 117: what was not measured is no number.
Image depth_image(const RgbdFrame& frame) {
  Image image = sized(frame, "32FC1", sizeof(float));
  for (std::size_t i = 0; i < frame.depth_m.size(); ++i) {
    const float depth_m = frame.depth_m[i] > 0 ? frame.depth_m[i] : std::numeric_limits<float>::quiet_NaN();
    std::memcpy(&image.data[i * sizeof(float)], &depth_m, sizeof(float));
  }
  return image;
}

// As image_transport has it (compressedDepth): a header of 12 bytes, which says nothing of what is no inverse depth,
// and a PNG; mm, 0 where it was not measured (REP 118).
std::optional<CompressedImage> compressed_depth_image(const RgbdFrame& frame) {
  constexpr std::size_t kHeader = 12;
  constexpr float kMost_mm = std::numeric_limits<std::uint16_t>::max();
  std::vector<std::uint16_t> depth_mm(frame.depth_m.size());
  std::ranges::transform(frame.depth_m, depth_mm.begin(), [](float depth_m) {
    const float mm = std::round(1000 * depth_m);
    return mm > 0 && mm <= kMost_mm ? static_cast<std::uint16_t>(mm) : std::uint16_t{0};
  });
  auto image = headed<CompressedImage>(frame);
  image.format = "16UC1; compressedDepth png";
  image.data.resize(kHeader);
  if (!append_png(frame.intrinsics.width, frame.intrinsics.height, depth_mm, image.data)) return std::nullopt;
  return image;
}

CameraInfo camera_info(const RgbdFrame& frame) {
  auto info = headed<CameraInfo>(frame);
  const Intrinsics& lens = frame.intrinsics;
  info.width = static_cast<std::uint32_t>(lens.width);
  info.height = static_cast<std::uint32_t>(lens.height);
  info.distortion_model = "plumb_bob";
  info.d.assign(5, 0.0);
  info.k = {lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {lens.fx, 0, lens.cx, 0, 0, lens.fy, lens.cy, 0, 0, 0, 1, 0};
  return info;
}

template <typename Message>
void encode(const Message& message, std::vector<std::byte>& bytes) {
  if (!wire::encode(message, bytes)) bytes.clear();  // longer than its type allows
}

}  // namespace

Expected<std::unique_ptr<CamerasView>> CamerasView::open(Outlets& outlets, const world::World& world,
                                                         perception::Sight& sight, runner::Pace pace) {
  std::unique_ptr<CamerasView> view(new CamerasView(world, sight, pace));
  for (const world::CameraSpec& camera : world.cameras) {
    const std::string& name = camera.name;
    auto raw = outlets.outlet<Image>(name + "/image_raw", kPicturesQos, Audience::kLive);
    if (!raw) return std::unexpected(raw.error());
    auto depth = outlets.outlet<Image>(name + "/depth/image_rect_raw", kPicturesQos, Audience::kLive);
    if (!depth) return std::unexpected(depth.error());
    auto compressed = outlets.outlet<CompressedImage>(name + "/image_raw/compressed", kPicturesQos);
    if (!compressed) return std::unexpected(compressed.error());
    auto info = outlets.outlet<CameraInfo>(name + "/camera_info");
    if (!info) return std::unexpected(info.error());
    auto compressed_depth =
        outlets.outlet<CompressedImage>(name + "/depth/image_rect_raw/compressedDepth", kPicturesQos, Audience::kDepth);
    if (!compressed_depth) return std::unexpected(compressed_depth.error());
    // Comes with depth alone.
    auto depth_info = outlets.outlet<CameraInfo>(name + "/depth/camera_info", gate::ros::kTopicQos, Audience::kDepth);
    if (!depth_info) return std::unexpected(depth_info.error());
    view->cameras_.push_back({&camera, *raw, *depth, *compressed, *compressed_depth, *info, *depth_info});
    view->wanted_.emplace_back();
  }
  view->look_who_wants();
  return view;
}

CamerasView::CamerasView(const world::World& world, perception::Sight& sight, runner::Pace pace)
    : world_(world), sight_(sight) {
  if (pace == runner::Pace::kRealTime) aside_.emplace(kWaitingMost);
}

std::vector<wire::geometry_msgs::msg::TransformStamped> CamerasView::frames() const {
  std::vector<wire::geometry_msgs::msg::TransformStamped> frames;
  for (const world::CameraSpec& camera : world_.cameras)
    frames.push_back(transform(camera.world_from_optical, std::string(kWorldFrame), optical_frame(camera.name)));
  return frames;
}

void CamerasView::look_who_wants() {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    wanted_[i].raw = cameras_[i].raw.wanted();
    wanted_[i].compressed = cameras_[i].compressed.wanted();
    wanted_[i].depth = cameras_[i].depth.wanted();
    wanted_[i].compressed_depth = cameras_[i].compressed_depth.wanted();
  }
}

void CamerasView::show(Time now) {
  look_who_wants();
  std::deque<Made> due;
  {
    const std::lock_guard lock(mutex_);
    for (auto each = made_.begin(); each != made_.end();) {
      if (each->due > now) {
        ++each;
        continue;
      }
      due.push_back(std::move(*each));
      each = made_.erase(each);
    }
  }
  for (const Made& made : due) {
    Camera& camera = cameras_[made.camera];
    camera.info.put_encoded(now, made.info);
    if (!made.depth.empty() || !made.compressed_depth.empty()) camera.depth_info.put_encoded(now, made.info);
    if (!made.raw.empty()) camera.raw.put_encoded(now, made.raw);
    if (!made.depth.empty()) camera.depth.put_encoded(now, made.depth);
    if (!made.compressed.empty()) camera.compressed.put_encoded(now, made.compressed);
    if (!made.compressed_depth.empty()) camera.compressed_depth.put_encoded(now, made.compressed_depth);
  }
}

void CamerasView::process(const RgbdFrame& frame, const perception::Moment& moment) {
  sight_.process(frame, moment);
  const auto of = std::ranges::find(cameras_, frame.camera, [](const Camera& each) { return each.spec->name; });
  const auto number = static_cast<std::size_t>(of - cameras_.begin());
  const Wanted& wanted = wanted_[number];
  const Task task{number, wanted.raw, wanted.compressed, wanted.depth, wanted.compressed_depth};
  if (!aside_ || !task.any()) return make(task, frame);
  // The place that the picture lies in is given back.
  if (!aside_->put([this, task, kept = frame] { make(task, kept); })) ++left_out_;
}

void CamerasView::make(const Task& task, const RgbdFrame& frame) {
  Made made{.camera = task.camera, .due = frame.stamp + from_s(world_.cameras[task.camera].latency_s)};
  encode(camera_info(frame), made.info);
  if (task.raw) encode(raw_image(frame), made.raw);
  if (task.depth) encode(depth_image(frame), made.depth);
  if (task.compressed_depth) {
    if (const auto image = compressed_depth_image(frame)) encode(*image, made.compressed_depth);
  }
  if (task.compressed) {
    auto image = headed<CompressedImage>(frame);
    image.format = "rgb8; jpeg compressed bgr8";
    if (encode_jpeg({frame.rgb.data(), frame.rgb.size()}, frame.intrinsics.width, frame.intrinsics.height, image.data))
      encode(image, made.compressed);
  }
  const std::lock_guard lock(mutex_);
  made_.push_back(std::move(made));
}

}  // namespace pons::apps
