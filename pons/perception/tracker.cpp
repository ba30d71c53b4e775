#include "pons/perception/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pons::perception {
namespace {

constexpr double kGate_m = 0.07;
constexpr double kRescue_m = 0.30;  // how far a push may carry an object between two frames
constexpr double kSameSize_m = 0.012;
constexpr double kOtherSize_m = 0.030;
constexpr double kAsHigh_m = 0.02;
constexpr double kDisturbed_m = 0.015;
constexpr double kDisturbed_rad = 6 * std::numbers::pi / 180;
constexpr double kSquare_m = 0.012;  // sides closer than that may swap between frames
constexpr double kRoundBag_m = 0.035;
constexpr std::size_t kMemory = 16;  // observations averaged
constexpr std::size_t kMotionMemory = 4;
constexpr double kMoved_m = 0.009;  // over the motion memory: more than noise
constexpr int kDoubts = 4;
constexpr int kPieces = 3;  // frames in a row that show them until what was whole is two
constexpr double kBesideLabel_m = 0.005;
constexpr int kEnoughAttempts = 10;  // whose label shows none of them will show none
constexpr double kDoubtful = 0.3;    // confidence of what is partly hidden
constexpr Duration kSwallow = std::chrono::milliseconds(500);

double turn(double from, double to) { return std::remainder(to - from, std::numbers::pi); }

bool usable(const Sighting& s) { return !s.near_robot && !s.at_border && !s.sliver; }

double size_difference(const Vector3& a, const Vector3& b) { return (a - b).cwiseAbs().maxCoeff(); }

template <typename Tracks>
auto live(Tracks& tracks, std::uint32_t id) -> decltype(tracks.data()) {
  const auto found = std::ranges::find_if(tracks, [id](const auto& track) { return track.id == id; });
  return found == tracks.end() || found->forgotten ? nullptr : &*found;
}

}  // namespace

Tracker::Tracker(const world::World& world) : belt_(world.belt), rules_(world.rules) {}

Tracker::Track* Tracker::find(std::uint32_t track) { return live(tracks_, track); }
const Tracker::Track* Tracker::find(std::uint32_t track) const { return live(tracks_, track); }

Tracker::Estimate Tracker::estimate(const std::deque<Observation>& observations) {
  Estimate mean;
  const auto count = static_cast<double>(observations.size());
  double cosine = 0, sine = 0;
  for (const Observation& o : observations) {
    mean.position += Eigen::Vector2d(o.x_m, o.y_m) / count;
    mean.z_m += o.z_m / count;
    mean.flatness_m += o.flatness_m / count;
    mean.size_m += o.size_m / count;
    cosine += std::cos(2 * o.yaw_rad), sine += std::sin(2 * o.yaw_rad);
  }
  mean.yaw_rad = 0.5 * std::atan2(sine, cosine);
  mean.stamp = observations.back().stamp;
  if (observations.size() < 3) return mean;

  // Rolling or sliding: a straight line through the newest observations, if it goes further than noise would.
  const std::size_t first = observations.size() - std::min(observations.size(), kMotionMemory);
  const auto used = static_cast<double>(observations.size() - first);
  double t_mean = 0, tt = 0;
  Eigen::Vector2d p_mean = Eigen::Vector2d::Zero(), tp = Eigen::Vector2d::Zero();
  const auto seconds = [&](const Observation& o) { return to_s(o.stamp - mean.stamp); };
  for (std::size_t i = first; i < observations.size(); ++i) {
    t_mean += seconds(observations[i]) / used;
    p_mean += Eigen::Vector2d(observations[i].x_m, observations[i].y_m) / used;
  }
  for (std::size_t i = first; i < observations.size(); ++i) {
    const double t = seconds(observations[i]) - t_mean;
    tt += t * t;
    tp += t * (Eigen::Vector2d(observations[i].x_m, observations[i].y_m) - p_mean);
  }
  if (tt < 1e-6) return mean;
  const Eigen::Vector2d velocity = tp / tt;
  if (velocity.norm() * -seconds(observations[first]) < kMoved_m) return mean;
  mean.velocity = velocity;
  mean.position = p_mean - velocity * t_mean;
  mean.yaw_rad = observations.back().yaw_rad;
  return mean;
}

