// The bridge: admits tasks, journals them, waits for their resources, runs their trees, and writes exactly one outcome
// for each. It knows skills only by their contract.
//
// Where its journal lies in a database with an order book, it takes orders from there while it has little to do.
//
// One thread. Call tick() every 10 ms. Nobody hears of an outcome before the journal holds it for good, and no skill
// starts before the journal holds that it does, and all that happened until then.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/review/review.hpp"
#include "pons/bridge/schedule/arbiter.hpp"
#include "pons/bridge/tree/tree.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/world.hpp"

namespace pons::bridge {

inline constexpr std::size_t kMaxOpen = 10'000;    // tasks without an outcome;
inline constexpr std::size_t kMaxUrgent = 10'100;  // until there are so many, an urgent one is taken all the same
// A tree may go round for weeks. Of one that is open the journal holds fewer events than kMostEvents and those of one
// tick; when there are as many, what the checkpoint has taken in goes, but for the last ones, which tell its story.
inline constexpr std::size_t kMostEvents = 512, kLastEvents = 256;
// A skill that was cancelled, or ran out of time, and has not ended after this long is given up: see Bridge::fault().
inline constexpr Duration kCancelGrace = std::chrono::seconds(30);
// A note of what was refused: {"id","reason","text"}, the beginning of what was sent; and where the notes before it do
// not tell of all, "untold", how many they left out.
inline constexpr std::string_view kRefusedEvent = "refused";

struct Admission {
  std::string id;
  Accepted accepted = Accepted::kNew;         // kAlready: the same task was accepted earlier, nothing was queued
  std::vector<std::string> differences = {};  // of a new one's tree: see tree::Program
};

struct OutcomeReport {
  std::string id;
  task::Outcome outcome = task::Outcome::kFailed;
  std::string reason;  // empty when it succeeded
  // {"attempts":…, "steps":[{"skill":…,"status":…,"detail":…}] (the last 64), "stop":…, "blackboard":{…} (of a tree)}
  Json detail = Json::object();
};

// What shall become of a task that a bridge which is no more had begun.
struct Resumption {
  std::size_t done = 0;                  // so many of its first steps have succeeded, by the look of the world
  std::optional<task::Outcome> outcome;  // nothing: it goes on with the next step; when there is none, it SUCCEEDED
  std::string reason;                    // of the outcome
  Json detail = Json::object();          // of the step that it comes from
};
// Looks at the world. `done`: of so many of its first steps the journal has it; an answer of fewer counts as that many.
// Of a tree it is asked for each skill that nobody saw end, as for a task of that one step.
using Resume = std::function<Resumption(const task::Task& task, std::size_t done)>;

class Bridge {
 public:
  // All three must outlive it; `skills` must not change.
  Bridge(Journal& journal, const task::SkillRegistry& skills, const world::World& world);
  ~Bridge();

  // Before the first task: another robot, one for each of world.arms(), with what it can do. A task of steps runs on
  // the first that is free, has all its skills and a chance to take up what it is about, and stays there; what has a
  // tree, and what needs no resource, is the first robot's. `skills` must outlive the bridge and not change.
  void add_robot(const task::SkillRegistry& skills);

  // Before the first task.
  void use_rules(Rules rules, Contradictions contradictions) {
    review_.use_rules(std::move(rules), std::move(contradictions));
  }
  // The trees that tasks may name; before the first task.
  void use_trees(tree::Library trees) { review_.use_trees(std::move(trees)); }

  // The task is for good in the journal after the next commit(), which tick() calls: tell a sender who may not hear it
  // otherwise then. Error: what is wrong with the task, the id is taken by another task, the queue is full, the bridge
  // is stopping, or the journal cannot be written. An error leaves nothing behind.
  [[nodiscard]] Expected<Admission> submit(std::string_view json, Time now);
  // A reply from outside, a task or {"tasks":[…]}: all of it or nothing; and no more often than the rules say.
  [[nodiscard]] Expected<std::vector<Admission>> submit_all(std::string_view json, Time now);
  // A submission whose text nobody could make a task of, as whoever brought it has found: counted and journaled as
  // those that submit() refuses are. `id` is that of its task, or empty where none can be read.
  void refuse(std::string_view text, const std::string& id, const Error& why, Time now);
  // Takes up what the journal's last owner left open, before the first tick. Tasks not begun wait again; of those
  // begun, `resume` says which go on, with the first step that is not known to have succeeded and before all others,
  // and which end, and how. A task that was begun stays with its robot. Error: the journal cannot be read or written.
  [[nodiscard]] Expected<void> recover(const Resume& resume, Time now) { return recover(std::span(&resume, 1), now); }
  // Likewise; of each robot, in their order, how it looks at the world.
  [[nodiscard]] Expected<void> recover(std::span<const Resume> resumes, Time now);
  void tick(Time now);

