// What crosses the link while bridges die and others follow and the body's threads go on. A killed bridge is one that
// goes no further; its successor begins after it, as the operating system's lock on the memory sees to.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <thread>

#include "pons/link/border.hpp"
#include "pons/link/frames.hpp"
#include "pons/link/link.hpp"

namespace pons::link {
namespace {

constexpr std::size_t kCameras = 3;
constexpr int kShots = 12'000, kKilled = 400;
constexpr Intrinsics kSmall{.width = 32, .height = 24};

// A frame shows its number in what was measured with it and in every pixel.
Shot shot_of(int number) {
  return {Time(Duration(number)), AxisVector::Constant(6, number), static_cast<double>(number)};
}
std::uint8_t colour_of(int number) { return static_cast<std::uint8_t>(number % 251); }

bool shows(const Shot& shot, int number) {
  return shot.belt_travel_m == number && shot.joint_position.of[0] == AxisVector::Constant(6, number);
}
bool shows(const RgbdFrame& frame, int number) {
  return std::ranges::all_of(frame.rgb, [&](std::uint8_t value) { return value == colour_of(number); }) &&
         std::ranges::all_of(frame.depth_m, [&](float value) { return value == static_cast<float>(number); });
}

// Frames and the memory of their pixels, as each side sees it. Nobody here looks at the words that wake a sleeper:
// what those order would hide what the places themselves do not.
class Darkroom {
 public:
  using Views = std::array<RgbdFrame, kCameras>;

  Frames frames;
  std::atomic<bool> done{false};       // every shot is developed
  std::atomic<int> died{0};            // how many bridges have
  std::atomic<int> dying{0};           // the last of them that holds nothing, and so many have when it has
  std::atomic<int> followed{0};        // after so many deaths the next has taken over
  std::atomic<int> half_developed{0};  // the shot that waits for that

  Darkroom() : pages_(std::array{kSmall, kSmall, kSmall}), memory_(new std::byte[pages_.bytes()]) {}
  [[nodiscard]] Views views() const {
    Views views;
    for (std::size_t camera = 0; camera < kCameras; ++camera) pages_.lay(views[camera], camera, memory_.get());
    return views;
  }

 private:
  FramePages pages_;
  std::unique_ptr<std::byte[]> memory_;
};

// The body's two threads: one opens each shutter in its turn, whenever its place is free; one develops.
void open_shutters(Frames& frames, rt::SpscRing<int, 4>& exposed) {
  for (int number = 1; number <= kShots; ++number) {
    const std::size_t camera = static_cast<std::size_t>(number) % kCameras;
    while (!frames.is_free(camera)) std::this_thread::yield();
    frames.open(camera, shot_of(number));
    while (!exposed.push(number)) std::this_thread::yield();
  }
}
void develop(Darkroom& room, rt::SpscRing<int, 4>& exposed) {
  Darkroom::Views views = room.views();
  for (int number = 0; number < kShots;) {
    if (!exposed.pop(number)) {
      std::this_thread::yield();
      continue;
    }
    const std::size_t camera = static_cast<std::size_t>(number) % kCameras;
    std::ranges::fill(std::span(views[camera].rgb.data(), views[camera].rgb.size()), colour_of(number));
    if (const int dying = room.dying.load(); dying > room.followed.load()) {
      room.half_developed.store(number);
      while (room.followed.load() < dying) std::this_thread::yield();
    }
    std::ranges::fill(std::span(views[camera].depth_m.data(), views[camera].depth_m.size()),
                      static_cast<float>(number));
    room.frames.hand_over(camera);
  }
  room.done.store(true);
}

// What all bridges together have seen.
struct Seen {
  int last = 0, frames = 0;
  bool sound = true;  // whole, and each younger than the one before it
};

enum class Death : std::uint8_t { kBeforeTheLook, kAtIt, kAfterIt, kWithoutAPlace };

// Goes on from what a dead one left. If that one held nothing, a shot is being developed: it stays the body's.
void take_over(Darkroom& room, Seen& seen, Death predecessor) {
  const bool developing = predecessor == Death::kWithoutAPlace;
  while (developing && room.half_developed.load() <= seen.last) std::this_thread::yield();
  const auto camera = static_cast<std::size_t>(room.half_developed.load()) % kCameras;
  room.frames.take_over();
  seen.sound = seen.sound && !(developing && room.frames.is_free(camera));
  room.followed.store(room.died.load());
}

// One bridge, which is killed at the first frame from `until` on.
void look(Darkroom& room, Seen& seen, int until, Death death) {
  const Darkroom::Views views = room.views();
  for (;;) {
    const bool over = room.done.load();
    const auto camera = room.frames.oldest();
    if (!camera) {
      if (over) return;
      std::this_thread::yield();
      continue;
    }
    const Shot& shot = room.frames.shot(*camera);
    const int number = static_cast<int>(shot.stamp.ns());
    const bool dies = number >= until;
    if (dies && death == Death::kBeforeTheLook) return;
    seen.sound = seen.sound && number > seen.last && shows(shot, number);
    seen.last = number;
    ++seen.frames;
    if (dies && death == Death::kAtIt) return;
    seen.sound = seen.sound && shows(views[*camera], number);
    if (dies && death == Death::kAfterIt) return;
    if (dies) room.dying.store(room.died.load() + 1);
    room.frames.give_back(*camera);
    if (dies) return;
  }
}

TEST(Frames, ArriveWholeAndInOrderWhileBridgesDieAndTheBodyGoesOn) {
  Darkroom room;
  rt::SpscRing<int, 4> exposed;
  std::thread shutters([&] { open_shutters(room.frames, exposed); });
  std::thread developer([&] { develop(room, exposed); });
  Seen seen;
  // Two threads are each other's successors, so that the next bridge is there before the body has come to rest.
  const auto bridges = [&](int first) {
    for (int mine = first; mine <= kKilled; mine += 2) {
      while (room.died.load() != mine) std::this_thread::yield();
      if (mine > 0) take_over(room, seen, static_cast<Death>((mine - 1) % 4));
      const int until = mine < kKilled ? (mine + 1) * (kShots - 30) / kKilled : kShots + 1;
      look(room, seen, until, static_cast<Death>(mine % 4));
      room.died.store(mine + 1);
    }
  };
  std::thread even([&] { bridges(0); }), odd([&] { bridges(1); });
  for (std::thread* thread : {&even, &odd, &shutters, &developer}) thread->join();
  EXPECT_TRUE(seen.sound);
  EXPECT_EQ(seen.last, kShots);
  EXPECT_LE(seen.frames, kShots);
  EXPECT_GE(seen.frames, kShots - kKilled * static_cast<int>(kCameras)) << "a kill costs what was handed over, no more";
  for (std::size_t camera = 0; camera < kCameras; ++camera) EXPECT_TRUE(room.frames.is_free(camera));
}

// Commands of bridges that die one after the other.
struct Succession {
  static constexpr std::uint64_t kBridges = 401, kMost = 1'000'000;

