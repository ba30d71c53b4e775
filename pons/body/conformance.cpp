#include "pons/body/conformance.hpp"

#include <algorithm>
#include <cmath>

#include "pons/body/plausible.hpp"

namespace pons::body {
namespace {

constexpr double kStill_rad_s = 0.02;  // slower counts as standing
constexpr double kStill_m_s = 0.002;   // likewise, of the belt
constexpr double kMoved_rad = 1e-4;    // a standing arm gives less
constexpr Duration kComesToRest = std::chrono::milliseconds(500);
constexpr int kLatePeriods = 4;  // by so many it may notice a silence late
constexpr std::uint32_t kCups = 0b101;

class Kit {
 public:
  explicit Kit(Subject& subject) : subject_(subject) {}

  std::vector<std::string> run() {
    measures();
    stands_without_power();
    keeps_the_last_set_points();
    trips();
    stays_off_until_asked_anew();
    return std::move(findings_);
  }

 private:
  void expect(bool kept, const char* what) {
    if (!kept && std::ranges::find(findings_, what) == findings_.end()) findings_.emplace_back(what);
  }

  void wait(Duration duration) {
    const Time until = subject_.now + duration;
    while (subject_.now < until) {
      subject_.now = std::min(until, subject_.now + subject_.period);
      subject_.advance(subject_.now);
      const Sensors before = sensors_;
      subject_.body.read(sensors_);
      if (before.position.size() != sensors_.position.size() || before.speed.size() != sensors_.speed.size()) continue;
      expect(
          follows({before.position, before.speed}, {sensors_.position, sensors_.speed}, sensors_.stamp - before.stamp),
          "it is not where its speed has taken it");
    }
  }
  void tell(const SetPoints& set_points, Duration duration) {
    for (const Time until = subject_.now + duration; subject_.now < until;) {
      subject_.body.write(set_points);
      wait(subject_.period);
    }
  }
  [[nodiscard]] SetPoints off() const { return {AxisVector::Zero(subject_.push_nm.size()), kCups, false, false}; }
  [[nodiscard]] SetPoints pushed() const { return {subject_.push_nm, kCups, true, true}; }
  [[nodiscard]] bool stands() const { return sensors_.speed.cwiseAbs().maxCoeff() < kStill_rad_s; }
  [[nodiscard]] Duration late() const { return kLatePeriods * subject_.period; }

  void measures() {
    expect(subject_.body.watchdog() > Duration{0}, "it has no watchdog");
    tell(off(), subject_.period);
    for (int i = 0; i < 20; ++i) {
      const Time before = sensors_.stamp;
      tell(off(), subject_.period);
      const Eigen::Index axes = subject_.push_nm.size();
      expect(sensors_.stamp > before, "a measurement is not newer than the one before");
      expect(sensors_.stamp <= subject_.now, "a measurement is from the future");
      if (sensors_.position.size() != axes || sensors_.speed.size() != axes) {
        expect(false, "a measurement has not one value an axis");
        sensors_.position = sensors_.speed = AxisVector::Zero(axes);
        continue;
      }
      expect(is_sensible(sensors_, axes), "a measurement is not finite, or larger than any sensor's");
    }
  }

  void stands_without_power() {
    SetPoints pushed_without_power = pushed();
    pushed_without_power.power = false;
    const AxisVector stood = sensors_.position;
    tell(pushed_without_power, 4 * subject_.body.watchdog());
    wait(4 * subject_.body.watchdog());
    expect((sensors_.position - stood).cwiseAbs().maxCoeff() < kMoved_rad, "it moves without power");
    expect(!sensors_.watchdog_tripped, "silence without power trips its watchdog");
    expect(subject_.cups_on() == kCups, "the cups are not as they were told");
  }

  void keeps_the_last_set_points() {
    const AxisVector stood = sensors_.position;
    tell(pushed(), subject_.period);
    wait(subject_.body.watchdog() - subject_.period - late());
    expect(!sensors_.watchdog_tripped, "its watchdog trips too early");
    expect((sensors_.position - stood).cwiseAbs().maxCoeff() > kMoved_rad, "a torque does not move it");
    tell(off(), kComesToRest);
    expect(stands(), "it does not come to rest without power");
  }

  void trips() {
    tell(pushed(), 2 * subject_.period);
    wait(subject_.body.watchdog() + late());
    expect(sensors_.watchdog_tripped, "a silence does not trip its watchdog");
    wait(kComesToRest);
    const AxisVector stood = sensors_.position;
    expect(stands(), "it does not come to rest after its watchdog has tripped");
    wait(kComesToRest);
    expect((sensors_.position - stood).cwiseAbs().maxCoeff() < kMoved_rad, "its brakes do not hold it after that");
    expect(subject_.cups_on() == kCups, "the cups let go when its watchdog trips");
    expect(std::abs(sensors_.belt_speed_m_s) < kStill_m_s, "the belt runs on after its watchdog has tripped");
  }

  void stays_off_until_asked_anew() {
    const AxisVector stood = sensors_.position;
    tell(pushed(), 2 * subject_.body.watchdog());
    expect(sensors_.watchdog_tripped && (sensors_.position - stood).cwiseAbs().maxCoeff() < kMoved_rad,
           "power comes back without being asked for anew");
    tell(off(), subject_.period);
    tell(pushed(), subject_.body.watchdog());
    expect(!sensors_.watchdog_tripped && (sensors_.position - stood).cwiseAbs().maxCoeff() > kMoved_rad,
           "power does not come back when it is asked for anew");
    tell(off(), kComesToRest);
  }

  Subject& subject_;
  Sensors sensors_;
  std::vector<std::string> findings_;
};

}  // namespace

std::vector<std::string> nonconformities(Subject& subject) { return Kit(subject).run(); }

}  // namespace pons::body