  // The verbs that a sender has. What comes of them the task's events and its outcome say, with what was measured:
  // "stop" is CONFIRMED, UNCERTAIN or FAILED. Errors: no such open task, or it is ending already.
  // Waiting: leaves the queue. Running: stops at its next safe point and keeps its plan and its resources. Error also:
  // it is paused already.
  [[nodiscard]] Expected<void> pause(std::string_view id, Time now, std::string_view reason);
  // Error also: it is not paused.
  [[nodiscard]] Expected<void> resume(std::string_view id, Time now);
  // Somebody of that tier allows what the rules of the world do not leave to a brain: all that a waiting task asks
  // people of that tier, or lower ones, for. Error also: nobody is asked, the tier is unknown or too low.
  [[nodiscard]] Expected<void> approve(std::string_view id, std::string_view tier, std::string_view by, Time now);
  // Waiting: ends as CANCELLED at once. Running: the skill leaves the world safe first.
  [[nodiscard]] Expected<void> cancel(std::string_view id, Time now, std::string_view reason);
  // Likewise, but what moves stops now, wherever it is.
  [[nodiscard]] Expected<void> halt(std::string_view id, Time now, std::string_view reason);
  // All that run, and what waits and may hold something that an earlier bridge began with, are paused for that reason,
  // but for those that are paused, or ending, already; whether there were any. Nobody looks after tasks that are told
  // so one by one: what is to begin must be withheld.
  bool pause_all(Time now, std::string_view reason);
  // Those that are paused for that reason go on. One that somebody has had go on meanwhile, and paused again, is paused
  // for another.
  void resume_all(Time now, std::string_view reason);
  // Whether all stand so that use resources and run, and none waits that an earlier bridge has begun.
  [[nodiscard]] bool all_paused() const;
  // Cancels everything and refuses what comes; tick() on until idle().
  void stop(Time now, std::string_view reason);
  // That robot has had an emergency stop, for that cause: open tasks are held or cancelled as the world says, but for
  // those that another robot runs or, being in order, may run. One that has begun no other robot may run. Called again
  // before released() it does nothing.
  void emergency_stop(Time now, std::string_view cause, std::size_t robot = 0);
  void released(Time now, std::size_t robot = 0);

  // Held (protective stop), a robot starts no task and gives none up; those it runs go on being ticked, but no time
  // passes for them: none runs out. While all are held, none that waits grows older. Gone: held until a person comes;
  // the others do not wait for it.
  enum class Hold : std::uint8_t { kOff, kOn, kGone };
  void hold(Hold hold, std::size_t robot = 0) { robots_[robot].hold = hold; }
  // Whether something hangs on that robot. What carries it makes way for no other task, but where a skill of it that
  // runs says that it may.
  void load(bool carries, std::size_t robot = 0) { robots_[robot].carries = carries; }

  // What keeps new tasks from being taken, as their senders are told, and orders from being claimed; nothing: they are.
  // Those that are open go on.
  void refuse_new(std::optional<Error> why) { closed_ = std::move(why); }

  // Withheld, no task is given a resource, and none makes way for another: who needs some waits, and its time passes.
  // Those that have them go on, and so do those that need none; but where all is withheld, none of these begins.
  void withhold(Arbiter::Withheld what) { arbiter_.withhold(what); }

  // A journal entry of no task; `order` is what it belongs to, if anything.
  void note(std::string_view kind, const Json& detail, Time now, std::string_view order = {});
  // Makes all that happened so far durable. Error: the journal cannot be written, which is then fault(), too.
  [[nodiscard]] Expected<void> commit(Time now);
  // Whether an acceptance or an outcome waits for that, or never will be durable: tell nobody of tasks before.
  [[nodiscard]] bool unkept() const { return unkept_ || fault_; }
  // The sequence up to which it has made the journal's events durable in its own time: those who look on may have the
  // disk asked for more, but by them nothing becomes part of a recording earlier.
  [[nodiscard]] std::int64_t kept() const { return kept_; }

  // Since the last call, in the order of their writing; none before the journal holds it for good.
  [[nodiscard]] std::vector<OutcomeReport> take_outcomes();

