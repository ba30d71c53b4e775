#include "pons/runner/photographer.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace pons::runner {
namespace {

constexpr timespec kNever{.tv_sec = 1'000'000'000, .tv_nsec = 0};

bool hang_together(const world::CameraSpec& a, const world::CameraSpec& b) {
  return a.world_from_optical.isApprox(b.world_from_optical) && a.fovy_rad == b.fovy_rad;
}

}  // namespace

Photographer::Photographer(const world::World& world, std::vector<body::Camera*> cameras, link::Frames& frames,
                           const link::FramePages& pages, std::byte* memory, Pace pace)
    : world_(world),
      cameras_(std::move(cameras)),
      places_(frames),
      pace_(pace),
      finds_(std::ranges::any_of(world.cameras,
                                 [](const world::CameraSpec& c) { return c.watches == "belt" && !c.reads_labels; })),
      opened_(cameras_.size()),
      frames_(cameras_.size()) {
  for (const world::CameraSpec& spec : world_.cameras) next_shutter_.emplace_back(from_s(spec.phase_s));
  turn_.resize(frames_.size());
  std::iota(turn_.begin(), turn_.end(), std::size_t{0});
  std::ranges::stable_partition(turn_, [&](std::size_t camera) { return world_.cameras[camera].reads_labels; });
  for (std::size_t camera = 0; camera < frames_.size(); ++camera) pages.lay(frames_[camera], camera, memory);
  developer_ = std::jthread([this](const std::stop_token& stop) { develop(stop); });
}

Photographer::~Photographer() = default;

// Whether a picture of it would show what no other one shows as well.
bool Photographer::wants(std::size_t camera, Time now) const {
  const world::CameraSpec& own = world_.cameras[camera];
  if (own.reads_labels) return !finds_ || places_.wants_labels();
  return std::ranges::none_of(turn_, [&](std::size_t other) {
    const world::CameraSpec& reading = world_.cameras[other];
    return reading.reads_labels && opened_[other] == now && hang_together(own, reading);
  });
}

void Photographer::open_shutters(Time now, std::span<const body::Sensors> sensors) {
  for (const std::size_t camera : turn_) {
    if (now < next_shutter_[camera]) continue;
    next_shutter_[camera] += from_s(world_.cameras[camera].period_s);
    if (!looked_at_ || !wants(camera, now)) continue;
    if (pace_ == Pace::kRealTime && !places_.is_free(camera)) continue;
    if (!wait_for_place(camera)) return;
    cameras_[camera]->begin(now);
    opened_[camera] = now;
    link::Shot shot{.stamp = now, .belt_travel_m = sensors.front().belt_travel_m};
    for (std::size_t robot = 0; robot < sensors.size(); ++robot)
      shot.joint_position.of[robot] = sensors[robot].position;
    places_.open(camera, shot);
    const std::lock_guard lock(mutex_);
    exposed_.push_back(camera);
    changed_.notify_all();
  }
}

void Photographer::nobody_looks() {
  looked_at_ = false;
  for (;;) {
    const std::uint32_t seen = places_.handed_over().value();
    bool dark = false;
    for (std::size_t camera = 0; camera < cameras_.size(); ++camera) dark = dark || places_.in_the_dark(camera);
    if (!dark || places_.failed()) return;
    (void)places_.handed_over().wait(seen, kNever);
  }
}

bool Photographer::wait_for_place(std::size_t camera) {
  for (;;) {
    const std::uint32_t seen = places_.given_back().value();
    if (places_.failed()) return false;
    if (places_.is_free(camera)) return true;
    (void)places_.given_back().wait(seen, kNever);
  }
}

void Photographer::develop(const std::stop_token& stop) {
  for (;;) {
    std::size_t camera = 0;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return !exposed_.empty(); })) return;
      camera = exposed_.front();
      exposed_.pop_front();
    }
    if (auto finished = cameras_[camera]->finish(frames_[camera]); !finished) {
      const std::lock_guard lock(mutex_);
      error_ = finished.error();
      places_.fail();
      return;
    }
    places_.hand_over(camera);
  }
}

Expected<void> Photographer::health() const {
  const std::lock_guard lock(mutex_);
  if (error_) return std::unexpected(*error_);
  return {};
}

}  // namespace pons::runner
