#include "pons/perception/perception.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <string>
#include <utility>

#include "pons/perception/label_reader.hpp"
#include "pons/perception/segmentation.hpp"
#include "pons/perception/self_filter.hpp"
#include "pons/perception/top_face.hpp"
#include "pons/perception/top_view.hpp"
#include "pons/perception/tracker.hpp"
#include "pons/perception/tray_watch.hpp"
#include "pons/world/view.hpp"

namespace pons::perception {
namespace {

constexpr double kSeenWell = 0.8;  // confidence: three frames that agree
constexpr double kAtEnd_m = 0.03;  // from the view's end, or nearer

double along_belt_m(const Sighting& sighting) {
  return std::abs(std::cos(sighting.yaw_rad)) * sighting.size_m.x() +
         std::abs(std::sin(sighting.yaw_rad)) * sighting.size_m.y();
}

}  // namespace

struct Perception::Impl {
  const world::World& world;
  Both both;
  SelfFilter self_filter;
  Segmenter segmenter;
  LabelReader label_reader;
  Tracker tracker;
  std::map<std::string, TopViewer, std::less<>> viewers;  // by camera
  std::map<std::string, TrayWatch, std::less<>> watches;  // by place
  std::map<std::string, Vector3, std::less<>> shared;     // labels read on one sighting, relative to the belt
  // Of each place from which cameras look at the belt, by where that is along it:
  struct Look {
    std::vector<ObjectBelief> cut;  // relative to the belt
    bool sees_belt = true;
  };
  std::map<double, Look> looks;

  Impl(const world::World& the_world, model::RobotModel model, Both the_both)
      : world(the_world),
        both(std::move(the_both)),
        self_filter(std::move(model), both),
        segmenter(both),
        tracker(the_world) {
    for (const auto& camera : world.cameras) {
      const world::Place* const place = world.place(camera.watches);
      if (place != nullptr) watches.try_emplace(place->name, world, *place);
    }
  }

  [[nodiscard]] std::vector<LabelMark> marks(const TopView& view, double belt_travel_m);
  [[nodiscard]] std::vector<cv::RotatedRect> known(const TopView& view, Time now, double belt_travel_m) const;
  [[nodiscard]] bool reaches_end(const world::CameraSpec& camera, const Sighting& sighting) const;
  enum class Seen : std::uint8_t { kFront, kBack };
  [[nodiscard]] ObjectBelief half_seen(const Sighting& sighting, Seen seen, double belt_travel_m) const;
  void see_belt(const world::CameraSpec& camera, const RgbdFrame& frame, const Moment& moment);
  void read_labels(const RgbdFrame& frame, const TopView& view, const Segments& segments,
                   const std::vector<Sighting>& sightings, const std::vector<std::uint32_t>& tracks,
                   double belt_travel_m);
};

// Those in view; of the others, what has ridden out of it will not come back.
std::vector<LabelMark> Perception::Impl::marks(const TopView& view, double belt_travel_m) {
  std::vector<LabelMark> seen;
  std::erase_if(shared, [&](const auto& label) { return label.second.x() + belt_travel_m > world.belt.x_end_m; });
  for (const auto& [code, middle] : shared) {
    const cv::Point cell = view.cell(middle.x() + belt_travel_m, middle.y());
    if (view.contains(cell)) seen.push_back({code, cell});
  }
  return seen;
}

// The outlines of what has been seen well and named.
std::vector<cv::RotatedRect> Perception::Impl::known(const TopView& view, Time now, double belt_travel_m) const {
  std::vector<cv::RotatedRect> outlines;
  for (const ObjectBelief& belief : tracker.beliefs(now, belt_travel_m)) {
    if (belief.code.empty() || belief.confidence < kSeenWell) continue;
    const Vector3 middle = belief.world_from_top.translation();
    const Eigen::Matrix3d& axes = belief.world_from_top.linear();
    const auto cells = [&](double m) { return static_cast<float>(m / view.cell_m); };
    outlines.emplace_back(cv::Point2f(cells(middle.x() - view.x0_m) - 0.5F, cells(middle.y() - view.y0_m) - 0.5F),
                          cv::Size2f(cells(belief.size_m.x()), cells(belief.size_m.y())),
                          static_cast<float>(std::atan2(axes(1, 0), axes(0, 0)) * 180 / std::numbers::pi));
  }
  return outlines;
}

void Perception::Impl::see_belt(const world::CameraSpec& camera, const RgbdFrame& frame, const Moment& moment) {
  auto viewer = viewers.find(frame.camera);
  if (viewer == viewers.end() || !viewer->second.fits(frame)) {
    viewer = viewers.insert_or_assign(frame.camera, TopViewer(frame, world.belt, both)).first;
  }
  const cv::Mat1b& robot = self_filter.mask(frame, viewer->second.sampling(), moment.joint_position);
  const TopView& view = viewer->second.build(frame, robot);
  Look& look = looks[camera.world_from_optical.translation().x()];
  look.sees_belt = view.clear;
  const Segments& segments =
      segmenter.segment(view, marks(view, moment.belt_travel_m), known(view, frame.stamp, moment.belt_travel_m));
  const std::vector<Sighting> sightings = measure(view, segments, both);
  const auto tracks = tracker.update(view, segments, sightings, frame.stamp, moment.belt_travel_m);
  look.cut.clear();
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!sightings[i].at_border || tracks[i] != 0) continue;
    const bool comes = sightings[i].world_from_top.translation().x() < view.camera_m.x();
    // What is near the robot may be what it carries.
    if (!comes && (sightings[i].near_robot || !reaches_end(camera, sightings[i]))) continue;
    look.cut.push_back(half_seen(sightings[i], comes ? Seen::kFront : Seen::kBack, moment.belt_travel_m));
  }
  if (camera.reads_labels) read_labels(frame, view, segments, sightings, tracks, moment.belt_travel_m);
}

