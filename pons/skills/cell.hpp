// What all arm skills share: the world, the arm, what is believed to lie where, and what hangs on the cups. One object
// a bridge, one thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/skills/arm.hpp"
#include "pons/skills/company.hpp"
#include "pons/skills/dragged.hpp"
#include "pons/skills/fallen.hpp"
#include "pons/skills/mouths.hpp"
#include "pons/skills/reach.hpp"
#include "pons/skills/route.hpp"
#include "pons/skills/strays.hpp"
#include "pons/task/policy.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// What the tip may meet while cups press on a parcel, lift one whose mass is not known yet, or let go of one.
inline constexpr double kHandling_n = 100;

// So slow a belt stands, by its encoder.
inline constexpr double kStands_m_s = 0.002;

// The parcel on the cups.
struct Held {
  std::string code;
  Load load;
  double mass_kg = 0;
  Company company = {};
  bool alone = true;                   // nobody was near, or the lift has shown that nobody came along
  std::optional<Vector3> from_m = {};  // where the tip was when it was lifted, world frame less the belt's travel
  Falls falls = {};                    // when it was lifted
  double ahead_m = 0;                  // the farthest that its lift went beyond from_m, which rides
  // Put back before, unseen since, and lifted from among others: until it is weighed in that lift, it may be one of
  // these.
  bool doubtful = false;

  bool operator==(const Held&) const = default;
};

// A grasp that failed: the parcel may lie elsewhere now, and the arm is in the cameras' way.
struct Miss {
  std::string code;
  Time time;
};

// Of a parcel that too few cups have sealed on: how far from where it was believed, world frame, they say it lies.
struct Felt {
  std::string code;
  Time time;
  Eigen::Vector2d aside_m;
};

// A parcel on which another was found to hang, what both weighed the last time and at most, and how often that was.
struct Hooked {
  std::string code;
  double mass_kg = 0, most_kg = 0;
  int times = 1;
  std::string whose = {};  // by code, the last time; empty: nobody's that is known
  double lowest_m = 0;     // of its company, whichever face each lies on
};

// Where set-points for the arm go, one after the other.
class Servo {
 public:
  virtual ~Servo() = default;
  // Errors: those of check_set_point() (servo.hpp); the arm takes none now, or would touch something; the link is full.
  // The motion is then as it was.
  [[nodiscard]] virtual Expected<void> take(const AxisVector& position, Time now) = 0;
};

class Cell {
 public:
  // `link` and `world` must outlive it. `splice_lead`: see Arm.
  Cell(link::BridgeEnd& link, const world::World& world, model::RobotModel model, Duration splice_lead = kSpliceLead);

  // Once a bridge tick, before any skill: the newest beliefs, already predicted to `now`, and when the newest frame of
  // the belt was taken that they come from; none: now.
  void refresh(Time now, std::vector<ObjectBelief> objects, std::optional<Time> seen = {});

  // When that frame was taken; where no camera watches the belt, the last tick.
  [[nodiscard]] Time seen() const { return seen_; }

  [[nodiscard]] bool was_hooked(std::string_view code) const { return hooked && hooked->code == code; }
  // The belief with this label, or nullptr.
  [[nodiscard]] const ObjectBelief* find(std::string_view code) const;
  // Whether something that shows two codes has this one among them.
  [[nodiscard]] bool disputed(std::string_view code) const;
  [[nodiscard]] const std::vector<ObjectBelief>& objects() const { return objects_; }
  // Where that belief will be at `time`, carried on by the belt as it runs and changes speed now.
  [[nodiscard]] Vector3 predict(const ObjectBelief& object, Time time) const;
  [[nodiscard]] double belt_speed_m_s() const { return arm.state().belt_speed_m_s; }
  // At the speed it runs at now.
  [[nodiscard]] double belt_travel_m(Time time) const {
    const link::State& state = arm.state();
    return state.belt_travel_m + to_s(time - state.stamp) * state.belt_speed_m_s;
  }
  // For a second at least: it waits for something.
  [[nodiscard]] bool belt_stands() const { return belt_moved_ && now_ >= *belt_moved_ + kStandsAfter; }
  [[nodiscard]] double belt_acceleration_m_s2() const { return belt_acceleration_m_s2_; }

  // Whether a camera could see it on the belt there.
  [[nodiscard]] bool in_view(double x_m) const { return view_end_m_ && x_m < *view_end_m_; }

  // What is held weighs so much: the loop is told. It must know of every load before the arm moves with it, for it
  // takes what it does not know for a collision, or throws the arm up.
  void weighs(double mass_kg) { held->mass_kg = mass_kg, bears(mass_kg); }
  // Likewise, but not weighed yet: about so much.
  void bears(double mass_kg);
  // Nothing is held any longer: likewise.
  void holds_nothing();
  // What is held has fallen, likewise. Where that is over the belt it may lie there again, and belt and arm are to wait
  // and to keep out of the view as long as it awaits() it.
  void dropped();
  // Once a tick while it should hang there: true when the cups have lost it. Then it has dropped(), and nobody else
  // fell.
  [[nodiscard]] bool loses_load();
  [[nodiscard]] bool awaits(std::string_view code) const { return fallen_.awaits(code); }
  // It is known to lie elsewhere.
  void await_no_more(std::string_view code) { fallen_.forget(code); }

