#include "pons/referee/referee.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pons/bridge/journal/story.hpp"

namespace pons::referee {
namespace {

using bridge::Json;
using sim::LabelTruth;
using sim::ParcelTruth;
using sim::Whereabouts;
using task::Outcome;

// From when a camera sees one come, to when that lies at rest; and from then on to a picture of it, some of which the
// arm may hide. What lies longer may have been carried off.
constexpr Duration kComes = std::chrono::seconds(3), kIsSeen = std::chrono::seconds(9);
// Until who fell with a load is found to be nowhere on the belt, out of the cameras' view where it should ride off.
constexpr Duration kIsMissed = std::chrono::seconds(30);

// What the journal says of one parcel.
struct Entry {
  int tasks = 0, successes = 0;
  bool ended = false;  // every task of it has an outcome
  bool succeeded = false;
  bool ride = false;                   // let go by on purpose, or never identified
  bool unseen = false;                 // nobody has identified it: all that is said is that it was to come
  bool strayed = false;                // an entry says that it is not where it should be
  bool rode_since = false;             // likewise, what bears its code, since a task of it succeeded
  std::pair<std::int64_t, Time> done;  // the last success: run and when
  std::string last_reason;
  std::string put_into;   // where the last task that succeeded put it
  std::string fell_into;  // the chute that the last outcome, or a later entry, names
  bool astray = false;    // since the last success an entry says that it is not where that put it
};

// The parcels that a task puts somewhere, and where: what a step places or, where that does not say, what was picked
// before. None for a task that looks or moves only.
std::map<std::string, std::string> objects_of(const task::Task& task) {
  std::map<std::string, std::string> objects;
  std::string picked;
  for (const task::Step& step : task.steps) {
    if (step.skill == "pick") picked = step.arguments.value("object", std::string{});
    if (step.skill != "place") continue;
    const std::string placed = step.arguments.value("object", picked);
    if (!placed.empty()) objects[placed] = task::text_of(step.arguments, "place");
  }
  return objects;
}

void take_in(Entry& entry, const std::string& place, const std::optional<bridge::OutcomeRecord>& outcome) {
  entry.ended = outcome.has_value() && (entry.tasks == 0 || entry.ended);
  ++entry.tasks;
  if (!outcome) return;
  if (outcome->outcome == Outcome::kSucceeded) {
    entry.succeeded = true;
    ++entry.successes;
    entry.put_into = place;
    entry.done = {outcome->run, outcome->stamp};
  }
  entry.last_reason = outcome->reason;
  // A later task that does not find it says nothing else of where it lies.
  for (const Json& step : outcome->detail.value("steps", Json::array())) {
    const std::string into = task::text_of(step.value("detail", Json{}), "fell_into");
    if (!into.empty()) entry.fell_into = into;
  }
}

// What a tree puts somewhere its leaves say, not its text: each that has succeeded, whatever the tree comes to.
Expected<void> take_in_tree(std::map<std::string, Entry>& entries, const bridge::Journal& journal,
                            const bridge::TaskRecord& record) {
  const auto history = journal.task(record.task.id);
  if (!history) return std::unexpected(history.error());
  if (!*history) return {};
  std::map<std::int64_t, bridge::Event> trying;  // by the leaf
  std::set<std::string> picked, placed;
  std::string last;
  for (const bridge::Event& event : (*history)->events) {
    const bool begins = event.kind == bridge::kAttemptEvent;
    const bool succeeded =
        event.kind == bridge::kFoundDoneEvent ||
        (event.kind == bridge::kAttemptEndedEvent && task::text_of(event.detail, "status") == "succeeded");
    if (!begins && !succeeded) continue;
    const std::int64_t leaf = event.detail.value("step", std::int64_t{-1});
    if (begins) trying.insert_or_assign(leaf, event);
    const auto begun = trying.find(leaf);
    if (!succeeded || begun == trying.end()) continue;
    const std::string skill = task::text_of(begun->second.detail, "skill");
    const Json arguments = begun->second.detail.value("arguments", Json::object());
    const std::string object = task::text_of(arguments, "object");
    if (skill == "pick") picked.insert(last = object);
    if (skill != "place") continue;
    const auto& put = *placed.insert(object.empty() ? last : object).first;
    take_in(entries[put], task::text_of(arguments, "place"),
            bridge::OutcomeRecord{.outcome = Outcome::kSucceeded, .run = event.run, .stamp = event.stamp});
  }
  const bool failed = record.outcome && record.outcome->outcome != Outcome::kSucceeded;
  for (const std::string& object : picked) {
    if (failed && !placed.contains(object)) take_in(entries[object], {}, record.outcome);
  }
  return {};
}

void stray(Entry& entry, const std::string& place, const std::pair<std::int64_t, Time>& when) {
  entry.fell_into = place;
  entry.strayed = true;
  entry.astray = entry.succeeded && when > entry.done;
}

// A camera saw so many more things in a place than before.
struct Sight {
  Time when;
  int more;
};

// One without a code went with a load into that place, or beside it; empty: nobody knows where.
struct Uncounted {
  std::string place;
  Time told;
};

// What it says of all of them.
struct Story {
  std::map<std::string, Entry> entries;                   // by code
  std::map<std::string, int> unread = {};                 // by the place into which nobody knows whose parcels went
  std::vector<Uncounted> uncounted = {};                  // of which no light curtain tells
  std::map<std::string, std::vector<Sight>> sights = {};  // by the place
};

Expected<Story> read(const bridge::Journal& journal) {
  Story story;
  auto& entries = story.entries;
  const auto tasks = journal.each_task([&](const bridge::TaskRecord& record) -> Expected<void> {
    for (const auto& [object, place] : objects_of(record.task)) take_in(entries[object], place, record.outcome);
    return record.task.tree ? take_in_tree(entries, journal, record) : Expected<void>{};
  });
  if (!tasks) return std::unexpected(tasks.error());
  const auto notes = journal.each_note([&](const bridge::Event& event) -> Expected<void> {
    const std::string code = task::text_of(event.detail, "code");
    if (event.kind == "stray") {
      const std::string place = task::text_of(event.detail, "fell_into");
      if (code.empty() && !place.empty() && event.detail.value("counted", true))
        ++story.unread[place];
      else if (code.empty())
        story.uncounted.push_back({place, event.stamp});
      else
        stray(entries[code], place, {event.run, event.stamp});
    }
    if (event.kind == "fell")
      story.sights[task::text_of(event.detail, "place")].push_back(
          {event.stamp, event.detail.value("things", 0) - event.detail.value("before", 0)});
    if (event.kind != "ride") return {};
    Entry& entry = entries[code];
    entry.ride = true;
    entry.unseen = !event.detail.value("seen", true);
    entry.rode_since = entry.succeeded && std::pair(event.run, event.stamp) > entry.done;
    if (entry.tasks == 0) entry.last_reason = task::text_of(event.detail, "reason");
    return {};
  });
  if (!notes) return std::unexpected(notes.error());
  return story;
}

class Judge {
 public:
  Judge(Verdict& verdict, Story story, RunEnd end) : verdict_(verdict), story_(std::move(story)), end_(end) {}