Tracker::Observation Tracker::observe(const Track* track, const Sighting& sighting, Time stamp, double travel_m) const {
  const Vector3 top = sighting.world_from_top.translation();
  Observation o{stamp,
                top.x() - travel_m,
                top.y(),
                top.z(),
                sighting.yaw_rad,
                sighting.size_m,
                sighting.flatness_m,
                sighting.covered || !sighting.complete,
                sighting.crowded || sighting.covered};
  if (track == nullptr) return o;
  // Which of two nearly equal sides is the longer one is a matter of noise: keep the track's choice.
  const double reference = track->estimate.yaw_rad;
  const double square = sighting.shape == Shape::kBag ? kRoundBag_m : kSquare_m;
  if (o.size_m.x() - o.size_m.y() < square && std::abs(turn(reference, o.yaw_rad)) > std::numbers::pi / 4) {
    o.yaw_rad += std::numbers::pi / 2;
    std::swap(o.size_m.x(), o.size_m.y());
  }
  o.yaw_rad = reference + turn(reference, o.yaw_rad);
  return o;
}

// Where the track should be seen now: pose, yaw and size, and no more than that.
Sighting Tracker::expected(const Track& track, Time stamp, double travel_m) {
  Sighting sighting{.world_from_top = track.last.world_from_top};
  const Eigen::Vector2d at = track.estimate.at(stamp);
  sighting.world_from_top.translation() = Vector3(at.x() + travel_m, at.y(), track.estimate.z_m);
  sighting.yaw_rad = track.estimate.yaw_rad;
  sighting.size_m = track.estimate.size_m;
  return sighting;
}

// Distance in metres, or infinity when they cannot be one object.
double Tracker::cost(const Track& track, const Sighting& sighting, Time stamp, double travel_m) const {
  constexpr double kNever = 1e9;
  const Observation o = observe(&track, sighting, stamp, travel_m);
  const Eigen::Vector2d predicted = track.estimate.at(stamp);
  const double distance = (Eigen::Vector2d(o.x_m, o.y_m) - predicted).norm();
  if (!usable(sighting) || !sighting.complete) {
    // Of a part that shows, only that it lies where the object should is known.
    const Vector3 seen = sighting.world_from_top.translation();
    const bool inside = expected(track, stamp, travel_m).covers(seen.x(), seen.y(), 0.01);
    const bool as_high = std::abs(seen.z() - track.estimate.z_m) < kAsHigh_m;
    return inside && as_high ? 0.1 + distance : kNever;
  }
  if (distance > kGate_m) return kNever;
  const double odd = size_difference(o.size_m, track.estimate.size_m);
  return odd > kOtherSize_m && distance > kDisturbed_m ? 0.05 + distance : distance;
}

std::vector<int> Tracker::associate(const std::vector<Sighting>& sightings, Time stamp, double travel_m) const {
  struct Pair {
    double cost;
    std::size_t track, sighting;
  };
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    for (std::size_t s = 0; s < sightings.size(); ++s) {
      const double c = cost(tracks_[t], sightings[s], stamp, travel_m);
      if (c < 1) pairs.push_back({c, t, s});
    }
  }
  std::ranges::sort(pairs, [](const Pair& a, const Pair& b) {
    return std::tie(a.cost, a.track, a.sighting) < std::tie(b.cost, b.track, b.sighting);
  });
  std::vector<int> track_of(sightings.size(), -1);
  std::vector<bool> taken(tracks_.size(), false);
  for (const Pair& pair : pairs) {
    if (taken[pair.track] || track_of[pair.sighting] >= 0) continue;
    taken[pair.track] = true;
    track_of[pair.sighting] = static_cast<int>(pair.track);
  }
  return track_of;
}