  // A skill that was halted may have left something on the cups that nobody knows of.
  void let_go_of_unknown() {
    if (!held && arm.state().vacuum_on != 0) arm.vacuum(false);
  }

  // Has the belt wait, as long as it is called every tick.
  void hold_belt(Time now) { belt_held_ = now; }
  [[nodiscard]] bool holds_belt(Time now) const { return belt_held_ && now < *belt_held_ + kBeltHeldFor; }

  // What is held was put back on the belt, with the tip there. Until a camera sees it, it is known from that, riding
  // with the belt; then it keeps its label, which no camera may be able to read any more.
  // `top_z_m`: its top, world, where it does not stand on the belt itself.
  void left_on_belt(const Pose& world_from_tip, std::optional<double> top_z_m = {});
  // The arm struck something on its way to that parcel: if it was put back and nobody has seen it since, it does not
  // lie as it was put. It is no longer known, and its place an obstacle.
  void struck(std::string_view code);
  // What was put back and no camera has seen since.
  [[nodiscard]] std::vector<ObjectBelief> left() const {
    std::vector<ObjectBelief> known;
    std::ranges::copy_if(left_, std::back_inserter(known), [](const ObjectBelief& one) { return !one.code.empty(); });
    return known;
  }
  // Gives the codes to those unread that it knows from what was put back or has fallen.
  void label(std::vector<ObjectBelief>& objects) const;
  // No camera shows what stands on the belt under the arm: whatever is within `reach_m` of the tip along the belt
  // counts as so high an obstacle, until the tip has left it; so long unseen_end() counts as no higher, either, or it
  // would hold the arm.
  void hides(double reach_m, double height_m);
  // Nothing counts as hidden any longer.
  void hides_nothing() { hidden_.reset(); }
  // What rides beyond the cameras' view now, and what their border is found to cut, nobody has seen whole: it counts as
  // so high an obstacle until it has ridden off the end.
  void unseen_end(double height_m);
  [[nodiscard]] const Falls& falls() const { return arm.state().fallen_into; }
  // For the journal, of whatever task runs.
  void note(std::string kind, task::Json detail) { notes_.push_back({std::move(kind), std::move(detail)}); }
  // Since the last call, the motions that were sent among them.
  [[nodiscard]] std::vector<task::Note> take_notes();

  // Some cups have sealed on that parcel, on the way to it with the tip turned like that, but too few to lift it: it is
  // taken to lie towards them until a camera sees it again.
  void felt_by_some(std::string_view code, const Eigen::Matrix3d& world_from_tip);
  // Taken off the belt: perception is told to let go of the track.
  void lifted(const ObjectBelief& object);
  [[nodiscard]] std::vector<std::uint32_t> take_forgotten() { return std::exchange(forgotten_, {}); }

  // Tip pose, tool pointing down, over (x, y, z) with its x axis at `yaw`.
  [[nodiscard]] static Pose tip_down(const Vector3& position, double yaw);
  // How far the axis that turns most must turn, rad; far more when an axis would end so near its position limit that
  // the next small motion needs a whole turn back.
  [[nodiscard]] double effort(const AxisVector& from, const AxisVector& to) const;
  // A little inside those that the cerebellum enforces.
  [[nodiscard]] AxisLimits limits_planned() const;
  // Likewise, and as slow as zones want it: what the arm keeps with the cups empty.
  [[nodiscard]] AxisLimits limits_empty() const;
  // Of a motion whose times somebody else has chosen, with what is held; zones make it slower on its way.
  [[nodiscard]] AxisLimits limits_timed() const;
  // How much a motion with what is held asks for: of the cups' hold, and of the motors' torques. `most` may be 1; in a
  // motion as slow as can be, with kSlowestShare of the acceleration limits, `slowly` may.
  struct LoadUse {
    double most = 0, slowly = 0, cups = 0, motors = 0;
  };
  static constexpr double kSlowestShare = 0.10;  // so slowly hardly anything swings
  [[nodiscard]] LoadUse load_use(const motion::Trajectory& way);
  // How a carry is being found, while a tick is too short to find it; empty again when it has ended.
  struct Search {
    double share = 1;   // of the acceleration limits
    bool must = false;  // what is too heavy goes as slowly as can be, too: it has to be put down
    int corrections = 0;
    std::optional<Passage> known;
  };
  // Where a carry shall end, joints, given those it starts from.
  using Goal = std::function<Expected<AxisVector>(const AxisVector& from)>;
  // The fastest way for what is held, from the present motion to standstill at `goal`, that leaves the cups and the
  // motors a reserve; where no speed does, the slowest. Something must be held. Errors: too heavy, where even that
  // would take it off the cups or ask the motors for more than they give; those of the goal and of the router; while
  // that is spent, whoever asks with the same `search` in the next tick goes on from there.
  [[nodiscard]] Expected<motion::Trajectory> carry(Time now, const Goal& goal, Search& search);

