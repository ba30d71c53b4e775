// pons task: submit to a running bridge and tell its tasks what to do; list and show from it or from a journal at rest.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>
#include <string>
#include <string_view>

#include "apps/commands.hpp"
#include "apps/journal_json.hpp"
#include "apps/paths.hpp"
#include "apps/story_text.hpp"
#include "apps/task_file.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/request.hpp"
#include "pons/record/sweep.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using bridge::Json;

struct TaskOptions {
  fs::path socket;
  std::string journal;
  std::string file, id, reason, tier, by;
  bool json = false, at_once = false, open = false, ended = false;
  std::int64_t limit = gate::kListed, after = 0;
};

constexpr std::chrono::seconds kPatience{10};
constexpr std::chrono::minutes kWatchPatience{10};  // a run answers who watches every 30 s of its time

Expected<Json> ask(const TaskOptions& options, const Json& request, std::chrono::milliseconds patience = kPatience) {
  const fs::path socket = options.socket.empty() ? default_socket() : options.socket;
  auto answer = gate::ask(socket, request, patience);
  if (!answer) return answer;
  if (!answer->value("ok", false)) return fail(answer->value("error", std::string("refused without a reason")));
  return answer;
}

int submit(const TaskOptions& options) {
  auto task = read_task(options.file);
  if (!task) return bad_input(task.error());
  Json request{{"op", "submit"}};
  if (task->is_object() && task->contains("tasks")) {
    request.update(*task);
  } else {
    request["task"] = *std::move(task);
  }
  const auto answer = ask(options, request);
  if (!answer) return bad_input(answer.error());
  for (const Json& one : answer->at("tasks")) {
    fmt::print("{}: {}\n", one.value("id", std::string{}),
               one.value("accepted", std::string{}) == "new" ? "accepted" : "already accepted");
    for (const Json& difference : one.value("differences", Json::array()))
      fmt::print("  other than BehaviorTree.CPP: {}\n", difference.get<std::string>());
  }
  return kExitGood;
}

int approve(const TaskOptions& options) {
  const char* const user = std::getenv("USER");
  const std::string by = !options.by.empty() ? options.by : user != nullptr && *user != '\0' ? user : "somebody";
  const auto answer = ask(options, {{"op", "approve"}, {"id", options.id}, {"tier", options.tier}, {"by", by}});
  if (!answer) return bad_input(answer.error());
  fmt::print("{}: allowed\n", options.id);
  return kExitGood;
}

void print_row(const Json& task) {
  const std::string outcome = task.value("outcome", std::string{});
  const std::string open = task.value("state", std::string(task.value("started", false) ? "begun" : "waiting"));
  fmt::print("{:<20} {:>3}  {:<10} {}\n", task.value("id", std::string{}), task.value("priority", 0),
             outcome.empty() ? open : outcome, task.value("reason", std::string{}));
}

Expected<Json> from_journal(const std::string& file, const std::string& id) {
  const auto journal = bridge::Journal::open_to_read(file);
  if (!journal) return std::unexpected(journal.error());
  const auto history = (*journal)->task(id);
  if (!history) return std::unexpected(history.error());
  if (!*history) return fail("no task '" + id + "'", bridge::shown(file), "pons task list shows those there are");
  return Json{{"task", to_json((*history)->record)}, {"events", to_json((*history)->events)}};
}

Expected<Json> story_from_journal(const std::string& file, const std::string& order) {
  const auto journal = bridge::Journal::open_to_read(file);
  if (!journal) return std::unexpected(journal.error());
  const auto events = (*journal)->history(order);
  if (!events) return std::unexpected(events.error());
  if (events->empty())
    return fail("nothing is known of '" + order + "'", bridge::shown(file), "pons task list shows the tasks");
  return Json{{"events", to_json(*events)}};
}

// As a run answers.
Expected<Json> list_from_journal(const TaskOptions& options, std::string_view which, std::int64_t limit) {
  const auto journal = bridge::Journal::open_to_read(options.journal);
  if (!journal) return std::unexpected(journal.error());
  const auto counts = (*journal)->counts();
  if (!counts) return std::unexpected(counts.error());
  const bool open = which == "open";
  const std::int64_t before = options.after == 0 ? std::numeric_limits<std::int64_t>::max() : options.after;
  const auto tasks = open ? (*journal)->open_tasks() : (*journal)->ended_tasks(before, limit);
  if (!tasks) return std::unexpected(tasks.error());
  Json page = Json::array();
  for (const bridge::TaskRecord& record : *tasks) {
    const bool here = !open || record.sequence > options.after;
    if (here && std::ssize(page) < limit) page.push_back(to_json(record));
  }
  Json answer{{"tasks", page}, {"open", counts->open}, {"ended", counts->accepted - counts->open}};
  answer["after"] = page.empty() ? options.after : page.back().at("sequence").get<std::int64_t>();
  return answer;
}

