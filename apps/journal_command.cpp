// pons journal: whether one is whole, what was refused, less of it, one of an older version, and one that nobody goes
// on with.

#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>

#include "apps/assembly.hpp"
#include "apps/commands.hpp"
#include "apps/journal_json.hpp"
#include "apps/story_text.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using bridge::Journal;

struct JournalOptions {
  std::string file;
  std::int64_t keep = 0;
  std::set<std::string> kinds;
  bool json = false;
};

int check(const JournalOptions& options) {
  const auto journal = Journal::open_to_read(options.file);
  if (!journal) return bad_input(journal.error());
  const auto wrong = bridge::audit(**journal);
  if (!wrong.empty()) {
    for (const std::string& line : wrong) say(stderr, fmt::format("pons: {}: {}\n", bridge::shown(options.file), line));
    return kExitBadRun;
  }
  const auto counts = (*journal)->counts();
  if (!counts) return bad_run(counts.error());
  say(stdout,
      fmt::format("whole: {} tasks ({} succeeded, {} failed, {} cancelled, {} exceptions, {} open), {} events\n",
                  counts->accepted, counts->succeeded, counts->failed, counts->cancelled, counts->exception,
                  counts->open, counts->events));
  return kExitGood;
}

// Those for which `is_meant`; `none` where there are none.
int tell_notes(const JournalOptions& options, const std::function<bool(const bridge::Event&)>& is_meant,
               const std::string& none) {
  const auto journal = Journal::open_to_read(options.file);
  if (!journal) return bad_input(journal.error());
  std::int64_t told = 0;
  const auto read = (*journal)->each_note([&](const bridge::Event& note) -> Expected<void> {
    if (!is_meant(note)) return {};
    ++told;
    task::Json json = to_json(note);
    json["task"] = note.kind == bridge::kRefusedEvent ? task::text_of(note.detail, "id") : note.order;
    say(stdout, options.json ? json.dump() + "\n" : story_line(json));
    return {};
  });
  if (!read) return bad_run(read.error());
  if (told == 0 && !options.json) say(stdout, none);
  return kExitGood;
}

int refused(const JournalOptions& options) {
  return tell_notes(
      options, [](const bridge::Event& note) { return note.kind == bridge::kRefusedEvent; }, "nothing was refused\n");
}

int notes(const JournalOptions& options) {
  const auto is_meant = [&kinds = options.kinds](const bridge::Event& note) {
    return kinds.empty() ? note.order.empty() : kinds.contains(note.kind);
  };
  return tell_notes(options, is_meant, "there are none\n");
}

// Opening for writing would create one.
Expected<void> existing(const std::string& file) {
  std::error_code ignored;
  if (bridge::in_database(file)) {
    const auto there = Journal::open_to_read(file);
    return there ? Expected<void>{} : std::unexpected(there.error());
  }
  if (fs::exists(file, ignored)) return {};
  return fail("there is no such journal", file, "name the file that a run was given with --journal");
}

int compact(const JournalOptions& options) {
  if (auto there = existing(options.file); !there) return bad_input(there.error());
  const auto journal = Journal::open(options.file);
  if (!journal) return bad_input(journal.error());
  const auto dropped = (*journal)->compact(options.keep);
  if (!dropped) return bad_run(dropped.error());
  say(stdout, fmt::format("{} events dropped; ids and outcomes are kept\n", *dropped));
  return kExitGood;
}

int upgrade(const JournalOptions& options) {
  if (auto there = existing(options.file); !there) return bad_input(there.error());
  if (auto upgraded = Journal::upgrade(options.file); !upgraded) return bad_input(upgraded.error());
  say(stdout, fmt::format("of version {} now\n", Journal::kVersion));
  return kExitGood;
}

// What a run that was killed with its robot left open stays so, for no other run goes on with its journal.
int end(const JournalOptions& options) {
  if (auto there = existing(options.file); !there) return bad_input(there.error());
  const auto journal = Journal::open(options.file);
  if (!journal) return bad_input(journal.error());
  const auto link = link_that_lives(**journal);
  if (!link) return bad_run(link.error());
  if (!link->empty())
    return bad_input({fmt::format("its robot lives (--link {})", *link), bridge::shown(options.file),
                      "start `pons bridge` to go on with it, or end the body first"});
  const auto before = (*journal)->counts();
  if (!before) return bad_run(before.error());
  Time last;  // of the run that is gone: the stories read on
  const auto read = (*journal)->each_event([&last](const bridge::Event& event) -> Expected<void> {
    last = std::max(last, event.stamp);
    return {};
  });
  if (!read) return bad_run(read.error());
  auto ended = bridge::end_with_body(**journal, last);
  if (ended) ended = (*journal)->commit();
  if (!ended) return bad_run(ended.error());
  const auto after = (*journal)->counts();
  if (!after) return bad_run(after.error());
  say(stdout, fmt::format("{} tasks ended as FAILED, for their robot is gone; {} open\n", before->open - after->open,
                          after->open));
  return kExitGood;
}

}  // namespace

void add_journal(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<JournalOptions>();
  CLI::App* journal = app.add_subcommand("journal", "Check, read, shorten, upgrade, or end a journal that no run owns");
  journal->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, int (*run)(const JournalOptions&)) {
    CLI::App* command = journal->add_subcommand(name, what);
    command->add_option("file", options->file, "What a run was given with --journal: a file, or postgresql://…#NAME")
        ->required();
    command->callback([options, run, &chosen] { chosen = [options, run] { return run(*options); }; });
    return command;
  };
  add("check", "Whether it is whole: the file, each task's story, each record", check);
  add("refused", "What was sent that no task could be made of or that might not be done, and why", refused);
  CLI::App* notes_command = add("notes", "What is told of no task: arming, stops, health, alerts, fallbacks", notes);
  notes_command->add_option("--kind", options->kinds, "Those of these kinds, whichever order they belong to")
      ->delimiter(',');
  notes_command->add_flag("--json", options->json, "A line of JSON each");
  add("compact", "Drop what happened to ended tasks between acceptance and outcome", compact)
      ->add_option("--keep", options->keep, "All of so many tasks that ended last (0)")
      ->check(whole_number(1'000'000'000'000));
  add("upgrade", "Bring one of an older version to this program's", upgrade);
  add("end", "End what a run that was killed with its robot left open in it", end);
}

}  // namespace pons::apps