  // To rest, as softly as what is held was carried.
  [[nodiscard]] Expected<void> stop(Time now);

  // For an arm that waits: with empty cups out of a zone between arms, where another may have to come; up, with what it
  // holds, before anything that rides along the belt meets it. Does nothing while it moves or where it is clear.
  void keep_clear(Time now);

  // Whether the arm could set out now to take that object off the belt. What is upstream of the pick zone of a belt
  // that stands does not come: it may stand for something that this arm is to take first. What another arm holds is
  // that arm's. Of what nobody sees nothing is known: it could.
  [[nodiscard]] task::Chance chance(std::string_view code) const;
  // Whether it stands where another arm may come once nobody holds the resource of that zone any more; any such zone.
  [[nodiscard]] bool stands_in(std::string_view zone);
  [[nodiscard]] bool stands_in_zone();
  // Whether another arm stands in that zone, whoever holds it.
  [[nodiscard]] bool taken(std::string_view zone) {
    return std::ranges::any_of(others_, [&](Cell* other) { return other->stands_in(zone); });
  }
  // Another arm of the same belt, which must outlive the last look at a zone.
  void beside(Cell& other) {
    others_.push_back(&other);
    strays = other.strays;
  }
  // Whether what rides along the belt passes below the arm and what it holds, where it stands.
  [[nodiscard]] bool lets_pass();

  // With the cups empty: out of the cameras' view, downstream. False: no way there now.
  bool step_aside(Time now);

  const world::World& world;
  Arm arm;
  model::RobotModel model;
  Router router;
  Reach reach;
  Mouths mouths;
  std::optional<Held> held;
  std::optional<Miss> missed;
  std::optional<Hooked> hooked;  // the last one
  std::optional<Held> lost;      // from the cups, as long as nobody has told what became of it
  std::optional<Time> lost_at;   // when; of what was lost before this bridge lived, nobody knows
  std::shared_ptr<Strays> strays = std::make_shared<Strays>();  // of all arms of a belt
  double grip_share = 1;  // of its force that a sealed cup holds now, by its vacuum: carries are as soft as that asks
  bool lifts = true;      // false: the vacuum is too weak to seal; nothing is picked
  task::ChunkStream* stream = nullptr;  // of the skill that follows a policy, as long as it does
  std::uint64_t streams = 0;            // there were so far
  Servo* servo = nullptr;               // of the skill that goes after set-points, as long as it does
  std::function<bool()> is_waited_for;  // whether a task waits for this arm; empty: nobody knows

 private:
  [[nodiscard]] Expected<motion::Trajectory> carry_on(Time now, const Goal& goal, Search& search);
  [[nodiscard]] AxisLimits limits_loaded(double share) const;
  void recognise(double rode_m);
  void believe_felt();
  void take_in_cut();
  void watch_strays();
  void add_unseen();
  [[nodiscard]] ObjectBelief across_belt(double from_m, double to_m, double width_m, double height_m) const;

  static constexpr Duration kStandsAfter = std::chrono::seconds(1);
  static constexpr Duration kBeltHeldFor = std::chrono::milliseconds(50);

  [[nodiscard]] bool stands_over(const world::Place& place);

  std::vector<Cell*> others_;
  std::optional<Time> belt_held_;
  std::optional<double> view_end_m_;  // on the belt; none: no camera watches it
  Time now_, seen_, looked_at_;
  [[nodiscard]] double gain_m(double ahead_s) const;

  double belt_acceleration_m_s2_ = 0;
  double last_belt_speed_m_s_ = 0;
  std::optional<Time> belt_moved_;  // last
  std::vector<ObjectBelief> objects_;
  std::vector<ObjectBelief> left_;  // on the belt, and not seen since, as of now_
  Dragged dragged_;
  Fallen fallen_{view_end_m_.value_or(world.belt.x_end_m), world.belt.x_end_m};
  std::optional<Felt> felt_;                       // of the last one
  std::map<std::uint32_t, std::string> labelled_;  // codes by the track of what was seen since
  std::optional<ObjectBelief> hidden_;
  struct Unseen {
    double from_m, height_m;  // its hindmost, and over the belt
    double rode_m = 0;        // since
  };
  std::optional<Unseen> unseen_;
  std::vector<std::uint32_t> forgotten_;
  std::vector<task::Note> notes_;
};

}  // namespace pons::skills
