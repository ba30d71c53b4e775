#include "pons/runner/camera_crew.hpp"

#include <algorithm>
#include <utility>

namespace pons::runner {

CameraCrew::CameraCrew(const world::World& world, std::vector<body::Camera*> cameras,
                       perception::Perception& perception, Pace pace)
    : world_(world), cameras_(std::move(cameras)), perception_(perception), pace_(pace), busy_(cameras_.size(), false) {
  for (const world::CameraSpec& spec : world_.cameras) next_shutter_.push_back(Time(from_s(spec.phase_s)));
  worker_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

CameraCrew::~CameraCrew() {
  worker_.request_stop();
  changed_.notify_all();
}

Duration CameraCrew::latency(std::size_t camera) const { return from_s(world_.cameras[camera].latency_s); }

void CameraCrew::open_shutters(Time now, const body::Sensors& sensors) {
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    if (now < next_shutter_[camera]) continue;
    next_shutter_[camera] += from_s(world_.cameras[camera].period_s);
    {
      std::unique_lock lock(mutex_);
      if (pace_ == Pace::kRealTime && busy_[camera]) continue;
      changed_.wait(lock, [&] { return !busy_[camera] || error_; });
      if (error_) return;
      busy_[camera] = true;
    }
    cameras_[camera]->begin(now);
    const std::lock_guard lock(mutex_);
    shots_.push_back(
        {camera, now, now + latency(camera), {sensors.position, sensors.belt_travel_m}, std::exchange(to_forget_, {})});
    changed_.notify_all();
  }
}

void CameraCrew::work(const std::stop_token& stop) {
  RgbdFrame frame;
  for (;;) {
    Shot shot;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return !shots_.empty(); })) return;
      shot = shots_.front();
    }
    auto snapshot = develop(shot, frame);
    const std::lock_guard lock(mutex_);
    shots_.pop_front();
    busy_[shot.camera] = false;
    if (snapshot) {
      snapshots_.push_back(std::move(*snapshot));
    } else {
      error_ = snapshot.error();
    }
    changed_.notify_all();
  }
}

Expected<Snapshot> CameraCrew::develop(const Shot& shot, RgbdFrame& frame) {
  for (const std::uint32_t track : shot.forgotten) perception_.forget(track);
  if (auto finished = cameras_[shot.camera]->finish(frame); !finished) return std::unexpected(finished.error());
  frame.camera = world_.cameras[shot.camera].name;
  frame.stamp = shot.stamp;
  perception_.process(frame, shot.moment);
  Snapshot snapshot{
      shot.stamp, shot.due, shot.moment.belt_travel_m, perception_.beliefs(shot.stamp, shot.moment.belt_travel_m), {}};
  for (const world::CameraSpec& camera : world_.cameras) {
    if (camera.watches != "belt") snapshot.occupancy[camera.watches] = perception_.occupancy(camera.watches);
  }
  return snapshot;
}

Expected<std::optional<Snapshot>> CameraCrew::collect(Time now, const std::vector<std::uint32_t>& forgotten) {
  std::unique_lock lock(mutex_);
  to_forget_.insert(to_forget_.end(), forgotten.begin(), forgotten.end());
  if (pace_ == Pace::kLockstep) {
    // Whatever is due must be developed first, however long the thread takes.
    changed_.wait(lock, [&] {
      return error_ || std::none_of(shots_.begin(), shots_.end(), [&](const Shot& shot) { return shot.due <= now; });
    });
  }
  if (error_) return std::unexpected(*error_);
  // A frame with a shorter latency may overtake: what counts is the newest shutter among those due, and nothing
  // developed after a frame that is not due yet may leak its knowledge early.
  std::optional<Snapshot> newest;
  while (!snapshots_.empty() && snapshots_.front().due <= now) {
    newest = std::move(snapshots_.front());
    snapshots_.pop_front();
  }
  return newest;
}

}  // namespace pons::runner
