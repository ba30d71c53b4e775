// What can be asked of a journal.
#include <algorithm>
#include <array>
#include <utility>

#include "pons/bridge/journal/journal_impl.hpp"
#include "pons/bridge/journal/layout.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

Expected<OutcomeRecord> outcome_from(const Json& ending) {
  const auto outcome = task::outcome_from(task::text_of(ending, "outcome"));
  if (!outcome) return std::unexpected(outcome.error());
  return OutcomeRecord{*outcome, task::text_of(ending, "reason"), ending.value("detail", Json::object())};
}

constexpr std::int64_t kPage = 256;

// Of rows that have a sequence each, by which `page` gives back those that come after one.
template <typename Row, typename Page>
Expected<void> page_by_page(const Page& page, const std::function<Expected<void>(const Row&)>& take) {
  for (std::int64_t after = 0;;) {
    const auto rows = page(after);
    if (!rows) return std::unexpected(rows.error());
    for (const Row& row : *rows) {
      if (auto taken = take(row); !taken) return taken;
    }
    if (std::ssize(*rows) < kPage) return {};
    after = rows->back().sequence;
  }
}

template <typename Row, typename Each>
Expected<std::vector<Row>> all(const Each& each) {
  std::vector<Row> rows;
  const auto done = each([&rows](const Row& row) -> Expected<void> {
    rows.push_back(row);
    return {};
  });
  if (!done) return std::unexpected(done.error());
  return rows;
}

}  // namespace

Expected<TaskRecord> Journal::Impl::read_task(const Statement& row) const {
  const Json json = Json::parse(row.text(3), nullptr, false);
  if (json.is_discarded()) return broken("a task is not JSON");
  auto task = task::task_from(json);
  if (!task) return broken(task.error().line());
  if (task->id != row.text(0)) return broken(fmt::format("task '{}' stands under '{}'", task->id, row.text(0)));
  TaskRecord record{
      row.integer(8), std::move(*task), row.integer(1), Time(Duration(row.integer(2))), row.integer(7) != 0, {}};
  if (row.is_null(4)) return record;
  auto end = outcome_from(Json::parse(row.text(6), nullptr, false));
  if (!end) return broken(end.error().line());
  end->run = row.integer(4);
  end->stamp = Time(Duration(row.integer(5)));
  record.outcome = std::move(*end);
  return record;
}

Expected<Event> Journal::Impl::read_event(const Statement& row) const {
  Json detail = Json::parse(row.text(6), nullptr, false);
  if (!detail.is_object()) return broken(fmt::format("the detail of event {} is no JSON object", row.integer(0)));
  return Event{row.integer(0), row.text(3),      row.text(4), row.integer(1), Time(Duration(row.integer(2))),
               row.text(5),    std::move(detail)};
}

Expected<void> Journal::Impl::each_of(Statement& rows, const std::function<Expected<void>(const Event&)>& take) const {
  Reading reading(rows);
  for (;;) {
    const auto row = rows.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return {};
    const auto event = read_event(rows);
    if (!event) return std::unexpected(event.error());
    if (auto taken = take(*event); !taken) return taken;
  }
}

Expected<std::vector<Event>> Journal::Impl::all_of(Statement& rows) const {
  return all<Event>([&](const auto& take) { return each_of(rows, take); });
}

Expected<std::vector<TaskRecord>> Journal::Impl::tasks_of(Statement& rows) const {
  Reading reading(rows);
  std::vector<TaskRecord> records;
  for (;;) {
    const auto row = rows.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return records;
    auto record = read_task(rows);
    if (!record) return std::unexpected(record.error());
    records.push_back(std::move(*record));
  }
}

Expected<void> Journal::each_task(const std::function<Expected<void>(const TaskRecord&)>& take) const {
  return page_by_page<TaskRecord>(
      [this](std::int64_t after) { return impl_->tasks_of(impl_->tasks_after.bind(after).bind(kPage)); }, take);
}

Expected<std::vector<TaskRecord>> Journal::tasks() const {
  return all<TaskRecord>([this](const auto& take) { return each_task(take); });
}

Expected<std::vector<TaskRecord>> Journal::open_tasks() const { return impl_->tasks_of(impl_->open_tasks); }

Expected<std::vector<TaskRecord>> Journal::ended_tasks(std::int64_t before, std::int64_t most) const {
  return impl_->tasks_of(impl_->ended_tasks.bind(before).bind(most));
}

Expected<std::optional<TaskRecord>> Journal::record(std::string_view id) const {
  auto records = impl_->tasks_of(impl_->one_task.bind(id));
  if (!records) return std::unexpected(records.error());
  if (records->empty()) return std::nullopt;
  return std::move(records->front());
}

Expected<std::optional<TaskHistory>> Journal::task(std::string_view id) const {
  auto found = record(id);
  if (!found) return std::unexpected(found.error());
  if (!*found) return std::nullopt;
  auto happened = impl_->all_of(impl_->events_of_task.bind(id));
  if (!happened) return std::unexpected(happened.error());
  return TaskHistory{std::move(**found), std::move(*happened)};
}

Expected<void> Journal::each_note(const std::function<Expected<void>(const Event&)>& take) const {
  return page_by_page<Event>(
      [this](std::int64_t after) { return impl_->all_of(impl_->notes_after.bind(after).bind(kPage)); }, take);
}

Expected<std::vector<Event>> Journal::notes() const {
  return all<Event>([this](const auto& take) { return each_note(take); });
}

std::int64_t Journal::newest() const { return std::max(impl_->last_written, impl_->durable); }

std::int64_t Journal::durable() const { return impl_->durable; }

std::int64_t Journal::ended() const { return impl_->ended; }

Expected<std::vector<Event>> Journal::outline(std::string_view id, std::string_view without) const {
  return impl_->all_of(impl_->outline.bind(without).bind(id));
}

Expected<std::vector<Event>> Journal::history(std::string_view order, std::int64_t after) const {
  // An order may have any number of tasks; who hears what is new in it must not have all of them read each time.
  constexpr std::int64_t kFew = 64;
  Statement& finds = newest() - after <= kFew ? impl_->news_of_order : impl_->events_of_order;
  return impl_->all_of(finds.bind(order).bind(after));
}

Expected<std::vector<Event>> Journal::since(std::int64_t after, std::int64_t last, std::int64_t most) const {
  if (after >= last) return std::vector<Event>{};
  return impl_->all_of(impl_->events_since.bind(after).bind(last).bind(most));
}

Expected<void> Journal::each_event(const std::function<Expected<void>(const Event&)>& take) const {
  return impl_->each_of(impl_->every_event, take);
}

Expected<Counts> Journal::counts() const {
  Counts counts;
  {
    Reading reading(impl_->count);
    const auto row = impl_->count.step();
    if (!row) return std::unexpected(row.error());
    counts.accepted = impl_->count.integer(0);
    counts.events = impl_->count.integer(1);
  }
  Reading reading(impl_->endings);
  for (;;) {
    const auto row = impl_->endings.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) break;
    const auto end = outcome_from(Json::parse(impl_->endings.text(0), nullptr, false));
    if (!end) return impl_->broken(end.error().line());
    std::array<std::int64_t*, 4> of{&counts.succeeded, &counts.failed, &counts.cancelled, &counts.exception};
    ++*of.at(static_cast<std::size_t>(end->outcome));
  }
  counts.open = counts.accepted - counts.succeeded - counts.failed - counts.cancelled - counts.exception;
  return counts;
}

Expected<void> Journal::check_storage() const { return check_layout(*impl_->database); }

std::int64_t Journal::run() const { return impl_->run; }

}  // namespace pons::bridge
