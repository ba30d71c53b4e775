// A task for what somebody does by hand: it goes on as long as more is said of what it is to do, and goes last.
#pragma once

#include <string>
#include <utility>

#include "pons/bridge/bridge.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"

namespace pons::apps {

class ByHand {
 public:
  // `bridge` outlives it. The skill holds that resource, and ends when nobody says more, or when a task waits for it.
  ByHand(bridge::Bridge& bridge, std::string skill, std::string resource)
      : bridge_(bridge), skill_(std::move(skill)), resource_(std::move(resource)) {}

  struct Taken {
    std::string id;
    bool begun = false;  // just now, with those arguments
  };
  // The task that is at it; where none is, one begins. Errors: another has the resource, or waits for it; this one
  // rests, or is about to end; those of Bridge::submit().
  [[nodiscard]] Expected<Taken> take(const bridge::Json& arguments, Time now);

 private:
  bridge::Bridge& bridge_;
  std::string skill_, resource_;
  std::string id_;  // of the last one
};

}  // namespace pons::apps