// Which: "open" or "ended".
Expected<Json> list_page(const TaskOptions& options, const std::string& which, std::int64_t limit) {
  if (!options.journal.empty()) return list_from_journal(options, which, limit);
  return ask(options, {{"op", "list"}, {"which", which}, {"limit", limit}, {"after", options.after}});
}

// What is not on this page, and how to see it.
void print_more(const TaskOptions& options, const Json& answer, const std::string& which, std::int64_t shown) {
  const std::int64_t all = answer.at(which), after = answer.at("after");
  const bool first = options.after == 0;
  if (first ? all <= shown : shown < options.limit) return;
  std::vector<std::string> how{"pons", "task", "list", "--" + which};
  const auto add = [&how](const char* name, const std::string& value) { how.insert(how.end(), {name, value}); };
  if (shown > 0) add("--after", std::to_string(after));
  if (options.limit != TaskOptions{}.limit) add("--limit", std::to_string(options.limit));
  if (!options.journal.empty()) add("--journal", bridge::shown(options.journal));
  if (options.journal.empty() && !options.socket.empty()) add("--socket", options.socket);
  fmt::print("{}: {}\n", first ? fmt::format("{} more {}", all - shown, which) : "what follows, if anything",
             record::shell_line(how));
}

// Open ones first.
int list(const TaskOptions& options) {
  const bool both = options.open == options.ended;
  if (both && options.after > 0)
    return bad_input({"it goes on with one of two lists", "--after", "say --open or --ended, too"});
  std::int64_t left = options.limit;
  Json answer;
  for (const std::string which : {"open", "ended"}) {
    if (!both && (which == "open") != options.open) continue;
    std::int64_t shown = 0;
    if (left > 0) {
      auto page = list_page(options, which, left);
      if (!page) return bad_input(page.error());
      answer = *std::move(page);
      for (const Json& task : answer.at("tasks")) print_row(task);
      shown = std::ssize(answer.at("tasks"));
    }
    left -= shown;
    print_more(options, answer, which, shown);
  }
  return kExitGood;
}

int show(const TaskOptions& options) {
  const auto answer = options.journal.empty() ? ask(options, {{"op", "show"}, {"id", options.id}})
                                              : from_journal(options.journal, options.id);
  if (!answer) return bad_input(answer.error());
  print_row(answer->at("task"));
  for (const Json& event : answer->at("events")) {
    if (story_line(event).empty()) continue;
    fmt::print("  {:>10.3f} s  {:<12} {}\n", event.value("time_s", 0.0), event.value("kind", std::string{}),
               event.contains("detail") ? event.at("detail").dump() : "");
  }
  return kExitGood;
}

int history(const TaskOptions& options) {
  const auto answer = options.journal.empty() ? ask(options, {{"op", "history"}, {"id", options.id}})
                                              : story_from_journal(options.journal, options.id);
  if (!answer) return bad_input(answer.error());
  if (options.json) {
    fmt::print("{}\n", answer->at("events").dump(2));
    return kExitGood;
  }
  for (const Json& event : answer->at("events")) fmt::print("{}", story_line(event));
  return kExitGood;
}

// Prints what happens to it after that sequence, until one of these events of the task itself: that one. Errors: the
// run has ended before, there is nothing of that name, or it was refused, and no such task is there.
Expected<Json> follow(const TaskOptions& options, std::int64_t after, const std::set<std::string>& until) {
  bool refused = false, accepted = after > 0;
  for (;;) {
    const auto answer = ask(options, {{"op", "watch"}, {"id", options.id}, {"after", after}}, kWatchPatience);
    if (!answer) return std::unexpected(answer.error());
    after = answer->at("after");
    for (const Json& event : answer->at("events")) {
      fmt::print("{}", story_line(event));
      const auto kind = event.value("kind", std::string{});
      refused = refused || kind == bridge::kRefusedEvent;
      accepted = accepted || kind == bridge::kAcceptedEvent;
      if (event.value("task", std::string{}) == options.id && until.contains(kind)) return event;
    }
    std::fflush(stdout);
    if (refused && !accepted) return fail("no such task was accepted", options.id, "mend it, and submit it again");
  }
}

int watch(const TaskOptions& options) {
  const auto ended = follow(options, 0, {"ended"});
  return ended ? kExitGood : bad_input(ended.error());
}

