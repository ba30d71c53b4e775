// A voice, as a skill sees it that speaks.
#pragma once

#include <optional>
#include <string>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"

namespace pons::task {

struct Spoken {
  std::string file;     // name of the WAV file, in the folder that the voice has for all
  double length_s = 0;  // of what is heard
};

// One utterance at a time. Never waits for what makes it, but where virtual time would pass it by.
class Speech {
 public:
  virtual ~Speech() = default;
  // Error: it speaks already.
  [[nodiscard]] virtual Expected<void> begin(const std::string& text, Time now) = 0;
  // Once a tick from then on: nothing while it speaks. Error: what makes the speech failed.
  [[nodiscard]] virtual std::optional<Expected<Spoken>> look(Time now) = 0;
  // Falls silent; the next may begin.
  virtual void stop() = 0;
};

}  // namespace pons::task