// An object that was pushed turns up elsewhere with the size it had.
void Tracker::rescue(const std::vector<Sighting>& sightings, Time stamp, double travel_m,
                     std::vector<int>& track_of) const {
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (std::ranges::find(track_of, static_cast<int>(t)) != track_of.end() || tracks_[t].forgotten) continue;
    double nearest = kRescue_m;
    std::size_t best = sightings.size();
    for (std::size_t s = 0; s < sightings.size(); ++s) {
      if (track_of[s] >= 0 || !usable(sightings[s]) || !sightings[s].complete) continue;
      const Observation o = observe(&tracks_[t], sightings[s], stamp, travel_m);
      const double distance = (Eigen::Vector2d(o.x_m, o.y_m) - tracks_[t].estimate.at(stamp)).norm();
      if (distance < nearest && size_difference(o.size_m, tracks_[t].estimate.size_m) < kSameSize_m) {
        nearest = distance, best = s;
      }
    }
    if (best < sightings.size()) track_of[best] = static_cast<int>(t);
  }
}

void Tracker::restart(Track& track, const Observation& observation, bool pushed) {
  // Pushed twice in a row means that it moves on its own: keep its speed.
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  const Observation& last = track.observations.back();
  const double elapsed_s = to_s(observation.stamp - last.stamp);
  if (pushed && track.restarts > 0 && elapsed_s > 0.05 && elapsed_s < 1) {
    velocity = Eigen::Vector2d(observation.x_m - last.x_m, observation.y_m - last.y_m) / elapsed_s;
    if (velocity.norm() > 0.6) velocity.setZero();
  }
  track.observations.assign(1, observation);
  track.estimate = estimate(track.observations);
  track.estimate.velocity = velocity;
  track.odd_sizes = 0;
  if (pushed) ++track.restarts;
}

// Whether a sighting lies where the track should be.
bool Tracker::lies_in(const Track& track, const Sighting& sighting, Time stamp, double travel_m) {
  const Vector3 middle = sighting.world_from_top.translation();
  return std::abs(middle.z() - track.estimate.z_m) < kAsHigh_m &&
         expected(track, stamp, travel_m).covers(middle.x(), middle.y(), 0);
}

// Where a track should be lies something that is not it: what was taken for one may be two, or a shadow or the arm cuts
// it in two for a moment. What hangs before the camera may do so for long.
void Tracker::count_parted(const std::vector<Sighting>& sightings, const std::vector<int>& track_of, Time stamp,
                           double travel_m) {
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    bool parted = false;
    for (std::size_t s = 0; s < sightings.size() && !parted; ++s)
      parted = track_of[s] != static_cast<int>(t) && !sightings[s].at_screen &&
               lies_in(tracks_[t], sightings[s], stamp, travel_m);
    tracks_[t].parted = parted ? tracks_[t].parted + 1 : 0;
  }
}

// Of one that has been seen whole for long.
bool Tracker::perhaps_a_piece(const Sighting& sighting, Time stamp, double travel_m) const {
  return std::ranges::any_of(tracks_, [&](const Track& track) {
    return !track.forgotten && track.well_known() && track.parted < kPieces &&
           lies_in(track, sighting, stamp, travel_m);
  });
}

void Tracker::take_in(Track& track, const Sighting& sighting, Time stamp, double travel_m) {
  const Estimate before = track.estimate;
  const bool same = observed(track, sighting, stamp, travel_m);
  TrackLabel& label = track.label;
  if (label.code().empty()) return;
  // The label moves with its parcel. What was taken for one and is two may have shown the other's.
  Eigen::Vector2d middle_m = label.middle_m() + before.velocity * to_s(stamp - label.stamp());
  if (same) {
    const Eigen::Rotation2Dd turned(turn(before.yaw_rad, track.estimate.yaw_rad));
    middle_m = track.estimate.at(stamp) + turned * (middle_m - before.at(stamp));
  }
  label.move(middle_m, stamp);
  if (!expected(track, stamp, travel_m).covers(middle_m.x() + travel_m, middle_m.y(), kBesideLabel_m)) label.drop();
}

