#include "pons/motion/phases.hpp"

#include <algorithm>

namespace pons::motion {
namespace {

// Goes through the phases, and rests at the end.
class Walk {
 public:
  Walk(const Phases& phases, double duration_s) : phases_(phases), duration_s_(duration_s) { enter(0); }

  [[nodiscard]] double ends_s() const { return ends_s_; }
  [[nodiscard]] double jerk() const { return now_.jerk; }
  // The acceleration at t_s, which is at most when this phase ends; there the next one begins.
  double pass(double t_s) {
    if (t_s < ends_s_) return now_.acceleration - now_.jerk * (ends_s_ - t_s);
    const double acceleration = now_.acceleration;
    enter(ends_s_);
    return acceleration;
  }

 private:
  void enter(double begins_s) {
    const bool rests = next_ == phases_.count;
    now_ = rests ? Phases::Phase{0, 0, 0} : phases_.phase[next_++];
    ends_s_ = rests ? duration_s_ : begins_s + now_.duration_s;
  }

  const Phases& phases_;
  std::size_t next_ = 0;
  double duration_s_, ends_s_ = 0;
  Phases::Phase now_{};
};

}  // namespace

void append(const Phases& phases, AxisProfile& profile) PONS_NONBLOCKING {
  for (std::size_t i = 0; i < phases.count; ++i) {
    const Phases::Phase& phase = phases.phase[i];
    profile.add(phase.duration_s, phase.jerk, phase.acceleration);
  }
}

void append_mean(const Phases& a, const Phases& b, double weight, double duration_s,
                 AxisProfile& profile) PONS_NONBLOCKING {
  Walk walk_a(a, duration_s), walk_b(b, duration_s);
  const auto mean = [weight](double of_a, double of_b) { return of_b + weight * (of_a - of_b); };
  for (double now = 0; now < duration_s;) {
    const double next = std::min({walk_a.ends_s(), walk_b.ends_s(), duration_s});
    const double jerk = mean(walk_a.jerk(), walk_b.jerk());
    const double acceleration_a = walk_a.pass(next), acceleration_b = walk_b.pass(next);
    profile.add(next - now, jerk, next < duration_s ? mean(acceleration_a, acceleration_b) : 0);
    now = next;
  }
}

}  // namespace pons::motion
