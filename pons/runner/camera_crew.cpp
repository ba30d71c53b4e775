#include "pons/runner/camera_crew.hpp"

#include <algorithm>
#include <utility>

namespace pons::runner {

CameraCrew::CameraCrew(const world::World& world, std::vector<body::Camera*> cameras,
                       perception::Perception& perception, Pace pace)
    : world_(world),
      cameras_(std::move(cameras)),
      perception_(perception),
      pace_(pace),
      finds_(std::ranges::any_of(world.cameras,
                                 [](const world::CameraSpec& c) { return c.watches == "belt" && !c.reads_labels; })),
      frames_(cameras_.size()),
      busy_(cameras_.size(), false) {
  for (const world::CameraSpec& spec : world_.cameras) next_shutter_.emplace_back(from_s(spec.phase_s));
  developer_ = std::jthread([this](const std::stop_token& stop) { develop(stop); });
  perceiver_ = std::jthread([this](const std::stop_token& stop) { perceive(stop); });
}

CameraCrew::~CameraCrew() {
  developer_.request_stop();
  perceiver_.request_stop();
  changed_.notify_all();
}

Duration CameraCrew::latency(std::size_t camera) const { return from_s(world_.cameras[camera].latency_s); }

void CameraCrew::open_shutters(Time now, const body::Sensors& sensors) {
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    if (now < next_shutter_[camera]) continue;
    next_shutter_[camera] += from_s(world_.cameras[camera].period_s);
    {
      std::unique_lock lock(mutex_);
      if (finds_ && world_.cameras[camera].reads_labels && !wants_labels_) continue;
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

void CameraCrew::develop(const std::stop_token& stop) {
  for (;;) {
    std::size_t camera = 0;
    Time stamp;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return shots_.size() > developed_; })) return;
      camera = shots_[developed_].camera;
      stamp = shots_[developed_].stamp;
    }
    RgbdFrame& frame = frames_[camera];
    auto finished = cameras_[camera]->finish(frame);
    frame.camera = world_.cameras[camera].name;
    frame.stamp = stamp;
    const std::lock_guard lock(mutex_);
    if (finished) {
      ++developed_;  // it may have shrunk in the meantime, by as much as shots_
    } else {
      error_ = finished.error();
    }
    changed_.notify_all();
    if (!finished) return;
  }
}

void CameraCrew::perceive(const std::stop_token& stop) {
  for (;;) {
    Shot shot;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return developed_ > 0; })) return;
      shot = shots_.front();
    }
    Snapshot snapshot = take_in(shot);
    const std::lock_guard lock(mutex_);
    shots_.pop_front();
    --developed_;
    busy_[shot.camera] = false;
    snapshots_.push_back(std::move(snapshot));
    changed_.notify_all();
  }
}

Snapshot CameraCrew::take_in(const Shot& shot) {
  for (const std::uint32_t track : shot.forgotten) perception_.forget(track);
  perception_.process(frames_[shot.camera], shot.moment);
  Snapshot snapshot{shot.stamp,
                    shot.due,
                    shot.moment.belt_travel_m,
                    perception_.beliefs(shot.stamp, shot.moment.belt_travel_m),
                    perception_.coming(shot.stamp, shot.moment.belt_travel_m),
                    {},
                    perception_.wants_labels()};
  for (const world::CameraSpec& camera : world_.cameras) {
    if (camera.watches != "belt") snapshot.occupancy[camera.watches] = perception_.occupancy(camera.watches);
  }
  return snapshot;
}

Expected<std::optional<Snapshot>> CameraCrew::collect(Time now, const std::vector<std::uint32_t>& forgotten) {
  std::unique_lock lock(mutex_);
  to_forget_.insert(to_forget_.end(), forgotten.begin(), forgotten.end());
  if (pace_ == Pace::kLockstep) {
    // Whatever is due must be taken in first, however long the threads take.
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
  if (newest) wants_labels_ = newest->wants_labels;
  return newest;
}

}  // namespace pons::runner