// Whether it is the view's downstream border that cuts it.
bool Perception::Impl::reaches_end(const world::CameraSpec& camera, const Sighting& sighting) const {
  world::Belt raised = world.belt;
  raised.surface_z_m += sighting.size_m.z();
  const auto seen = world::seen_of_belt(camera, raised);
  return seen && sighting.world_from_top.translation().x() + 0.5 * along_belt_m(sighting) > seen->to_m - kAtEnd_m;
}

ObjectBelief Perception::Impl::half_seen(const Sighting& sighting, Seen seen, double belt_travel_m) const {
  const double c = std::abs(std::cos(sighting.yaw_rad)), s = std::abs(std::sin(sighting.yaw_rad));
  const Vector3& size = sighting.size_m;
  const double along_m = along_belt_m(sighting), across_m = s * size.x() + c * size.y();
  ObjectBelief belief;
  belief.size_m = {world.rules.max_size_m, across_m, size.z() + 0.5 * along_m * std::sin(sighting.tilt_rad)};
  const Vector3 middle = sighting.world_from_top.translation();
  const double longer_m = 0.5 * (belief.size_m.x() - along_m);  // than what shows, and beyond the border
  const double x_m = middle.x() + (seen == Seen::kFront ? -longer_m : longer_m);
  belief.world_from_top.translation() =
      Vector3(x_m - belt_travel_m, middle.y(), world.belt.surface_z_m + belief.size_m.z());
  belief.velocity_m_s.x() = world.belt.speed_m_s;
  belief.half_seen = true;
  return belief;
}

void Perception::Impl::read_labels(const RgbdFrame& frame, const TopView& view, const Segments& segments,
                                   const std::vector<Sighting>& sightings, const std::vector<std::uint32_t>& tracks,
                                   double belt_travel_m) {
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (tracks[i] == 0) continue;
    const bool wants = tracker.wants_label(tracks[i]);
    if (wants) wanted.push_back(i);
    if (sightings[i].complete && !sightings[i].covered) tracker.label_shown(tracks[i], wants);
  }
  const std::vector<LabelRead> reads = label_reader.read(frame, view, segmenter.texture(), segments, sightings, wanted);
  for (const LabelRead& read : reads) {
    const Vector3 middle_m = read.middle_m - Vector3(belt_travel_m, 0, 0);
    const auto other = std::ranges::find_if(reads, [&](const LabelRead& another) {
      return another.sighting == read.sighting && another.code != read.code;
    });
    if (other == reads.end()) {
      tracker.label_read(tracks[read.sighting], read.code, middle_m.head<2>());
      continue;
    }
    // One object that shows two codes, or two objects taken for one, that the next frames may tell apart.
    shared[read.code] = middle_m;
    if (&*other < &read) continue;  // that pair has been told of
    const Vector3 other_m = other->middle_m - Vector3(belt_travel_m, 0, 0);
    tracker.labels_read(tracks[read.sighting], {read.code, middle_m.head<2>()}, {other->code, other_m.head<2>()});
  }
}

Perception::Perception(const world::World& world, model::RobotModel model, Both both) {
  // The caller says how many threads there are; the library would start its own.
  cv::setNumThreads(1);
  impl_ = std::make_unique<Impl>(world, std::move(model), std::move(both));
}

Perception::~Perception() = default;

void Perception::add_robot(model::RobotModel model) { impl_->self_filter.add(std::move(model)); }

void Perception::process(const RgbdFrame& frame, const Moment& moment) {
  const auto camera = std::ranges::find(impl_->world.cameras, frame.camera, &world::CameraSpec::name);
  if (camera == impl_->world.cameras.end()) return;
  if (camera->watches == "belt") {
    impl_->see_belt(*camera, frame, moment);
    return;
  }
  const auto watch = impl_->watches.find(camera->watches);
  if (watch == impl_->watches.end()) return;
  const Sampling sampling(frame.intrinsics);
  watch->second.process(frame, sampling, impl_->self_filter.mask(frame, sampling, moment.joint_position));
}

std::vector<ObjectBelief> Perception::beliefs(Time now, double belt_travel_m) const {
  return impl_->tracker.beliefs(now, belt_travel_m);
}

std::vector<ObjectBelief> Perception::cut(Time now, double belt_travel_m) const {
  std::vector<ObjectBelief> beliefs;
  for (const auto& [x_m, look] : impl_->looks) beliefs.insert(beliefs.end(), look.cut.begin(), look.cut.end());
  for (ObjectBelief& belief : beliefs) {
    belief.stamp = belief.last_seen = now;
    belief.world_from_top.translation().x() += belt_travel_m;
  }
  return beliefs;
}

bool Perception::sees_belt() const {
  return std::ranges::all_of(impl_->looks, [](const auto& entry) { return entry.second.sees_belt; });
}

bool Perception::wants_labels() const { return impl_->tracker.wants_labels(); }

void Perception::forget(std::uint32_t track) { impl_->tracker.forget(track); }

int Perception::occupancy(std::string_view place) const {
  const auto watch = impl_->watches.find(place);
  return watch == impl_->watches.end() ? 0 : watch->second.occupancy();
}

}  // namespace pons::perception
