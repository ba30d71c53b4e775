// A process that ends as `kill -9` ends one, where a plan of faults says so: at any moment, in the middle of anything.
#pragma once

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <stop_token>
#include <thread>
#include <utility>

#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "pons/world/faults.hpp"

namespace pons::apps {

class KillsItself {
 public:
  // `now` is the run's time, for any thread. A spell that has begun before this one was there is its forerunner's.
  KillsItself(const world::FaultRate& rate, Random random, std::function<Time()> now)
      : thread_([spells = world::Spells(rate, random), now = std::move(now)](const std::stop_token& stop) mutable {
          bool on = spells.on(now());
          while (!stop.stop_requested()) {
            const bool was = std::exchange(on, spells.on(now()));
            if (on && !was) (void)::kill(::getpid(), SIGKILL);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
        }) {}

 private:
  std::jthread thread_;
};

}  // namespace pons::apps