// A verb, and the event that says that it was done. What could not be broken off any more has ended otherwise.
int tell(const TaskOptions& options, const std::string& verb, const std::string& done) {
  Json request{{"op", verb}, {"id", options.id}};
  if (!options.reason.empty()) request["reason"] = options.reason;
  const auto answer = ask(options, request);
  if (!answer) return bad_input(answer.error());
  if (options.at_once) return kExitGood;
  const auto came = follow(options, answer->at("after"), {done, "continued", "ended"});
  if (!came) return bad_input(came.error());
  const bool otherwise = done == bridge::kEndedEvent &&
                         task::text_of(came->value("detail", Json{}), "outcome") != name(task::Outcome::kCancelled);
  return came->value("kind", std::string{}) == done && !otherwise ? kExitGood : kExitBadRun;
}

}  // namespace

void add_task(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<TaskOptions>();
  CLI::App* task =
      app.add_subcommand("task", "Submit tasks to a running bridge, list and show them, tell them to pause or end");
  task->require_subcommand(1);
  const auto common = [options](CLI::App* command) {
    command->add_option("--socket", options->socket, "Where the run listens (its --socket)");
  };
  CLI::App* submit_command = task->add_subcommand("submit", "Submit a task, or a reply of several, from a JSON file");
  submit_command->add_option("file", options->file, "JSON file, - for standard input")->required();
  common(submit_command);
  submit_command->callback([options, &chosen] { chosen = [options] { return submit(*options); }; });

  CLI::App* list_command =
      task->add_subcommand("list", "List the tasks: those that are open, then those that have ended");
  common(list_command);
  list_command->add_option("--journal", options->journal, "Read this journal instead of asking a run");
  list_command->add_flag("--open", options->open, "Only those that are open, in the order of acceptance");
  list_command->add_flag("--ended", options->ended, "Only those that have ended, the last accepted first");
  list_command->add_option("--limit", options->limit, "At most so many (100)")->check(CLI::Range(1, 1000));
  list_command->add_option("--after", options->after, "On from there; the page before says from where")
      ->check(whole_number(1'000'000'000'000));
  list_command->callback([options, &chosen] { chosen = [options] { return list(*options); }; });

  CLI::App* show_command = task->add_subcommand("show", "Show one task and what happened to it");
  show_command->add_option("id", options->id, "The task's id")->required();
  common(show_command);
  show_command->add_option("--journal", options->journal, "Read this journal instead of asking a run");
  show_command->callback([options, &chosen] { chosen = [options] { return show(*options); }; });

  CLI::App* history_command = task->add_subcommand(
      "history", "Tell the story of one order: what was seen, planned, tried, and what became of it");
  history_command->add_option("id", options->id, "The order's id, or a task's")->required();
  common(history_command);
  history_command->add_option("--journal", options->journal, "Read this journal instead of asking a run");
  history_command->add_flag("--json", options->json, "All that is known, as JSON");
  history_command->callback([options, &chosen] { chosen = [options] { return history(*options); }; });

  CLI::App* watch_command = task->add_subcommand("watch", "Tell the story as it happens, until the task has ended");
  watch_command->add_option("id", options->id, "The task's id")->required();
  common(watch_command);
  watch_command->callback([options, &chosen] { chosen = [options] { return watch(*options); }; });

  CLI::App* approve_command = task->add_subcommand("approve", "Allow what a task asks a person for");
  approve_command->add_option("id", options->id, "The task's id")->required();
  approve_command->add_option("--as", options->tier, "As whom: one of the world's review.tiers")->required();
  approve_command->add_option("--by", options->by, "Who you are, for the journal (your user name)");
  common(approve_command);
  approve_command->callback([options, &chosen] { chosen = [options] { return approve(*options); }; });

  struct Verb {
    const char *name, *done, *help;
  };
  for (const Verb& verb :
       {Verb{"pause", "paused", "Let it wait: at once, or at its next safe point, with what it holds"},
        Verb{"resume", "continued", "Let one that is paused go on"},
        Verb{"cancel", "ended", "End it as CANCELLED, once its skill has left the world safe"},
        Verb{"halt", "ended", "Likewise, but stop now what moves, wherever it is"}}) {
    CLI::App* command = task->add_subcommand(verb.name, verb.help);
    command->add_option("id", options->id, "The task's id")->required();
    if (std::string_view(verb.name) != "resume") command->add_option("--reason", options->reason, "For the journal");
    command->add_flag("--no-wait", options->at_once, "Do not wait until that has happened");
    common(command);
    command->callback(
        [options, &chosen, verb] { chosen = [options, verb] { return tell(*options, verb.name, verb.done); }; });
  }
}

}  // namespace pons::apps
