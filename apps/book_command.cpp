// pons book: the order book from which the bridges of one PostgreSQL database take.

#include <fmt/format.h>

#include "apps/commands.hpp"
#include "apps/task_file.hpp"
#include "pons/bridge/journal/book.hpp"

namespace pons::apps {
namespace {

using bridge::OrderBook;

struct BookOptions {
  std::string place, file;
  bool open = false;
};

int submit(const BookOptions& options) {
  const auto json = read_task(options.file);
  if (!json) return bad_input(json.error());
  const auto task = task::task_from(*json);
  if (!task) return bad_input(task.error());
  const auto book = OrderBook::open(options.place);
  if (!book) return bad_input(book.error());
  const auto taken = (*book)->submit(*task);
  if (!taken) return bad_input(taken.error());
  say(stdout, fmt::format("{}: {}\n", task->id, *taken == bridge::Accepted::kNew ? "taken" : "already taken"));
  return kExitGood;
}

int list(const BookOptions& options) {
  const auto book = OrderBook::open_to_read(options.place);
  if (!book) return bad_input(book.error());
  const auto orders = (*book)->orders(options.open ? OrderBook::Which::kOpen : OrderBook::Which::kAll);
  if (!orders) return bad_run(orders.error());
  for (const bridge::OrderRecord& order : *orders) {
    const std::string_view stands = order.outcome              ? task::name(*order.outcome)
                                    : order.claimed_by.empty() ? "waiting"
                                                               : "claimed";
    say(stdout, fmt::format("{:<20} {:>3}  {}  {:<10} {:<12} {}\n", order.id, order.priority, order.submitted, stands,
                            order.claimed_by.empty() ? "-" : order.claimed_by, order.reason));
  }
  return kExitGood;
}

}  // namespace

void add_book(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<BookOptions>();
  CLI::App* book = app.add_subcommand("book", "Orders for whichever of a database's bridges has room next");
  book->require_subcommand(1);
  CLI::App* submit_command = book->add_subcommand("submit", "Put one task from a JSON file into the book");
  submit_command->add_option("database", options->place, "postgresql://USER@HOST:PORT/DATABASE")->required();
  submit_command->add_option("file", options->file, "JSON file, - for standard input")->required();
  submit_command->callback([options, &chosen] { chosen = [options] { return submit(*options); }; });
  CLI::App* list_command = book->add_subcommand("list", "List the orders: who has claimed them and how they ended");
  list_command->add_option("database", options->place, "postgresql://USER@HOST:PORT/DATABASE")->required();
  list_command->add_flag("--open", options->open, "Only those without an outcome");
  list_command->callback([options, &chosen] { chosen = [options] { return list(*options); }; });
}

}  // namespace pons::apps
