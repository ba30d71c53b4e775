// Those who ask: warehouse systems that want tasks done and never know whether they were heard, people who change their
// minds about them, somebody hostile, and the person beside the machine who leads it out of its stops. All speak the
// local socket's language.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "tests/system/network.hpp"
#include "tests/system/plant.hpp"
#include "tests/system/referee.hpp"

namespace pons::tests {

struct Asking {
  Duration every = std::chrono::seconds(5);  // a wish, on average
  double minds_change = 0.25;                // share of wishes that somebody meddles with
  double hostile = 0.1;                      // hostile words a wish
};

class Senders {
 public:
  using Say = std::function<void(const std::string&)>;
  // All must outlive it. `wrong` is told of an answer that nobody may get.
  Senders(Network& network, Plant& plant, Referee& referee, Random random, Say say, Say wrong);

  void step(Time now);
  void hear(const Answer& answer, Time now);
  // Nothing new is wished for; what was paused is resumed, what is asked for allowed.
  void calm_down() { calm_ = true; }
  // Every wish was accepted and has ended, as far as its sender knows.
  [[nodiscard]] bool content() const;
  [[nodiscard]] std::string waits_for() const;  // one that has not, for a person to read
  [[nodiscard]] std::size_t wishes() const { return wishes_.size(); }

  Asking asking;
  std::function<std::vector<std::string>()> at_work;  // tasks, by their ids, as whoever looks on sees them

 private:
  struct Wish {
    Json task;
    std::string together;  // the whole reply that it is part of; empty: it is sent by itself
    bool accepted = false, ended = false, hopeless = false;
    Time ask_at;
    int asked = 0;
  };
  enum class About : std::uint8_t { kSubmit, kFate, kEnd, kOther, kHostile };
  struct Asked {
    About about;
    std::string id;
  };

  void wish(Time now);
  [[nodiscard]] Json task_of(const std::string& id, Time now);
  [[nodiscard]] Json parcel_task(const std::string& id);
  [[nodiscard]] Json print_task(const std::string& id);
  [[nodiscard]] Json tree_task(const std::string& id);
  [[nodiscard]] bool is_far(const std::string& id) const;
  void pursue(const std::string& id, Wish& wish, Time now);
  void meddle(Time now);
  void be_hostile(Time now);
  void ask(About about, const std::string& id, const Json& json, Time now);
  void hear_submit(const std::string& id, const Json& answer);
  void hear_fate(const std::string& id, const Json& answer);

  Network& network_;
  Plant& plant_;
  Referee& referee_;
  Random random_;
  Say say_, wrong_;
  using Wishes = std::map<std::string, Wish>;
  Wishes wishes_;
  std::vector<std::string> ids_;
  std::vector<Wishes::value_type*> pursued_;  // of those, the ones that are not over
  std::set<std::string> paused_;              // tasks that somebody has told to pause, other people's too
  std::map<std::int64_t, Asked> asked_;
  std::int64_t questions_ = 0;
  Time next_wish_, next_meddling_, next_hostility_;
  bool calm_ = false;
  bool long_tree_ = false;
};

// Leads the arm out of what needs a person, a step at a time; and now and then stops it.
class Person {
 public:
  Person(Network& network, Random random) : network_(network), random_(random) {}
  void step(Time now);
  // Whether that is the answer to a stop: the arm may not go on without this person.
  [[nodiscard]] bool hear(const Answer& answer);
  void calm_down() { calm_ = true; }
  [[nodiscard]] static std::string words_for(std::string_view operation);

 private:
  Network& network_;
  Random random_;
  std::string needs_;
  Time acts_at_;
  std::int64_t questions_ = 0;
  std::int64_t stop_ = 0;  // the question that was one, the last time
  bool calm_ = false;
};

// Questions of the person have numbers below this; those of senders begin here.
inline constexpr std::int64_t kSendersBegin = std::int64_t{1} << 40;

}  // namespace pons::tests