  void parcel(const ParcelTruth& parcel) {
    const Entry entry = entry_of(parcel);
    if (entry.successes > 1) ++verdict_.duplicated;
    switch (parcel.where) {
      case Whereabouts::kNotOffered:
        return;
      case Whereabouts::kChute:
        return in_chute(parcel, entry);
      case Whereabouts::kException:
        return in_exception(parcel, entry);
      case Whereabouts::kTray:
      case Whereabouts::kFloor:
        return below(parcel, entry);
      case Whereabouts::kBelt:
      case Whereabouts::kHeld:
      case Whereabouts::kFalling:
        if (end_ == RunEnd::kBrokenOff && !entry.succeeded) {
          ++verdict_.unfinished;
        } else {
          lost(parcel, entry, "never arrived anywhere");
        }
        return;
    }
  }

  // After the last parcel. That one was never identified says nothing of where it lies: of those below, as many are
  // accounted for as something without a code was told to have fallen there, or nobody knows where, or as a camera has
  // seen come there then, beside those that have an entry of their own.
  void below_unread() {
    for (const ParcelTruth* const parcel : with_entry_) (void)was_seen(*parcel);
    for (const auto& [parcel, entry] : unread_) {
      if (was_seen(*parcel) || was_told(parcel->place) || may_have_fallen_beside(*parcel)) {
        astray(*parcel, entry, "fell, as the journal says of one that nobody has read");
      } else {
        lost(*parcel, entry, "fell, and was never identified");
      }
    }
  }