  Link link;
  std::atomic<std::uint64_t> taken_over{0};  // by whom
  std::atomic<std::uint64_t> heard{0};       // of whose taking over the cerebellum knows, and has acted by that once
  std::atomic<bool> sound{true}, done{false};

  // The cerebellum takes in nothing while one of these lives.
  [[nodiscard]] static bool is_held_back(std::uint64_t who) { return who % 4 >= 2; }
  [[nodiscard]] static std::uint64_t number(std::uint64_t who, std::uint64_t which) { return who * kMost + which; }
};

// One bridge sends more than the ring holds; the next two, as much as there is room for, less and more; the fourth
// nothing, until the cerebellum has looked, which must find nothing of theirs.
void send(Succession& all, std::uint64_t who) {
  BridgeEnd end(all.link);
  all.taken_over.store(who);
  while (who % 4 != 1 && all.heard.load() < who) std::this_thread::yield();
  const std::size_t room = end.room();
  const std::array<std::size_t, 4> commands{0, 2 * Link::kCommands, std::min<std::size_t>(room, who % 300), room};
  Command command;
  for (std::uint64_t i = 0; i < commands[who % 4] && all.sound.load(); ++i) {
    command.sequence = Succession::number(who, i);
    command.payload_com_m.fill(static_cast<double>(command.sequence));
    while (!end.send(command) && all.sound.load()) std::this_thread::yield();
  }
  if (who % 4 == 3 && end.send(command)) all.sound.store(false);
}

TEST(Link, NothingOfADeadBridgeIsTakenInOnceAnotherHasTakenOver) {
  const auto all = std::make_unique<Succession>();
  std::thread bridges([&] {
    for (std::uint64_t who = 1; who <= Succession::kBridges; ++who) std::thread([&] { send(*all, who); }).join();
    all->done.store(true);
  });
  CerebellumEnd cerebellum(all->link);
  Command command;
  std::uint64_t last = 0;
  for (;;) {
    const bool over = all->done.load();
    const std::uint64_t since = all->taken_over.load();
    const bool held_back = Succession::is_held_back(since);
    const bool got = !held_back && all->sound.load() && cerebellum.receive(command);
    all->heard.store(since);
    if (!got) {
      if (over) break;
      std::this_thread::yield();
      continue;
    }
    const std::uint64_t number = command.sequence, who = number / Succession::kMost;
    const bool whole = command.payload_com_m[0] == static_cast<double>(number) &&
                       command.payload_com_m[2] == static_cast<double>(number);
    const bool next = number == (who == last / Succession::kMost ? last + 1 : Succession::number(who, 0));
    if (!whole || !next || who < since) all->sound.store(false);
    last = number;
  }
  bridges.join();
  EXPECT_TRUE(all->sound.load());
  EXPECT_EQ(last, Succession::number(Succession::kBridges, 2 * Link::kCommands - 1));
}

// What a process that is killed shares with this one.
struct Named {
  Border border{Identity{}, 1};
  std::atomic<int> names{0};
};

// The bridge is killed again and again wherever it is in naming its journal.
TEST(Border, AJournalsPathIsWholeWhereverItsBridgeIsKilled) {
  constexpr int kKills = 100;
  void* const memory = mmap(nullptr, sizeof(Named), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto* const shared = new (memory) Named;
  const std::array<std::string, 2> paths{"/" + std::string(3000, 'a'), "/" + std::string(4000, 'b')};
  bool whole = true;
  for (int kill_number = 0; kill_number < kKills; ++kill_number) {
    const int before = shared->names.load();
    const pid_t bridge = fork();
    if (bridge == 0) {
      for (std::size_t i = 0;; ++i) {
        (void)shared->border.name_journal(paths[i % 2]);
        ++shared->names;
      }
    }
    ASSERT_GT(bridge, 0);
    while (shared->names.load() < before + 2 + kill_number % 5) std::this_thread::yield();
    kill(bridge, SIGKILL);
    waitpid(bridge, nullptr, 0);
    const std::string journal = shared->border.journal();
    whole = whole && (journal == paths[0] || journal == paths[1]);
  }
  EXPECT_TRUE(whole);
  munmap(memory, sizeof(Named));
}

}  // namespace
}  // namespace pons::link