  // Whether a task holds that resource; whether one waits for it.
  [[nodiscard]] bool has_holder(std::string_view resource) const { return arbiter_.has_holder(resource); }
  [[nodiscard]] bool is_waited_for(std::string_view resource) const { return arbiter_.is_waited_for(resource); }
  [[nodiscard]] std::size_t queue_length() const { return arbiter_.queue_length(); }
  [[nodiscard]] std::vector<std::string> queue() const { return arbiter_.queue(); }
  [[nodiscard]] std::vector<std::string> running() const;  // also paused on their way; in the order of their ids
  // Open tasks, in the order of their acceptance: at most so many, of those accepted after that event of the journal.
  // Of the task itself, id and priority only.
  [[nodiscard]] std::vector<TaskRecord> open_tasks(std::int64_t after, std::size_t most) const;
  [[nodiscard]] std::size_t open_count() const { return open_.size(); }
  // How an open task stands, for a person to read: "waiting", "running", "pausing", "paused", "making way",
  // "preempted", "ending", "asks a person"; empty when there is no such open task.
  [[nodiscard]] std::string_view state(std::string_view id) const;
  // Waiting ones that a person has paused, or is asked about.
  [[nodiscard]] const std::set<std::string>& parked() const { return parked_; }
  // Those, the ones that a robot has begun which is gone, and the ones that wait for it or for what it keeps: nobody
  // need wait for what they are about.
  [[nodiscard]] std::set<std::string> set_aside() const;
  // Whether any of those that run needs some: else nothing moves for a task.
  [[nodiscard]] bool uses_resources(std::size_t robot = 0) const;
  // The first of these; empty where there is none.
  [[nodiscard]] std::string mover(std::size_t robot = 0) const;
  [[nodiscard]] bool idle() const { return open_.empty(); }
  [[nodiscard]] const Journal& journal() const { return journal_; }
  [[nodiscard]] bool held() const;                                 // all robots
  [[nodiscard]] std::int64_t retries() const { return retries_; }  // starts of a step beyond its first
  [[nodiscard]] std::int64_t refused() const { return refused_; }  // submissions
  // Set for good when the journal cannot be written or a skill did not end when told to: nothing is admitted or started
  // any more, running tasks are cancelled. Outcomes that could not be written are not reported and stay open in the
  // journal.
  [[nodiscard]] const std::optional<Error>& fault() const { return fault_; }

 private:
  struct Open;
  // A task that may be taken.
  struct Candidate {
    task::Task task;
    std::shared_ptr<const tree::Program> program;
    Asked asked;
    Accepted accepted = Accepted::kNew;
  };

  // admission.cpp
  [[nodiscard]] Expected<std::vector<task::Task>> parse(std::string_view json, Time now);
  [[nodiscard]] Expected<Admission> admit_one(std::string_view json, Time now);
  [[nodiscard]] Expected<std::vector<Admission>> admit(std::vector<task::Task> tasks, std::string_view text, Time now);
  [[nodiscard]] Expected<std::vector<Candidate>> examine_all(std::vector<task::Task> tasks, std::string_view text,
                                                             Time now);
  [[nodiscard]] Expected<Candidate> examine(task::Task task, std::size_t others, Time now);
  [[nodiscard]] Expected<Admission> take(Candidate candidate, Time now);
  void let_go(const std::vector<Candidate>& candidates);
  // Whose submission, as far as that is known, and its text.
  struct Sent {
    std::string id, order;
    std::string_view text;
  };
  void note_refused(const Sent& sent, const Error& why, Time now);
  [[nodiscard]] Open& add_open(task::Task task, std::shared_ptr<const tree::Program> program, Time accepted,
                               std::int64_t sequence);
  [[nodiscard]] std::unique_ptr<tree::Tree> tree_of(const task::Task& task,
                                                    std::shared_ptr<const tree::Program> program);
  void enqueue(const Open& open, Time since);
  // robots.cpp
  [[nodiscard]] std::size_t robot_named(std::string_view name) const;  // the first, where there is none of that name
  void keep_to(Open& open, std::size_t robot) const;
  [[nodiscard]] static bool may_run(const Open& open, std::size_t robot);
  [[nodiscard]] std::vector<std::size_t> robots_for(const task::Task& task, const tree::Program* program) const;
  [[nodiscard]] std::vector<std::string> resources_for(const task::Task& task, const tree::Program* program,
                                                       std::size_t robot) const;
  // What robots hold that are gone.
  [[nodiscard]] std::vector<std::string> kept_by_gone() const;
  [[nodiscard]] bool needs_any(const Open& open, std::size_t robot, const std::vector<std::string>& resources) const;
  [[nodiscard]] Arbiter::Fits fits() const;
  [[nodiscard]] task::Chance chance(const Open& open, std::size_t robot) const;
  [[nodiscard]] bool is_held(std::size_t robot) const { return robots_[robot].hold != Hold::kOff; }
  void park(Open& open, Time now);
  void unpark(Open& open, Time now);
  [[nodiscard]] Expected<Open*> find_open(std::string_view id);
  [[nodiscard]] Expected<void> take_up(const TaskRecord& record, std::shared_ptr<const tree::Program> program,
                                       std::span<const Resume> resumes, Time now);
  [[nodiscard]] Expected<void> go_on(const TaskRecord& record, const Story& story, const Resume& resume, Time now);
  [[nodiscard]] Expected<void> go_on_in_tree(const TaskRecord& record, std::shared_ptr<const tree::Program> program,
                                             const Story& story, const Resume& resume, Time now);
  // approvals.cpp
  void ask(Open& open, Asked asked, Time now);
  [[nodiscard]] Asked still_to_ask(Asked judged, const Story& story) const;
  void expire_asked(Time now);
  [[nodiscard]] Expected<void> permit(const std::string& id, const task::Step& use, Time now);

