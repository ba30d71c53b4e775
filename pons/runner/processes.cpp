#include "pons/runner/processes.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "pons/rt/periodic_loop.hpp"
#include "pons/runner/body_side.hpp"
#include "pons/runner/realtime.hpp"

namespace pons::runner {
namespace {

using link::Border;
using link::Closing;
using link::Stage;

constexpr Duration kLook = std::chrono::milliseconds(20);  // how often a side looks whether the other lives

// Watches the body from a thread of its own: the run's clock stands still without it, and so would who waits for that.
class Vigil {
 public:
  explicit Vigil(const Crossing& crossing) {
    thread_ = std::jthread([this, &crossing](const std::stop_token& stop) {
      const rt::MonotonicClock own;
      rt::PeriodicLoop loop(own, kLook);
      loop.run([&](Time) {
        if (stop.stop_requested()) return false;
        if (crossing.other_lives() && crossing.border->now_at() != Stage::kEnded) return true;
        gone_.set(1);
        return false;
      });
    });
  }
  [[nodiscard]] const rt::WakeWord& gone() const { return gone_; }

 private:
  rt::WakeWord gone_;
  std::jthread thread_;
};

Error body_gone(const Border& border) {
  const bool in_order = border.now_at() == Stage::kEnded;
  return {std::string(kBodyGone), "pons bridge",
          in_order ? "it was ended; start it again, and a bridge with another journal"
                   : "the journal is whole; start a body again, and a bridge with another journal"};
}

// Looks at the bridge once a period, and tells when one comes or goes.
class BridgeWatch {
 public:
  explicit BridgeWatch(const Crossing& crossing) : crossing_(crossing) {}
  // Whether there is one.
  bool look() {
    const bool lives = crossing_.other_lives();
    if (lives && !lived_) crossing_.tell("a bridge has come");
    if (lived_ && !lives && crossing_.border->closing.load() == Closing::kOpen)
      crossing_.tell("the bridge has gone; the arm holds, and waits for another");
    lived_ = lives;
    return lives;
  }

 private:
  const Crossing& crossing_;
  bool lived_ = false;
};

}  // namespace

Expected<RunResult> run_body_process(BodyParts& parts, const Crossing& crossing, const Watch& watch) {
  Border& border = *crossing.border;
  BridgeWatch bridge(crossing);
  const auto interrupted = [&] { return watch.interrupted && watch.interrupted(); };
  const rt::MonotonicClock own;  // a person who waits must be heard although the run stands still
  RunResult result;
  rt::PeriodicLoop waiting(own, kLook);
  waiting.run([&](Time) { return !interrupted() && !(bridge.look() && border.ready.load()); });
  if (interrupted()) {
    border.go_to(Stage::kEnded);
    return result;
  }
  std::destroy_at(&border.clock);
  std::construct_at(&border.clock, kLeash);
  auto side = std::make_unique<BodySide>(parts, border.clock);
  border.go_to(Stage::kRunning);
  Expected<void> good;
  rt::PeriodicLoop loop(own, kLook);
  loop.run([&](Time) {
    border.finished.store(side->finished());
    side->refusals().tell(watch);
    pass_on_events(parts, watch);
    good = side->health();
    const bool lives = bridge.look();
    if (interrupted() && border.now_at() == Stage::kRunning) border.go_to(Stage::kEnding);
    const bool left = border.now_at() == Stage::kEnding && !lives;
    return good.has_value() && border.closing.load() == Closing::kOpen && !left;
  });
  result.end = border.clock.now();
  const auto figures = side->end();
  side->refusals().tell(watch);
  result.degraded = side->refusals().line();
  if (!figures) (void)side.release();  // a loop that is stuck is left with it
  pass_on_events(parts, watch);
  result.complete = border.closing.load() == Closing::kComplete;
  border.go_to(Stage::kEnded);
  if (!good) return std::unexpected(good.error());
  if (!figures) return std::unexpected(figures.error());
  result.loop = *figures;
  return result;
}

void await_body(const std::string& name, Duration limit, const std::function<bool()>& interrupted) {
  const rt::MonotonicClock own;
  rt::PeriodicLoop loop(own, kLook);
  loop.run([&](Time now) { return !rt::SharedMemory::is_owned(name) && now < Time(limit) && !interrupted(); });
}

bool await_departure(const Crossing& crossing, Duration limit) {
  const rt::MonotonicClock own;
  rt::PeriodicLoop loop(own, kLook);
  loop.run([&](Time now) { return crossing.other_lives() && now < Time(limit); });
  return !crossing.other_lives();
}

Expected<void> await_begin(const Crossing& crossing, const std::function<bool()>& interrupted) {
  Border& border = *crossing.border;
  border.ready.store(true);
  const rt::MonotonicClock own;
  rt::PeriodicLoop loop(own, kLook, border.stage);
  bool gone = false;
  loop.run([&](Time) {
    const Stage stage = border.now_at();  // once: a body that is ended as it waits has never begun
    gone = stage == Stage::kEnded || !crossing.other_lives();
    return !gone && stage == Stage::kWaiting && !interrupted();
  });
  if (gone) return std::unexpected(body_gone(border));
  return {};
}

Expected<RunResult> run_bridge_process(BridgeSide& bridge_side, Observer& observer, const Crossing& crossing,
                                       const Watch& watch) {
  Border& border = *crossing.border;
  const std::int64_t retries_before = border.retries.load();
  Refusals refusals;
  Watch both = watch;
  both.interrupted = [&] { return (watch.interrupted && watch.interrupted()) || border.now_at() == Stage::kEnding; };
  both.progress = [&](Time now) {
    border.last_outcome_ns.store(bridge_side.last_outcome().ns());
    border.retries.store(retries_before + bridge_side.retries());
    refusals.tell(watch);
    if (watch.progress) watch.progress(now);
  };
  const Vigil vigil(crossing);
  const BodyView body{&border.clock, &vigil.gone(), [&] { return border.finished.load(); },
                      [&]() -> Expected<void> {
                        if (vigil.gone().value() == 0) return {};
                        return std::unexpected(body_gone(border));
                      }};
  auto result = run_bridge(bridge_side, observer, body, refusals, both);
  if (result) result->degraded = refusals.line();
  return result;
}

}  // namespace pons::runner
