// Where the processes of a body and of its bridge meet: the names and what must be equal on both sides.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/assembly.hpp"
#include "pons/core/error.hpp"
#include "pons/link/border.hpp"
#include "pons/rt/shared_memory.hpp"
#include "pons/runner/processes.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// The name under which a world's body and bridge of this user meet when none is given.
[[nodiscard]] std::string default_link(const std::string& world);

// Of the world's files as they are now. Error: one that cannot be read.
[[nodiscard]] Expected<link::Identity> identity_of(const world::World& world, const world::Manifest& manifest);

// One side's hold on what both share.
class MeetingPlace {
 public:
  // The body's: makes it. Error: another body owns the name; no room.
  [[nodiscard]] static Expected<MeetingPlace> make(const std::string& name, const world::World& world,
                                                   const link::Identity& identity);
  // The bridge's. Errors: nobody owns it, another bridge is there, another version, world, cell or manifest.
  [[nodiscard]] static Expected<MeetingPlace> join(const std::string& name, const world::World& world,
                                                   const link::Identity& identity);

  [[nodiscard]] link::Border& border() const { return **border_; }
  [[nodiscard]] Meeting meeting() const {
    return {{&border().link}, border().frames, *pages_, pixels_->data(), runner::Pace::kRealTime};
  }
  // `tell` gets what people should know.
  [[nodiscard]] runner::Crossing crossing(std::function<void(std::string_view)> tell) const {
    return {&border(), [border = border_.get()] { return border->other_lives(); }, std::move(tell)};
  }

 private:
  // Behind pointers: what refers to them stays valid when this moves.
  std::unique_ptr<link::FramePages> pages_;
  std::unique_ptr<rt::SharedMemory> pixels_;
  std::unique_ptr<rt::Shared<link::Border>> border_;
};

// The journal of the body's last bridge, as that one named it.
[[nodiscard]] std::string journal_of(const link::Border& border);
// Before a bridge opens its journal. Errors: the earlier bridges of that body kept another; or this one, and it is not
// there any more.
[[nodiscard]] Expected<void> find_journal(const link::Border& border, const std::string& journal);
// Error: its absolute path is too long.
[[nodiscard]] Expected<void> name_journal(link::Border& border, const std::string& journal);

}  // namespace pons::apps