  void expire(Time now);
  void leave(Open& open, task::Outcome outcome, std::string reason);
  void close(Open& open, Time now);
  void close_some(Time now);
  void tell_held(Time now);
  void tell_held(Open& open, Time now);
  [[nodiscard]] bool is_to_be_held(const Open& open) const;
  [[nodiscard]] bool is_stopped(const Open& open) const;
  void take_orders(Time now);
  void take_order(const Order& order, Time now);
  [[nodiscard]] std::vector<std::string> start_granted(Time now);
  void start(Open& open, Time now);
  void regain(Open& open, Time now);
  void stand_still(Time now);
  void preempt(Time now);
  [[nodiscard]] bool carries_between_skills(const Open& open) const;
  void stands(Open& open, Time now);
  void tick_trees(const std::vector<std::string>& ids, Time now);
  [[nodiscard]] std::vector<std::string> in_turn();
  [[nodiscard]] bool give_up(const Open& open);
  void tell(Open& open, Time now, std::string_view kind, const Json& detail = Json::object());
  void checkpoint(Open& open, Time now);
  void conclude(const std::string& id, Open& open, const task::Progress& progress, Time now);
  enum class Ending : std::uint8_t { kCancel, kHalt };
  [[nodiscard]] Expected<void> end(std::string_view id, Ending ending, Time now, std::string_view reason);
  void end_those(const std::function<bool(const Open&)>& concerned, Time now, std::string_view reason);
  void end_running(Open& open, Ending ending, Time now, std::string_view reason);
  void finish(const std::string& id, task::Outcome outcome, std::string reason, Json detail, Time now);
  void finish_unopened(const std::string& id, task::Outcome outcome, const std::string& reason, Time now,
                       Json detail = Json::object());
  [[nodiscard]] Expected<void> journal_attempt(const std::string& id, const tree::Attempt& attempt, Time now);
  void keep(const Expected<void>& written);
  void set_fault(Error error);

  Journal& journal_;
  struct Robot {
    std::string name;
    const task::SkillRegistry* skills;
    Hold hold = Hold::kOff;
    bool carries = false;
    std::optional<std::string> emergency;  // its cause
  };
  const world::World& world_;
  std::vector<Robot> robots_;
  Review review_;
  Arbiter arbiter_;
  int urgent_priority_;
  Duration ageing_;
  world::OnEmergencyStop on_emergency_stop_;
  std::map<std::string, std::unique_ptr<Open>, std::less<>> open_;
  std::map<std::string, Open*, std::less<>> running_;
  std::set<std::string> parked_;
  std::set<std::string> asking_;                 // a person
  std::deque<std::string> leaving_;              // out of the queue, and their ends to be written
  std::optional<std::string> held_to_;           // whether tasks are held is to be told from this one on
  std::vector<OutcomeReport> ended_, outcomes_;  // written; and durable
  std::optional<Error> fault_, closed_;
  std::size_t shared_work_ = 0;  // of this tick, by those that need no resource
  std::string next_;             // of those, who has the first turn in the next tick; empty: all have had theirs
  std::int64_t kept_ = 0;
  Time last_commit_, last_tick_, look_at_;  // the last: into the order book again
  Duration held_for_{0};                    // since the first tick
  std::int64_t retries_ = 0, refused_ = 0;
  Rate refusals_{20, std::chrono::minutes(1)};  // that the journal tells of: a brain may send nonsense for ever
  std::int64_t untold_refusals_ = 0;
  bool unkept_ = false;  // an acceptance or an outcome waits for commit()
  bool stopping_ = false;
};

}  // namespace pons::bridge