// False when what was seen is not what it was taken for so far: of another size.
bool Tracker::observed(Track& track, const Sighting& sighting, Time stamp, double travel_m) {
  track.last_seen = stamp;
  track.missing = 0;
  track.crowded = sighting.crowded || sighting.covered;
  track.covered = sighting.covered;
  track.whole = sighting.complete;
  ++track.frames_seen;
  if (!usable(sighting)) return true;
  const Observation o = observe(&track, sighting, stamp, travel_m);
  const bool was_doubtful = track.observations.back().doubtful;
  // A good look outlives glimpses of a part, unless the part lies where the whole cannot.
  if (o.doubtful && !was_doubtful) {
    track.doubts = expected(track, stamp, travel_m).holds(sighting) ? 0 : track.doubts + 1;
    if (track.doubts < kDoubts) return true;
  }
  track.doubts = 0;
  const double moved = (Eigen::Vector2d(o.x_m, o.y_m) - track.estimate.at(stamp)).norm();
  const bool round = sighting.shape == Shape::kBag && o.size_m.x() - o.size_m.y() < kRoundBag_m;
  const bool turned = !round && std::abs(o.yaw_rad - track.estimate.yaw_rad) > kDisturbed_rad;
  const bool resized = size_difference(o.size_m, track.estimate.size_m) > 0.02;
  const bool now_whole = was_doubtful && !o.doubtful;
  // Once may be a bad cut between neighbours; a shorter one in the same place, something that hangs over it.
  const bool hidden = track.parted == 0 && expected(track, stamp, travel_m).holds(sighting);
  const int enough = hidden ? kDoubts : (track.parted > 0 && track.well_known() ? kPieces : 2);
  if (hidden != track.odd_hidden) track.odd_sizes = 0;
  track.odd_hidden = hidden;
  // Cuts that differ from one another say nothing.
  if (resized && size_difference(o.size_m, track.odd_size_m) > kOtherSize_m) track.odd_sizes = 0;
  if (resized) track.odd_size_m = o.size_m;
  if (resized && !now_whole && ++track.odd_sizes < enough) return true;
  track.last = sighting;
  const bool another = !o.doubtful && !was_doubtful && size_difference(o.size_m, track.estimate.size_m) > kOtherSize_m;
  // Another object lies here now, on this one or in its place: whose label it was is no longer known. Or what showed
  // two codes was two.
  if (resized && (another || !track.label.disputed().empty())) track.label.drop();
  if (now_whole || (o.doubtful && !was_doubtful) || resized || moved > kDisturbed_m || turned) {
    // What is seen of it changed: that its middle moved says nothing of its speed.
    const bool same_whole = !resized && !o.doubtful && !was_doubtful;
    restart(track, o, same_whole);
    return same_whole;
  }
  track.odd_sizes = 0;
  // A cut between neighbours is not quite where one of them ends: alone, it is measured afresh.
  if (!o.crowded) std::erase_if(track.observations, [](const Observation& earlier) { return earlier.crowded; });
  track.observations.push_back(o);
  if (track.observations.size() > kMemory) track.observations.pop_front();
  if (track.observations.size() >= 3) track.restarts = 0;
  const Eigen::Vector2d velocity = track.estimate.velocity;
  track.estimate = estimate(track.observations);
  if (track.observations.size() < 3) track.estimate.velocity = velocity;
  return true;
}

// True when a camera looked at the place where it should be and saw the belt, something lower than its top, or
// something known to be another.
bool Tracker::visibly_gone(const Track& track, const TopView& view, const Segments& segments,
                           const std::vector<bool>& known, Time stamp, double travel_m) const {
  const Eigen::Vector2d middle = track.estimate.at(stamp) + Eigen::Vector2d(travel_m, 0);
  const double c = std::cos(track.estimate.yaw_rad), s = std::sin(track.estimate.yaw_rad);
  const double height_m = track.estimate.z_m - belt_.surface_z_m;
  const std::uint16_t bare = TopView::steps(0.008), lower = TopView::steps(std::max(0.0, height_m - kAsHigh_m));
  constexpr int kSteps = 5;
  int gone = 0, total = 0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      const double a = 0.4 * i / kSteps * track.estimate.size_m.x(), b = 0.4 * j / kSteps * track.estimate.size_m.y();
      const cv::Point cell = view.cell(middle.x() + c * a - s * b, middle.y() + s * a + c * b);
      ++total;
      if (!view.contains(cell) || view.height(cell) == TopView::kUnknown) continue;
      if ((view.flags(cell) & TopView::kNearRobot) != 0) continue;
      const int label = segments.labels(cell);
      const bool other = label > 0 ? known[static_cast<std::size_t>(label - 1)] : view.height(cell) < bare;
      if (other || view.height(cell) < lower) ++gone;
    }
  }
  return gone * 10 >= total * 6;
}

