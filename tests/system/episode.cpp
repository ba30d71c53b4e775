#include "tests/system/episode.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>
#include <utility>

namespace pons::tests {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(10);
constexpr Duration kCalmWithin = std::chrono::minutes(20);   // all must have ended by then,
constexpr Duration kQuietAtLast = std::chrono::seconds(40);  // and what lies on the belt has ridden off after that
constexpr Step kMotionSent{Doing::kTicking, Act::kMotion, Moment::kAfter};
constexpr std::uint64_t kAims = 3;        // moments that deaths are aimed at, of which a bridge dies soon after one
constexpr std::uint64_t kDecisions = 12;  // bridges, one that is held up with one
constexpr std::uint64_t kPieces = 8;      // about as many as a motion has
constexpr std::uint64_t kCellsThatGoDark = 6;  // one of so many
constexpr std::size_t kRoomInLink = 256;       // commands, at least, after every period
constexpr double kLostAstrayPerS = 2;          // where deaths are aimed at what leaves the cups

// The kind of moment that deaths are aimed at in one episode: what was told, written or seen just before its end is
// what the next bridge has most easily wrong.
enum class Aim : std::uint8_t {
  kAtWords,    // somebody was answered who has told a task to pause, cancel or halt
  kAtGrasps,   // the bridge has written what hangs on the cups, or that nothing does
  kAtLeaving,  // the cups have let go of a load or lost it, over other chutes than its own more often then
};
constexpr std::array<std::string_view, 3> kAimNames{"words", "grasps", "what leaves the cups"};

// The link as two processes share it: what one of them has not written when it dies, the other never reads. So what a
// process seems to send after its end is taken back.
class SharedLink {
 public:
  SharedLink() : link_(new(memory_.get()) link::Link), kept_(new std::byte[sizeof(link::Link)]) {}
  ~SharedLink() { link_->~Link(); }
  SharedLink(const SharedLink&) = delete;
  SharedLink& operator=(const SharedLink&) = delete;
  [[nodiscard]] link::Link& link() { return *link_; }
  void keep() { std::memcpy(kept_.get(), memory_.get(), sizeof(link::Link)); }
  void take_back() { std::memcpy(memory_.get(), kept_.get(), sizeof(link::Link)); }
  // Of what the loop has not taken in yet, the last ones were never sent.
  void shorten(std::size_t by) {
    link::CerebellumEnd loop(*link_);
    std::vector<link::Command> sent;
    for (link::Command command; loop.receive(command);) sent.push_back(command);
    link::BridgeEnd bridge(*link_);
    sent.resize(sent.size() - std::min(by, sent.size()));
    for (const link::Command& command : sent) (void)bridge.send(command);
  }

 private:
  struct Free {
    void operator()(std::byte* memory) const { ::operator delete[](memory, std::align_val_t{alignof(link::Link)}); }
  };
  std::unique_ptr<std::byte[], Free> memory_{
      static_cast<std::byte*>(::operator new[](sizeof(link::Link), std::align_val_t{alignof(link::Link)}))};
  link::Link* link_;
  std::unique_ptr<std::byte[]> kept_;
};

// A tenth of the loop's pace, and nothing to collide with.
cerebellum::Settings loop_settings() {
  cerebellum::Settings settings;
  settings.period = kPeriod;
  settings.silence_timeout = settings.stall_timeout = settings.following_time = 6 * kPeriod;
  settings.collision.force_n = settings.collision.torque_share = 1e9;
  return settings;
}

brain::Orders orders() {
  brain::Orders orders;
  for (int i = 0; i < 400; ++i)
    orders[fmt::format("D{:03}", i)] = {fmt::format("chute_{}", 1 + i % 4), i % 9 == 0 ? 90 : 50};
  return orders;
}

class Episode {
 public:
  Episode(const Cellar& cellar, const EpisodeOptions& options);
  EpisodeResult run();

 private:
  void say(const std::string& line) { trace_.add(now_, line); }
  void wrong(const std::string& what);
  void period();
  void pass(Duration duration);
  void parcels();
  void buttons();
  void tell_answers();
  void bridge();
  void begin_bridge();
  void tick_bridge(Process& process);
  void end_bridge();
  void gone(Fate fate);
  void compact();
  [[nodiscard]] Plan draw_plan();
  void take_aim();
  void comes_by(Aim moment);
  void calm();
  void go_dark();
  void close();

