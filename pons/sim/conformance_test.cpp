// The simulated body keeps the contract of every body, and the kit that says so finds those that do not.
#include "pons/body/conformance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>

#include "pons/sim/simulation.hpp"
#include "pons/sim/truth.hpp"

namespace pons::sim {
namespace {

// What is between the kit and the simulated body, and may spoil it.
class Spoiled : public body::Body {
 public:
  explicit Spoiled(body::Body& good) : good_(good) {}
  void read(body::Sensors& sensors) PONS_NONBLOCKING override { good_.read(sensors); }
  void write(const body::SetPoints& set_points) PONS_NONBLOCKING override {
    told_ = set_points;
    good_.write(set_points);
  }
  [[nodiscard]] Duration watchdog() const override { return good_.watchdog(); }
  // Once a step of its time.
  virtual void step() {}

 protected:
  body::Body& good_;
  body::SetPoints told_;
};

class Conformance : public testing::Test {
 protected:
  std::vector<std::string> findings(Spoiled& subject_body) {
    body::Subject subject{.body = subject_body,
                          .advance =
                              [&](Time now) {
                                subject_body.step();
                                simulation_->advance_to(now);
                              },
                          .cups_on = [this] { return Truth(*simulation_).cups_on(); },
                          .push_nm = AxisVector::Zero(world_.robot.home.size())};  // it hangs, and falls
    return body::nonconformities(subject);
  }

  static world::World load() {
    auto world = world::load("worlds", "parcel_cell");
    if (!world) throw std::runtime_error(world.error().line());
    world->cameras.clear();
    return *world;
  }
  world::World world_ = load();
  std::unique_ptr<Simulation> simulation_ = Simulation::create(world_, {}, 1).value();
};

TEST_F(Conformance, TheSimulatedBodyKeepsTheContract) {
  Spoiled body(simulation_->body());
  EXPECT_THAT(findings(body), testing::IsEmpty());
}

TEST_F(Conformance, FindsABodyThatHearsSilenceAsTheLastWord) {
  class : public Spoiled {
   public:
    using Spoiled::Spoiled;
    void step() override {
      if (told_.torque_nm.size() > 0) good_.write(told_);
    }
  } body(simulation_->body());
  EXPECT_THAT(findings(body), testing::Contains("a silence does not trip its watchdog"));
}

TEST_F(Conformance, FindsABodyThatTakesItsPowerBack) {
  class : public Spoiled {
   public:
    using Spoiled::Spoiled;
    void write(const body::SetPoints& set_points) PONS_NONBLOCKING override {
      body::SetPoints without = set_points;
      without.power = false;
      good_.write(without);
      Spoiled::write(set_points);
    }
  } body(simulation_->body());
  EXPECT_THAT(findings(body), testing::Contains("power comes back without being asked for anew"));
}

TEST_F(Conformance, FindsABodyThatLetsGoWhenItTrips) {
  class : public Spoiled {
   public:
    using Spoiled::Spoiled;
    void step() override {
      body::Sensors sensors;
      read(sensors);
      if (!sensors.watchdog_tripped) return;
      body::SetPoints open = told_;
      open.vacuum_on = 0;
      good_.write(open);
    }
  } body(simulation_->body());
  EXPECT_THAT(findings(body), testing::ElementsAre("the cups let go when its watchdog trips"));
}

TEST_F(Conformance, FindsABodyWhoseEncoderSlips) {
  class : public Spoiled {
   public:
    using Spoiled::Spoiled;
    void read(body::Sensors& sensors) PONS_NONBLOCKING override {
      good_.read(sensors);
      sensors.position[2] += ++reads_ % 50 == 0 ? 0.05 : 0;
    }

   private:
    int reads_ = 0;
  } body(simulation_->body());
  EXPECT_THAT(findings(body), testing::Contains("it is not where its speed has taken it"));
}

TEST_F(Conformance, FindsAnImpatientWatchdogAndMeasurementsThatAreNone) {
  class : public Spoiled {
   public:
    using Spoiled::Spoiled;
    [[nodiscard]] Duration watchdog() const override { return 3 * good_.watchdog(); }
    void read(body::Sensors& sensors) PONS_NONBLOCKING override {
      good_.read(sensors);
      sensors.stamp = Time{};
      sensors.cup_vacuum_kpa[1] = std::numeric_limits<double>::quiet_NaN();
    }
  } body(simulation_->body());
  EXPECT_THAT(findings(body), testing::IsSupersetOf({"a measurement is not newer than the one before",
                                                     "a measurement is not finite, or larger than any sensor's",
                                                     "its watchdog trips too early"}));
}

}  // namespace
}  // namespace pons::sim