std::vector<std::uint32_t> Tracker::update(const TopView& view, const Segments& segments,
                                           const std::vector<Sighting>& sightings, Time stamp, double belt_travel_m) {
  passages_.push_back({stamp, belt_travel_m});
  if (passages_.size() > 8) passages_.pop_front();
  std::erase_if(tracks_, [&](const Track& track) {
    return (track.forgotten && stamp > track.forgotten_until) ||
           track.estimate.at(stamp).x() + belt_travel_m > belt_.x_end_m + 0.5 * track.estimate.size_m.x();
  });

  std::vector<int> track_of = associate(sightings, stamp, belt_travel_m);
  rescue(sightings, stamp, belt_travel_m, track_of);
  count_parted(sightings, track_of, stamp, belt_travel_m);
  std::vector<bool> seen(tracks_.size(), false), known(sightings.size(), false);
  std::vector<std::uint32_t> ids(sightings.size(), 0);
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    if (track_of[s] < 0) continue;
    const auto t = static_cast<std::size_t>(track_of[s]);
    seen[t] = true;
    known[s] = usable(sightings[s]) && sightings[s].complete;
    if (tracks_[t].forgotten) continue;
    take_in(tracks_[t], sightings[s], stamp, belt_travel_m);
    ids[s] = tracks_[t].id;
  }
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (seen[t] || !visibly_gone(tracks_[t], view, segments, known, stamp, belt_travel_m)) continue;
    ++tracks_[t].missing;
  }
  std::erase_if(tracks_, [](const Track& track) { return track.missing >= (track.frames_seen < 3 ? 2 : 3); });
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    if (track_of[s] >= 0 || !usable(sightings[s]) || perhaps_a_piece(sightings[s], stamp, belt_travel_m)) continue;
    if (std::abs(sightings[s].world_from_top.translation().y() - belt_.y_center_m) > 0.5 * belt_.width_m) continue;
    Track track;
    track.id = next_id_++;
    track.observations.push_back(observe(nullptr, sightings[s], stamp, belt_travel_m));
    track.estimate = estimate(track.observations);
    track.last = sightings[s];
    track.frames_seen = 1;
    track.last_seen = stamp;
    track.crowded = sightings[s].crowded || sightings[s].covered;
    track.covered = sightings[s].covered;
    track.whole = sightings[s].complete;
    ids[s] = track.id;
    tracks_.push_back(std::move(track));
  }
  return ids;
}

void Tracker::label_shown(std::uint32_t track, bool searched) {
  if (Track* const found = find(track)) found->label.shown(searched);
}

bool Tracker::wants_label(std::uint32_t track) const {
  const Track* const found = find(track);
  return found != nullptr && wants_label(*found);
}

bool Tracker::wants_label(const Track& track) const {
  return !track.label.settled() || rules_.too_large(track.estimate.size_m);
}

bool Tracker::wants_labels() const {
  return std::ranges::any_of(tracks_, [this](const Track& track) {
    return !track.forgotten && track.whole && !track.covered && track.last_seen == passages_.back().stamp &&
           track.label.attempts() < kEnoughAttempts && wants_label(track);
  });
}

bool Tracker::shows(const Track& track, const Eigen::Vector2d& label_m) const {
  const auto& [stamp, travel_m] = passages_.back();
  return expected(track, stamp, travel_m).covers(label_m.x() + travel_m, label_m.y(), kBesideLabel_m);
}

bool Tracker::shown_beside_another(const Track& track, std::string_view code) const {
  const auto at = [this](const Track& one) { return one.estimate.at(passages_.back().stamp); };
  return std::ranges::any_of(tracks_, [&](const Track& other) {
    const std::vector<std::string>& codes = other.label.disputed();
    return other.id != track.id && !other.forgotten && std::ranges::find(codes, code) != codes.end() &&
           (at(other) - at(track)).norm() < other.estimate.size_m.maxCoeff();
  });
}

bool Tracker::was_not_two(const Track& track, std::string_view code) const {
  const std::vector<std::string>& codes = track.label.once_disputed();
  const auto among = [&](std::string_view one) { return std::ranges::find(codes, one) != codes.end(); };
  return among(code) && std::ranges::none_of(tracks_, [&](const Track& other) {
           return other.id != track.id && other.label.code() != code && among(other.label.code());
         });
}