  const Cellar& cellar_;
  const EpisodeOptions options_;
  Random random_;
  std::optional<Aim> aim_;
  world::World world_;
  Time now_;
  Trace trace_;
  std::vector<std::string> wrong_;
  brain::Orders orders_ = orders();
  SharedLink shared_;
  link::CerebellumEnd loop_end_;
  cerebellum::Cerebellum loop_;
  body::SetPoints told_;
  Plant plant_;
  Disk disk_;
  Network network_;
  Steps steps_;
  Referee referee_;
  Senders senders_;
  Person person_;
  Outside outside_;
  std::unique_ptr<Process> process_;
  std::string carries_;  // as the bridge had it after its last whole tick
  std::optional<Time> gone_since_ = Time{};
  Time begins_at_, ends_at_, asked_to_end_, button_at_;
  std::optional<Time> released_at_, idle_since_;
  Time next_parcel_;
  std::size_t next_order_ = 0, processes_ = 0, stops_ = 0;
  bool ending_ = false, calm_ = false;
};

Episode::Episode(const Cellar& cellar, const EpisodeOptions& options)
    : cellar_(cellar),
      options_(options),
      random_(options.seed),
      world_(cellar.world),
      trace_(options.told),
      loop_end_(shared_.link()),
      loop_(cellar.model.copy(), loop_settings(), Time{}),
      plant_(world_, cellar.model.copy(), random_.fork(1), [this](const std::string& line) { say(line); }),
      disk_(random_.fork(2).next(), options.syncs),
      network_(random_.fork(3)),
      steps_([this](Duration duration) { pass(duration); }, [this](Fate fate) { gone(fate); }),
      referee_([this](const std::string& what) { wrong(what); }),
      senders_(
          network_, plant_, referee_, random_.fork(4), [this](const std::string& line) { say(line); },
          [this](const std::string& what) { wrong(what); }),
      person_(network_, random_.fork(5)),
      outside_{world_, cellar.model, plant_, shared_.link(), disk_, steps_, network_, orders_, now_} {
  if (random_.below(3) == 0) world_.schedule.on_emergency_stop = world::OnEmergencyStop::kCancel;
  disk_.watch([this](Disk::Operation operation, Disk::Moment moment, const std::string& file) {
    const bool log = file.ends_with("-wal");
    Act act = log ? Act::kWriteLog : Act::kWriteFile;
    if (operation == Disk::Operation::kSync) act = log ? Act::kSyncLog : Act::kSyncFile;
    if (operation == Disk::Operation::kCut || operation == Disk::Operation::kRemove)
      act = log ? Act::kCutLog : Act::kCutFile;
    return steps_.at(act, moment == Disk::Moment::kBefore ? Moment::kBefore : Moment::kAfter);
  });
  network_.when_heard = [this](const Question& question) {
    if (question.text == person_.words_for("reset")) referee_.person_resets(now_);
    if (question.text == person_.words_for("arm")) referee_.person_arms(now_);
  };
  network_.when_answered = [this](const Question& question, const Json& answer) {
    const auto says = [&](std::string_view word) { return question.text.find(word) != std::string::npos; };
    if (question.way == Way::kNetwork && answer.value("ok", false) &&
        (says("\"cancel\"") || says("\"halt\"") || says("\"pause\"")))
      comes_by(Aim::kAtWords);
  };
  senders_.at_work = [this] { return process_ ? process_->bridge().running() : std::vector<std::string>{}; };
  plant_.when_left = [this] { comes_by(Aim::kAtLeaving); };
  if (!options_.only) take_aim();
  button_at_ = now_ + from_s(60 * random_.uniform());
}

void Episode::wrong(const std::string& what) {
  say("WRONG: " + what);
  wrong_.push_back(what);
}

// ---- the world ----

void Episode::period() {
  now_ += kPeriod;
  plant_.step(now_, loop_.state(), told_);
  const link::SafetyState before = loop_.state().safety;
  loop_.step(now_, plant_.sensors(), loop_end_, told_);
  if (loop_.state().safety != before)
    say(fmt::format("the arm is {} ({}), epoch {}", link::name(loop_.state().safety), link::name(loop_.state().cause),
                    loop_.state().epoch));
  referee_.watch({now_, loop_.state(), plant_, gone_since_});
  if (!calm_) buttons();
  parcels();
  person_.step(now_);
  senders_.step(now_);
  const bool listens = process_ && steps_.alive();
  network_.advance(now_, listens ? Network::Listens::kSomebody : Network::Listens::kNobody);
  tell_answers();
}

void Episode::tell_answers() {
  for (const Answer& answer : network_.take_answers(now_)) {
    if (answer.question >= kSendersBegin) {
      senders_.hear(answer, now_);
    } else if (person_.hear(answer)) {
      referee_.person_has_stopped(now_);
    }
  }
}

// The bridge's process is held up.
void Episode::pass(Duration duration) {
  say(fmt::format("the bridge is held up for {:.2f} s", to_s(duration)));
  if (!calm_ && !released_at_ && random_.below(2) == 0) button_at_ = now_;
  for (const Time until = now_ + duration; now_ < until;) period();
}

// Those of the bridge's own orders.
void Episode::parcels() {
  if (calm_ || now_ < next_parcel_ || next_order_ >= orders_.size()) return;
  const auto& [code, order] = *std::next(orders_.begin(), static_cast<std::ptrdiff_t>(next_order_++));
  say(fmt::format("{} comes, ordered to {}", code, order.destination));
  plant_.put_on_belt(code, order.destination);
  next_parcel_ = now_ + from_s(5 + 20 * random_.uniform());
}

void Episode::buttons() {
  if (now_ >= button_at_) {
    say("somebody presses the emergency button");
    ++stops_;
    shared_.link().raise_emergency_stop();
    released_at_ = now_ + from_s(random_.below(2) == 0 ? 0.1 : 4 * random_.uniform());
    button_at_ = now_ + from_s(20 + 200 * random_.uniform());
  }
  if (!released_at_ || now_ < *released_at_) return;
  shared_.link().clear_emergency_stop();
  released_at_.reset();
}

// ---- the bridge ----

Plan Episode::draw_plan() {
  if (options_.before && steps_.ends().empty()) return *options_.before;
  if (options_.only) {
    const std::size_t gone = options_.before ? 1 : 0;
    return steps_.ends().size() == gone && !steps_.was_held_up() ? *options_.only : Plan{};
  }
  Plan plan;
  const double fate = random_.uniform();
  plan.fate = fate < 0.45 ? Fate::kDies : fate < 0.75 ? Fate::kLosesPower : Fate::kIsHeldUp;
  plan.held_up = from_s(0.05 * std::pow(200, random_.uniform()));
  // What a bridge has decided on before it was held up, the arm must not take for the present.
  if (random_.below(kDecisions) == 0)
    return {.fate = Fate::kIsHeldUp,
            .at = Step{Doing::kLooking, Act::kLeadOut, Moment::kBefore},
            .count = static_cast<std::int64_t>(1 + random_.below(2)),
            .held_up = from_s(1 + 4 * random_.uniform())};
  if (random_.below(5) < 3) {
    plan.at = all_steps()[random_.below(all_steps().size())];
    plan.count = static_cast<std::int64_t>(std::pow(30, random_.uniform()));
  } else {
    plan.count = static_cast<std::int64_t>(std::pow(20'000, random_.uniform()));
  }
  return plan;
}

void Episode::take_aim() {
  const std::uint64_t drawn = random_.below(kAimNames.size());
  aim_ = static_cast<Aim>(drawn);
  if (aim_ == Aim::kAtLeaving) plant_.faults.lost_astray_per_s = kLostAstrayPerS;
  say(fmt::format("deaths are aimed at {}", kAimNames.at(drawn)));
}

// A moment that deaths are aimed at, or may be: after one of so many the bridge ends soon, and mostly at once.
void Episode::comes_by(Aim moment) {
  if (moment != aim_ || calm_ || !process_ || !steps_.alive() || random_.below(kAims) != 0) return;
  steps_.begin({.fate = random_.below(3) == 0 ? Fate::kLosesPower : Fate::kDies,
                .at = {},
                .count = static_cast<std::int64_t>(std::pow(80, random_.uniform()))});
}

void Episode::bridge() {
  if (!process_) {
    if (now_ >= begins_at_) begin_bridge();
    return;
  }
  if (!calm_ && now_ >= ends_at_) {
    ends_at_ = now_ + from_s(60);
    if (options_.only || random_.below(3) == 0) {
      say("the bridge is asked to end");
      ending_ = true;
      process_->stop();
    } else {
      steps_.begin({.fate = random_.below(3) == 0 ? Fate::kLosesPower : Fate::kDies,
                    .count = static_cast<std::int64_t>(1 + random_.below(100))});
    }
  }
  tick_bridge(*process_);
}

void Episode::begin_bridge() {
  ++processes_;
  ends_at_ = now_ + from_s(options_.only ? 40 : 5 + 120 * random_.uniform() * random_.uniform());
  steps_.begin(calm_ ? Plan{} : draw_plan());
  ending_ = false;
  idle_since_.reset();
  say(fmt::format("bridge {} begins", processes_));
  auto started = Process::start(outside_);
  if (started) process_ = std::move(*started);
  if (!started && steps_.alive()) wrong("a bridge does not begin: " + started.error().line());
  if (!steps_.alive() || !started) return end_bridge();
  gone_since_.reset();
  referee_.look(process_->journal());
  referee_.takes_up(carries_, process_->carries(), plant_);
}

void Episode::tick_bridge(Process& process) {
  const auto good = process.tick();
  if (!steps_.alive()) return end_bridge();
  if (!good) {
    wrong("a fault without a cause: " + good.error().line());
    return end_bridge();
  }
  if (std::string carries = process.carries(); carries != carries_) {
    carries_ = std::move(carries);
    comes_by(Aim::kAtGrasps);
  }
  if (process.room() < kRoomInLink) wrong("the link is filling up");
  if (process.bridge().open_count() > bridge::kMaxUrgent) wrong("more tasks are open than may be");
  if (!ending_) return;
  if (!process.idle()) idle_since_.reset();
  if (process.idle() && !idle_since_) idle_since_ = now_;
  if (idle_since_ && now_ > *idle_since_ + std::chrono::seconds(2)) end_bridge();
}

// In order, or what is left after its end.
void Episode::end_bridge() {
  const bool in_order = steps_.alive() && process_;
  process_.reset();  // may die of it yet
  if (!gone_since_) gone_since_ = now_;
  if (const auto fate = steps_.gone_with()) {
    shared_.take_back();
    // It died amid the pieces of a motion.
    if (steps_.last_end() == kMotionSent) shared_.shorten(random_.below(kPieces));
    if (*fate == Fate::kLosesPower) {
      disk_.restart();
    } else {
      disk_.next_user();
    }
  } else if (in_order) {
    say("the bridge has ended in order");
  }
  // The next one may be there before the loop misses this one.
  const bool at_once = options_.only || random_.below(4) == 0;
  begins_at_ = now_ + from_s(at_once ? 0.02 : 8 * random_.uniform() * random_.uniform());
  if (!calm_ && (options_.only || random_.below(6) == 0)) compact();
}

void Episode::gone(Fate fate) {
  say(fate == Fate::kLosesPower ? "the bridge's computer loses its power" : "the bridge dies");
  shared_.keep();
  disk_.user_dies();
}

// `pons journal compact`, between two bridges.
void Episode::compact() {
  steps_.begin(draw_plan());
  steps_.doing(Doing::kOpening);
  if (auto journal = bridge::Journal::open(kJournal, disk_.vfs())) {
    if (steps_.alive()) referee_.look(**journal);
    steps_.doing(Doing::kCompacting);
    const auto dropped = (*journal)->compact(static_cast<std::int64_t>(random_.below(20)));
    if (dropped) say(fmt::format("{} events are compacted away", *dropped));
    if (!dropped && steps_.alive()) wrong("the journal is not compacted: " + dropped.error().line());
    steps_.doing(Doing::kClosing);
  } else if (steps_.alive()) {
    wrong("the journal does not open: " + journal.error().line());
  }
  if (const auto fate = steps_.gone_with()) *fate == Fate::kLosesPower ? disk_.restart() : disk_.next_user();
}

// ---- an episode ----

EpisodeResult Episode::run() {
  while (now_ < Time(options_.faults_for) && wrong_.empty()) {
    period();
    bridge();
  }
  if (wrong_.empty() && !options_.only && random_.below(kCellsThatGoDark) == 0) {
    go_dark();
  } else if (wrong_.empty()) {
    calm();
    if (wrong_.empty()) close();
  }
  process_.reset();
  EpisodeResult result{.wrong = wrong_,
                       .last = trace_.last(),
                       .digest = trace_.digest(),
                       .lasted = now_,
                       .wishes = senders_.wishes(),
                       .accepted = referee_.heard(),
                       .processes = processes_,
                       .stops = stops_,
                       .network = network_.losses(),
                       .disk = disk_.losses(),
                       .outcomes = {},
                       .ends = steps_.ends(),
                       .passed = steps_.passed()};
  for (const auto& [id, outcome] : referee_.outcomes()) ++result.outcomes[outcome];
  return result;
}

// Nothing goes wrong any more, and people do what they are asked.
void Episode::calm() {
  say("calm");
  calm_ = true;
  if (steps_.alive()) steps_.begin({});
  network_.faults = {0, 0, 0};
  person_.calm_down();
  plant_.faults = {0, 0, 0};
  shared_.link().clear_emergency_stop();
  senders_.calm_down();
  std::optional<Time> quiet_since;
  for (const Time until = now_ + kCalmWithin; wrong_.empty();) {
    period();
    bridge();
    const bool quiet = process_ && !ending_ && process_->idle() && senders_.content();
    if (!quiet) quiet_since.reset();
    if (quiet && !quiet_since) quiet_since = now_;
    if (quiet_since && now_ > *quiet_since + kQuietAtLast) return;
    if (now_ > until) return wrong(fmt::format("it does not come to an end: {} waits", senders_.waits_for()));
  }
}

// The power of the whole cell: its body is gone, and nobody takes up what was open there. What anybody was told is in
// the journal all the same.
void Episode::go_dark() {
  steps_.kill(Fate::kLosesPower);
  process_.reset();
  disk_.restart();
  steps_.begin({});
  const auto journal = bridge::Journal::open(kJournal, disk_.vfs());
  if (!journal) return wrong("the journal does not open: " + journal.error().line());
  referee_.look(**journal);
}

void Episode::close() {
  process_.reset();
  gone_since_ = now_;
  if (!referee_.all_heard()) wrong("not every outcome was heard");
  const auto journal = bridge::Journal::open(kJournal, disk_.vfs());
  if (!journal) return wrong("the journal does not open: " + journal.error().line());
  referee_.close(**journal, plant_);
}

}  // namespace

void Trace::add(Time now, const std::string& line) {
  std::string stamped = fmt::format("{:9.2f} s  {}", now.s(), line);
  digest_.add(stamped);
  if (told_ == Told::kAtOnce) fmt::print("{}\n", stamped);
  last_.push_back(std::move(stamped));
  if (last_.size() > kLast) last_.pop_front();
}

Expected<Cellar> Cellar::load() {
  auto world = world::load("worlds", "parcel_cell");
  if (!world) return std::unexpected(world.error());
  world->cameras.clear();
  world->zones.clear();
  world->resources = {{"arm"}, {"printer"}};
  world->review = {.tiers = {"operator"},
                   .rules = {{.name = "many",
                              .skills = {"print"},
                              .when = {"number >= 900"},
                              .approve = "operator",
                              .within = std::chrono::seconds(90)}}};
  auto model = model::RobotModel::load(world->robot);
  if (!model) return std::unexpected(model.error());
  return Cellar{*std::move(world), *std::move(model)};
}

EpisodeResult run_episode(const Cellar& cellar, const EpisodeOptions& options) {
  return Episode(cellar, options).run();
}

}  // namespace pons::tests
