#include "pons/runner/observer.hpp"

#include <algorithm>
#include <utility>

#include "pons/perception/shows.hpp"

namespace pons::runner {
namespace {

constexpr timespec kNever{.tv_sec = 1'000'000'000, .tv_nsec = 0};

}  // namespace

Observer::Observer(const world::World& world, perception::Sight& perception, link::Frames& frames,
                   const link::FramePages& pages, std::byte* memory, Pace pace)
    : world_(world),
      perception_(perception),
      places_(frames),
      pace_(pace),
      frames_(world.cameras.size()),
      shown_(frames_.size()) {
  for (std::size_t camera = 0; camera < frames_.size(); ++camera) {
    frames_[camera].camera = world_.cameras[camera].name;
    frames_[camera].intrinsics = world::intrinsics(world_.cameras[camera]);
    frames_[camera].world_from_optical = world_.cameras[camera].world_from_optical;
    pages.lay(frames_[camera], camera, memory);
  }
  places_.take_over();
  perceiver_ = std::jthread([this](const std::stop_token& stop) { perceive(stop); });
}

Observer::~Observer() {
  perceiver_.request_stop();
  places_.handed_over().bump();
}

bool Observer::watches_belt() const {
  return std::ranges::any_of(world_.cameras, [](const world::CameraSpec& camera) { return camera.watches == "belt"; });
}

Duration Observer::latency(std::size_t camera) const { return from_s(world_.cameras[camera].latency_s); }

void Observer::perceive(const std::stop_token& stop) {
  for (;;) {
    const std::uint32_t seen = places_.handed_over().value();
    if (stop.stop_requested()) return;
    const std::optional<std::size_t> camera = places_.oldest();
    if (!camera) {
      (void)places_.handed_over().wait(seen, kNever);
      continue;
    }
    Snapshot snapshot = take_in(*camera);
    {
      const std::lock_guard lock(mutex_);
      snapshots_.push_back(std::move(snapshot));
    }
    places_.give_back(*camera);
  }
}

Snapshot Observer::take_in(std::size_t camera) {
  const link::Shot& shot = places_.shot(camera);
  {
    const std::lock_guard lock(mutex_);
    while (!to_forget_.empty() && to_forget_.front().first < shot.stamp) {
      perception_.forget(to_forget_.front().second);
      to_forget_.pop_front();
    }
  }
  RgbdFrame& frame = frames_[camera];
  frame.stamp = shot.stamp;
  perception_.process(frame, {shot.joint_position, shot.belt_travel_m});
  const bool shows = perception::shows_anything(frame);
  if (shows) shown_[camera] = shot.stamp;
  if (shows && world_.cameras[camera].watches == "belt") {
    belt_seen_ = shot.stamp;
    if (perception_.sees_belt()) belt_clear_ = shot.stamp;
  }
  Snapshot snapshot{shot.stamp,
                    belt_seen_,
                    belt_clear_,
                    shot.stamp + latency(camera),
                    shot.belt_travel_m,
                    perception_.beliefs(shot.stamp, shot.belt_travel_m),
                    perception_.cut(shot.stamp, shot.belt_travel_m),
                    {},
                    perception_.wants_labels(),
                    perception_.base(),
                    shown_};
  for (const world::CameraSpec& watching : world_.cameras) {
    if (watching.watches != "belt") snapshot.occupancy[watching.watches] = perception_.occupancy(watching.watches);
  }
  return snapshot;
}

// Whatever is due must be taken in first, however long the threads take.
void Observer::wait_for_what_is_due(Time now) {
  for (;;) {
    const std::uint32_t seen = places_.given_back().value();
    bool due = false;
    for (std::size_t camera = 0; camera < frames_.size(); ++camera)
      due = due || places_.under_way(camera, now - latency(camera));
    if (!due || places_.failed()) return;
    (void)places_.given_back().wait(seen, kNever);
  }
}

std::optional<Snapshot> Observer::collect(Time now, const std::vector<std::uint32_t>& forgotten) {
  if (pace_ == Pace::kLockstep) wait_for_what_is_due(now);
  const std::lock_guard lock(mutex_);
  for (const std::uint32_t track : forgotten) to_forget_.emplace_back(now, track);
  // A frame with a shorter latency may overtake: what counts is the newest shutter among those due, and nothing
  // developed after a frame that is not due yet may leak its knowledge early.
  std::optional<Snapshot> newest;
  while (!snapshots_.empty() && snapshots_.front().due <= now) {
    newest = std::move(snapshots_.front());
    snapshots_.pop_front();
  }
  if (newest) places_.want_labels(newest->wants_labels);
  return newest;
}

}  // namespace pons::runner