void Tracker::label_read(std::uint32_t track, std::string_view code, const Eigen::Vector2d& middle_m) {
  Track* const found = find(track);
  if (found == nullptr || code.empty() || !shows(*found, middle_m)) return;
  if (shown_beside_another(*found, code) || was_not_two(*found, code)) return;
  found->label.read(code, middle_m, passages_.back().stamp);
  if (found->label.code() != code) return;
  // One code is on one parcel: whoever else has it got it from a bad cut or was this parcel before.
  for (Track& other : tracks_) {
    if (other.id != track) other.label.lose(code);
  }
}

void Tracker::labels_read(std::uint32_t track, const Label& one, const Label& other) {
  Track* const found = find(track);
  const int shown = found == nullptr ? 0 : int{shows(*found, one.middle_m)} + int{shows(*found, other.middle_m)};
  if (shown == 2) found->label.read_two(one.code, other.code);
  // It was cut badly, or is larger than it was.
  if (shown == 1) found->label.suspect(one.code, other.code);
}

void Tracker::forget(std::uint32_t track) {
  Track* const found = find(track);
  if (found == nullptr) return;
  // Frames still under way show it on the belt: they must not bring it back.
  found->forgotten = true;
  found->forgotten_until = (passages_.empty() ? found->last_seen : passages_.back().stamp) + kSwallow;
}

double Tracker::belt_speed(Time now, double travel_m) const {
  for (auto passage = passages_.rbegin(); passage != passages_.rend(); ++passage) {
    const double elapsed_s = to_s(now - passage->stamp);
    if (elapsed_s >= 0.05) return (travel_m - passage->travel_m) / elapsed_s;
  }
  return belt_.speed_m_s;
}

ObjectBelief Tracker::belief(const Track& track, Time now, double travel_m, double belt_speed_m_s) const {
  ObjectBelief belief;
  const Estimate& e = track.estimate;
  const Eigen::Vector2d position = e.at(now) + Eigen::Vector2d(travel_m, 0);
  const auto count = static_cast<double>(track.observations.size());
  belief.track = track.id;
  belief.stamp = now;
  belief.world_from_top = pose_xyz_yaw(position.x(), position.y(), e.z_m, e.yaw_rad);
  if (track.last.world_from_top.linear()(2, 2) < 0.9999) {
    // The lean as last seen, turned to the filtered heading.
    const double change = turn(track.last.yaw_rad, e.yaw_rad);
    belief.world_from_top.linear() =
        Eigen::AngleAxisd(change, Vector3::UnitZ()).toRotationMatrix() * track.last.world_from_top.linear();
  }
  belief.velocity_m_s = {belt_speed_m_s + e.velocity.x(), e.velocity.y(), 0};
  belief.size_m = e.size_m;
  belief.flatness_m = e.flatness_m;
  belief.position_sigma_m = 0.0005 + 0.0015 / std::sqrt(count) + 0.05 * e.velocity.norm();
  belief.yaw_sigma_rad = 0.002 + 0.01 / std::sqrt(count);
  belief.confidence = (1 - std::exp2(-std::min(count, 8.0))) * std::exp2(-track.missing);
  if (track.observations.back().doubtful || track.covered) belief.confidence = std::min(belief.confidence, kDoubtful);
  if (track.observations.back().doubtful) belief.position_sigma_m += 0.01;
  belief.frames_seen = track.frames_seen;
  belief.last_seen = track.last_seen;
  belief.crowded = track.crowded;
  belief.code = track.label.code();
  belief.disputed = track.label.disputed();
  belief.label_attempts = track.label.attempts();
  belief.half_seen = !belief.code.empty() && belief.label_attempts == 0;
  return belief;
}

std::vector<ObjectBelief> Tracker::beliefs(Time now, double belt_travel_m) const {
  std::vector<ObjectBelief> result;
  const double speed = belt_speed(now, belt_travel_m);
  for (const Track& track : tracks_) {
    if (track.forgotten) continue;
    ObjectBelief one = belief(track, now, belt_travel_m, speed);
    if (one.world_from_top.translation().x() <= belt_.x_end_m) result.push_back(std::move(one));
  }
  return result;
}

}  // namespace pons::perception
