#include "pons/skills/move_to.hpp"

#include <array>

#include "pons/motion/line.hpp"
#include "pons/skills/conduct.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr double kAbove_m = 0.15;
constexpr std::array kHeights_m{kAbove_m};
constexpr Duration kSearchFor = std::chrono::milliseconds(1000);  // where one tick is too short to find a way
constexpr std::string_view kHome = "home", kJoints = "joints", kLine = "line";

class MoveTo final : public ArmSkill {
 public:
  MoveTo(Cell& cell, std::string place, std::string path)
      : cell_(cell), place_(std::move(place)), path_(std::move(path)), delay_(cell.arm) {}

  Progress tick(Time now) override {
    arrives_ += delay_.take();
    if (!cell_.arm.operational()) {
      plan_anew();
      return cancelled_ ? Progress{Status::kFailed, "cancelled", {}} : Progress{};
    }
    if (moving_) {
      if (now < arrives_) return {};
      return cancelled_ ? Progress{Status::kFailed, "cancelled", {}}
                        : Progress{Status::kSucceeded, {}, {{"place", place_}, {"path", path_}, {"way_s", way_s_}}};
    }
    if (path_ == kLine && now < cell_.arm.motion_end()) return {};  // a line begins at rest
    const auto way = plan(now);
    if (!since_) since_ = now;
    if (!way && cell_.router.spent() && now < *since_ + kSearchFor) return {};
    if (!way) return {Status::kFailed, way.error().line(), {}};
    if (auto sent = cell_.arm.stream(*way); !sent) return {Status::kRetry, sent.error().line(), {}};
    arrives_ = way->back().end();
    way_s_ = to_s(arrives_ - way->front().start);
    moving_ = true;
    return {};
  }

  void cancel(Time now) override {
    cancelled_ = true;
    moving_ = true;
    if (cell_.stop(now)) arrives_ = cell_.arm.motion_end();
  }

  // What the cups hold nobody else could place.
  bool may_rest(Time, task::Pause pause) override {
    if (pause == task::Pause::kHandOver && cell_.held) return false;
    plan_anew();
    return true;
  }
  void go_on(Time, Duration) override {}

 private:
  void plan_anew() {
    moving_ = false;
    search_ = {};
    since_.reset();
  }

  Expected<motion::Trajectory> plan(Time now) {
    if (path_ == kLine) return line(now);
    if (cell_.held) return cell_.carry(now, [&](const AxisVector& from) { return target(from); }, search_);
    return empty(now);
  }

  Expected<AxisVector> target(const AxisVector& from) {
    if (place_ == kHome) return cell_.world.robot.home;
    const world::Place* place = cell_.world.place(place_);
    if (place == nullptr) return fail("no place '" + place_ + "' in this world", "move_to");
    const double depth = cell_.held ? cell_.held->load.size_m.z() : 0;
    return cell_.model.inverse(Cell::tip_down(place->center_m + Vector3(0, 0, kAbove_m + depth), 0), from);
  }

  Expected<motion::Trajectory> empty(Time now) {
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const auto q = target(state.position);
    if (!q) return std::unexpected(q.error());
    return cell_.router.route(state, from, {*q, AxisVector::Zero(q->size())}, nullptr, cell_.objects(),
                              cell_.limits_empty(), &search_.known);
  }

  Expected<motion::Trajectory> line(Time now) {
    if (cell_.held)
      return fail("a line is for empty cups", "move_to", "leave out \"path\": the way is chosen for what is held");
    const Time from = cell_.arm.splice_time(now);
    const AxisVector start = cell_.arm.planned(from).position;
    const auto q = target(start);
    if (!q) return std::unexpected(q.error());
    auto line = motion::move_line(cell_.model, start, from, cell_.model.world_from_tip(*q), cell_.limits_empty(), {});
    if (!line) return std::unexpected(line.error());
    motion::Trajectory& way = line->trajectory;
    const Time end = way.back().end();
    if (cell_.router.clear(way, from, end, nullptr, cell_.objects())) return std::move(way);
    const auto judged = cell_.router.judge(way, from, end, nullptr, cell_.objects());
    const std::string why = judged ? "" : ": " + judged.error().what;
    return fail("the line to " + place_ + " is not clear" + why, "move_to",
                "leave out \"path\": a way round is looked for");
  }

  Cell& cell_;
  std::string place_, path_;
  Delay delay_;
  Cell::Search search_;
  std::optional<Time> since_;  // it is searched
  Time arrives_;
  double way_s_ = 0;
  bool moving_ = false, cancelled_ = false;
};

}  // namespace

task::SkillType move_to(Cell& cell) {
  std::vector<std::string> places = cell.world.place_names();
  for (const std::string& name : places) cell.reach.foresee(name, kHeights_m);
  places.emplace_back(kHome);
  return {.name = "move_to",
          .summary = "Bring the tool over a place, or home",
          .schema = {{"type", "object"},
                     {"properties", {{"place", {{"enum", places}}}, {"path", {{"enum", {kJoints, kLine}}}}}},
                     {"required", {"place"}},
                     {"additionalProperties", false}},
          .resources = {cell.world.arm},
          .timeout = std::chrono::seconds(15),
          .attempts = 2,
          .outputs = {"way_s"},
          .safe_points = {"anywhere on the way; with something on the cups nobody else gets the arm there"},
          .feasible =
              [&cell](const task::Json& arguments, task::Moment) {
                return cell.reach.over(arguments.at("place").get<std::string>(), kHeights_m);
              },
          .start =
              [&cell](const task::Json& arguments, Time) {
                return conduct(cell, std::make_unique<MoveTo>(cell, arguments.at("place").get<std::string>(),
                                                              arguments.value("path", std::string(kJoints))));
              }};
}

}  // namespace pons::skills
