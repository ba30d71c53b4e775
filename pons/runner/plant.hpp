// What a runner advances: a body that moves and sees, in simulation or wrapped around a real one.
#pragma once

#include <functional>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"

namespace pons::runner {

struct Plant {
  std::vector<body::Camera*> cameras;      // in the order of the world's
  std::function<void(Time)> advance;       // the body's physics up to that time
  std::function<bool()> finished;          // nothing more will come
  std::function<Expected<void>()> health;  // an error ends the run
};

}  // namespace pons::runner
