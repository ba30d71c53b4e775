// pons journal: whether one is whole, what was refused, less of it, one of an older version, and one that nobody goes
// on with.

#include <fmt/format.h>
#include <filesystem>

#include "apps/assembly.hpp"
#include "apps/commands.hpp"
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

int refused(const JournalOptions& options) {
  const auto journal = Journal::open_to_read(options.file);
  if (!journal) return bad_input(journal.error());
  std::int64_t told = 0;
  const auto read = (*journal)->each_note([&told](const bridge::Event& note) -> Expected<void> {
    if (note.kind != bridge::kRefusedEvent) return {};
    ++told;
    say(stdout, story_line({{"time_s", note.stamp.s()},
                            {"task", task::text_of(note.detail, "id")},
                            {"kind", note.kind},
                            {"detail", note.detail}}));
    return {};
  });
  if (!read) return bad_run(read.error());
  if (told == 0) say(stdout, "nothing was refused\n");
  return kExitGood;
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
  auto ended = bridge::end_with_body(**journal, Time{});
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
  add("compact", "Drop what happened to ended tasks between acceptance and outcome", compact)
      ->add_option("--keep", options->keep, "All of so many tasks that ended last (0)")
      ->check(whole_number(1'000'000'000'000));
  add("upgrade", "Bring one of an older version to this program's", upgrade);
  add("end", "End what a run that was killed with its robot left open in it", end);
}

}  // namespace pons::apps
