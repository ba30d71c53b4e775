// Sightings of many frames become objects that stay themselves while the belt carries them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/perception/segmentation.hpp"
#include "pons/perception/top_face.hpp"
#include "pons/perception/track_label.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

// Positions are kept relative to the belt (x minus its travel), where a parcel stands still unless something moves it.
class Tracker {
 public:
  explicit Tracker(const world::World& world);

  // Takes in one frame's sightings; says which track each became, 0 for none. Frames in the order of their stamps.
  std::vector<std::uint32_t> update(const TopView& view, const Segments& segments,
                                    const std::vector<Sighting>& sightings, Time stamp, double belt_travel_m);

  // The newest frame shows all of it, good enough to read its label, and was searched for one or not.
  void label_shown(std::uint32_t track, bool searched);
  // A code was read on it in the newest frame, with the label's middle there, relative to the belt: see TrackLabel. No
  // two tracks keep one code, none keeps the code of a label that turns out to lie beside it, and none takes one of the
  // two that something close by shows.
  void label_read(std::uint32_t track, std::string_view code, const Eigen::Vector2d& middle_m);
  struct Label {
    std::string_view code;
    Eigen::Vector2d middle_m;
  };
  // Two codes were read on it in the newest frame.
  void labels_read(std::uint32_t track, const Label& one, const Label& other);
  // False once its label is settled; what seems too long for one object may show another's.
  [[nodiscard]] bool wants_label(std::uint32_t track) const;
  // Whether the newest frame showed one whole and bare that wants it, after fewer than enough attempts.
  [[nodiscard]] bool wants_labels() const;

  void forget(std::uint32_t track);
  [[nodiscard]] std::vector<ObjectBelief> beliefs(Time now, double belt_travel_m) const;

 private:
  struct Observation {
    Time stamp;
    double x_m = 0, y_m = 0, z_m = 0;  // relative to the belt along x
    double yaw_rad = 0;
    Vector3 size_m = Vector3::Zero();
    double flatness_m = 0;
    bool doubtful = false;  // partly hidden or covered
    bool crowded = false;   // a neighbour may have had a say in its size
  };
  static constexpr double kSlidesOn_s = 0.5;
  struct Estimate {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();  // at `stamp`, relative to the belt
    Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // likewise
    Time stamp;
    double z_m = 0, yaw_rad = 0, flatness_m = 0;
    Vector3 size_m = Vector3::Zero();
    // What is seen no longer has come to rest on the belt soon.
    [[nodiscard]] Eigen::Vector2d at(Time time) const {
      return position + velocity * std::min(to_s(time - stamp), kSlidesOn_s);
    }
  };
  struct Track {
    std::uint32_t id = 0;
    std::deque<Observation> observations;  // since it was last disturbed, oldest first
    Estimate estimate;
    Sighting last;  // the last one that counted
    int frames_seen = 0, missing = 0, odd_sizes = 0, restarts = 0, doubts = 0;
    int parted = 0;  // frames in a row in which more than one thing lay where it should be
    Time last_seen;
    Vector3 odd_size_m = Vector3::Zero();
    bool odd_hidden = false;                               // the odd sizes counted lie within what it should look like
    bool crowded = false, covered = false, whole = false;  // when last seen
    TrackLabel label;
    // Seen whole for a while, or for long: a bad cut does not come this often.
    [[nodiscard]] bool well_known() const {
      return (observations.size() >= 4 || frames_seen >= 8) && !observations.back().doubtful;
    }
    bool forgotten = false;  // only kept to swallow frames from before it was taken
    Time forgotten_until;
  };
  struct Passage {
    Time stamp;
    double travel_m = 0;
  };

  [[nodiscard]] static Estimate estimate(const std::deque<Observation>& observations);
  [[nodiscard]] static Sighting expected(const Track& track, Time stamp, double travel_m);
  [[nodiscard]] Observation observe(const Track* track, const Sighting& sighting, Time stamp, double travel_m) const;
  [[nodiscard]] double cost(const Track& track, const Sighting& sighting, Time stamp, double travel_m) const;
  std::vector<int> associate(const std::vector<Sighting>& sightings, Time stamp, double travel_m) const;
  void rescue(const std::vector<Sighting>& sightings, Time stamp, double travel_m, std::vector<int>& track_of) const;
  [[nodiscard]] static bool lies_in(const Track& track, const Sighting& sighting, Time stamp, double travel_m);
  void count_parted(const std::vector<Sighting>& sightings, const std::vector<int>& track_of, Time stamp,
                    double travel_m);
  [[nodiscard]] bool perhaps_a_piece(const Sighting& sighting, Time stamp, double travel_m) const;
  void take_in(Track& track, const Sighting& sighting, Time stamp, double travel_m);
  bool observed(Track& track, const Sighting& sighting, Time stamp, double travel_m);
  void restart(Track& track, const Observation& observation, bool pushed);
  [[nodiscard]] bool visibly_gone(const Track& track, const TopView& view, const Segments& segments,
                                  const std::vector<bool>& known, Time stamp, double travel_m) const;
  [[nodiscard]] ObjectBelief belief(const Track& track, Time now, double travel_m, double belt_speed_m_s) const;
  [[nodiscard]] double belt_speed(Time now, double travel_m) const;
  [[nodiscard]] Track* find(std::uint32_t track);
  [[nodiscard]] const Track* find(std::uint32_t track) const;

  [[nodiscard]] bool wants_label(const Track& track) const;
  [[nodiscard]] bool shows(const Track& track, const Eigen::Vector2d& label_m) const;
  // Whether one close by shows that code and another. What a bad frame cuts off such a one shows no more than it does;
  // where it really was two, it is soon none of them, or of another size.
  [[nodiscard]] bool shown_beside_another(const Track& track, std::string_view code) const;
  // Whether it showed that code beside another, which nobody has now: one of its labels is only hidden.
  [[nodiscard]] bool was_not_two(const Track& track, std::string_view code) const;

  world::Belt belt_;
  world::Rules rules_;
  std::vector<Track> tracks_;  // by id
  std::deque<Passage> passages_;
  std::uint32_t next_id_ = 1;
};

}  // namespace pons::perception