 private:
  // What bears a code that nobody knows is told of by that one. What bears another's too may have been told of as that
  // other, by an entry that names the place where it lies: what else is said of the other is not said of it.
  [[nodiscard]] Entry entry_of(const ParcelTruth& parcel) const {
    const auto own = story_.entries.find(parcel.parcel_id), shown = story_.entries.find(parcel.shows);
    Entry entry = own == story_.entries.end() ? Entry{} : own->second;
    const bool told = own != story_.entries.end() && !entry.unseen;
    if (told || shown == story_.entries.end()) return entry;
    if (parcel.label == LabelTruth::kUnknownCode) return shown->second;
    if (shown->second.fell_into == parcel.place) entry.fell_into = parcel.place;
    return entry;
  }

  struct Unread {
    const ParcelTruth* parcel;
    Entry entry;
  };

  // Each that a camera has seen come is one.
  bool was_seen(const ParcelTruth& parcel) {
    for (Sight& sight : story_.sights[parcel.place]) {
      if (sight.more == 0 || sight.when + kComes < parcel.arrived || sight.when > parcel.arrived + kIsSeen) continue;
      --sight.more;
      return true;
    }
    return false;
  }

  // Each told of is one.
  bool was_told(const std::string& place) {
    int& unread = story_.unread[place];
    if (unread > 0) return unread-- > 0;
    return take(std::ranges::find(story_.uncounted, place, &Uncounted::place));
  }

  // Of what went into a place or beside it, what is not in the place, for all that are have been judged. It has to be
  // of this moment, or one that lies elsewhere would account for any.
  bool may_have_fallen_beside(const ParcelTruth& parcel) {
    return take(std::ranges::find_if(story_.uncounted, [&](const Uncounted& one) {
      return one.told + kComes >= parcel.arrived && one.told <= parcel.arrived + kIsMissed;
    }));
  }

  bool take(std::vector<Uncounted>::iterator one) {
    if (one == story_.uncounted.end()) return false;
    story_.uncounted.erase(one);
    return true;
  }

  // Nobody says that it is sorted: whoever looks for it knows that, and finds what fell into that chute and is
  // nobody's.
  [[nodiscard]] static bool is_given_up(const Entry& entry) {
    return entry.tasks == 0 || (entry.ended && !entry.succeeded);
  }

  void in_chute(const ParcelTruth& parcel, const Entry& entry) {
    const bool named = (!entry.succeeded || entry.astray) && parcel.place == entry.fell_into;
    const bool own = parcel.place == parcel.destination;
    if (own && (entry.succeeded || named)) {
      ++verdict_.sorted;  // put there, or fallen: it lies where it was to go, and the journal says so
    } else if (named) {
      astray(parcel, entry, "fell into another chute, which the journal names");
    } else if (is_given_up(entry) && was_told(parcel.place)) {
      astray(parcel, entry, "fell into another chute, of which the journal says that an unread one did");
    } else if (!own) {
      ++verdict_.missorted;
      find(parcel, entry, "missorted", kFirst);
    } else {
      lost(parcel, entry, "in its chute, but the journal does not say so");
    }
  }

  void in_exception(const ParcelTruth& parcel, const Entry& entry) {
    // Some brain wanted it there.
    const bool put_there = entry.succeeded && entry.put_into == parcel.place;
    // Another that bore its code was sorted; what rode by later is named, too.
    if (entry.succeeded && !put_there && !entry.rode_since && !entry.astray)
      return lost(parcel, entry, "in the exception chute, but the journal says sorted");
    if (!entry.ride && !entry.ended) return lost(parcel, entry, "in the exception chute without an entry");
    if (parcel.label != LabelTruth::kReadable || parcel.overweight || parcel.oversize) {
      ++verdict_.deserved;
      ++verdict_.reasons[kind_of(entry.last_reason)].deserved;
      verdict_.excepted.push_back(line_of(parcel, entry, "deserved exception"));
    } else {
      undeserved(entry);
      find(parcel, entry, "undeserved exception");
    }
  }

  void below(const ParcelTruth& parcel, const Entry& entry) {
    const bool own = entry.succeeded ? entry.astray : (entry.ride && !entry.unseen) || entry.ended || entry.strayed;
    if (own) {
      with_entry_.push_back(&parcel);
      astray(parcel, entry, "fell, with an entry");
    } else if (entry.unseen) {
      unread_.push_back({&parcel, entry});
    } else {
      lost(parcel, entry, "fell without an entry");
    }
  }

  void astray(const ParcelTruth& parcel, const Entry& entry, std::string_view how) {
    ++verdict_.astray;
    undeserved(entry);
    find(parcel, entry, how);
  }

  void undeserved(const Entry& entry) {
    ++verdict_.undeserved;
    ++verdict_.reasons[kind_of(entry.last_reason)].undeserved;
  }

  void lost(const ParcelTruth& parcel, const Entry& entry, std::string_view why) {
    ++verdict_.lost;
    find(parcel, entry, fmt::format("lost: {}", why), kFirst);
  }

  // What should not be at all comes before the rest: readers may be shown no more than the first ones.
  enum Order : std::uint8_t { kFirst, kLast };
  void find(const ParcelTruth& parcel, const Entry& entry, std::string_view what, Order order = kLast) {
    const auto where = order == kFirst ? verdict_.findings.begin() + first_++ : verdict_.findings.end();
    verdict_.findings.insert(where, line_of(parcel, entry, what));
  }
  static std::string line_of(const ParcelTruth& parcel, const Entry& entry, std::string_view what) {
    return fmt::format(
        "{}: {}; ordered {}, really {}, {:.2f} kg, {:.2f} x {:.2f} x {:.2f} m, label {}{}, picks {}, drops {}; "
        "journal: {}",
        parcel.parcel_id, what, parcel.destination, parcel.place, parcel.mass_kg, parcel.size_m.x(), parcel.size_m.y(),
        parcel.size_m.z(), sim::name(parcel.label), parcel.touching ? ", touching" : "", parcel.picks, parcel.drops,
        entry.succeeded ? "sorted" : (entry.last_reason.empty() ? "nothing" : entry.last_reason));
  }

  Verdict& verdict_;
  Story story_;
  RunEnd end_;
  std::ptrdiff_t first_ = 0;                    // of the findings
  std::vector<Unread> unread_;                  // below
  std::vector<const ParcelTruth*> with_entry_;  // likewise
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string line(const sim::Breach& breach, std::size_t arm) {
  return fmt::format("arm {}: joint {} at {:.1f} % of its {} limit, from {:.3f} to {:.3f} s", arm + 1, breach.axis + 1,
                     100 * breach.worst_ratio, breach.of == sim::Breach::Of::kSpeed ? "speed" : "torque",
                     breach.from.s(), breach.to.s());
}

}  // namespace

std::string kind_of(std::string_view reason) {
  reason = reason.substr(0, reason.find_first_of(";:"));
  std::string kind;
  for (std::size_t i = 0; i < reason.size(); ++i) {
    const bool within = i > 0 && i + 1 < reason.size() && is_digit(reason[i - 1]) && is_digit(reason[i + 1]);
    if (!is_digit(reason[i]) && !(reason[i] == '.' && within)) {
      kind += reason[i];
    } else if (kind.empty() || kind.back() != '#') {
      kind += '#';
    }
  }
  return kind.empty() ? "no reason given" : kind;
}

Expected<Verdict> judge(const std::vector<ParcelTruth>& parcels, const std::vector<sim::ArmTruth>& arms,
                        const bridge::Journal& journal, const Rules& rules, RunEnd end) {
  auto story = read(journal);
  if (!story) return std::unexpected(story.error());
  Verdict verdict;
  verdict.sorted_by.resize(arms.size());
  Judge judge(verdict, *std::move(story), end);
  for (const ParcelTruth& parcel : parcels) {
    if (parcel.where == Whereabouts::kNotOffered) continue;
    ++verdict.offered;
    const int sorted = verdict.sorted;
    judge.parcel(parcel);
    if (parcel.arm >= 0) verdict.sorted_by[static_cast<std::size_t>(parcel.arm)] += verdict.sorted - sorted;
    if (parcel.max_press_n > rules.max_press_n || parcel.max_drop_m > rules.max_drop_m) {
      ++verdict.damaged;
      verdict.findings.push_back(fmt::format("{}: damaged: pressed {:.0f} N, dropped {:.2f} m", parcel.parcel_id,
                                             parcel.max_press_n, parcel.max_drop_m));
    }
  }
  judge.below_unread();
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const sim::ArmTruth& arm = arms[i];
    for (const sim::Breach& breach : arm.breaches) verdict.findings.push_back(line(breach, i));
    verdict.violations += arm.speed_violations + arm.torque_violations;
    verdict.worst_ratio = std::max({verdict.worst_ratio, arm.worst_speed_ratio, arm.worst_torque_ratio});
  }
  return verdict;
}

}  // namespace pons::referee
