#include "pons/bridge/journal/postgres.hpp"

#include <fmt/format.h>
#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/bridge/journal/place.hpp"
#include "pons/task/json_value.hpp"

namespace pons::bridge {
namespace {

constexpr int kPatience_ms = 10'000;
constexpr int kOldestServer = 140000;
constexpr std::int64_t kLockOf = 0x506f6e73;  // "Pons": other programs lock other things

// Neither the server nor a firewall may end what the bridge keeps open between two commits, or wait for a bridge whose
// computer is gone.
constexpr const char* kSession =
    "SET synchronous_commit = on; SET statement_timeout = 0; SET idle_in_transaction_session_timeout = 0; "
    "SET idle_session_timeout = 0; SET lock_timeout = '2s'; SET client_min_messages = warning; "
    "SET standard_conforming_strings = on; SET default_transaction_isolation = 'read committed'; "
    "SET tcp_keepalives_idle = 5; SET tcp_keepalives_interval = 1; SET tcp_keepalives_count = 5; "
    "SET tcp_user_timeout = 10000";

struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};
using Result = std::unique_ptr<PGresult, ClearResult>;

// PostgreSQL takes neither bytes that are not UTF-8 nor a zero; labels are read from pictures, and hold both.
std::string storable(std::string_view text) {
  std::string bytes(text);
  for (char& byte : bytes) {
    if (byte == '\0') byte = '\xff';
  }
  // What cannot be read is replaced in writing; what is escaped there, reading gives back.
  const auto plain = [](char byte) { return static_cast<unsigned char>(byte) < 0x80; };
  if (std::ranges::all_of(bytes, plain)) return bytes;
  const std::string json = task::Json(bytes).dump(-1, ' ', false, task::Json::error_handler_t::replace);
  return task::Json::parse(json).get<std::string>();
}

std::string first_line(const char* text) {
  std::string line(text);
  line.resize(std::min(line.size(), line.find('\n')));
  for (const std::string_view prefix : {"ERROR:  ", "FATAL:  "}) {
    if (line.starts_with(prefix)) line.erase(0, prefix.size());
  }
  return line;
}

class Connection {
 public:
  explicit Connection(std::string shown) : shown_(std::move(shown)) {}
  ~Connection() { PQfinish(connection_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  Expected<void> open(const std::string& uri) {
    // What stands in the URI counts more than what stands before it.
    const std::array<const char*, 8> keywords{
        "connect_timeout",  "tcp_user_timeout", "keepalives_idle", "keepalives_interval",
        "keepalives_count", "application_name", "dbname",          nullptr};
    const std::array<const char*, 8> values{"10", "10000", "5", "1", "5", "pons", uri.c_str(), nullptr};
    // libpq's own words for a URI that it cannot read may quote all of it.
    if (auto* options = PQconninfoParse(uri.c_str(), nullptr); options != nullptr) {
      PQconninfoFree(options);
    } else {
      return fail("this is no connection URI of PostgreSQL's", shown_,
                  "write postgresql://USER@HOST:PORT/DATABASE#NAME, special characters as %XX");
    }
    connection_ = PQconnectdbParams(keywords.data(), values.data(), 1);
    if (PQstatus(connection_) != CONNECTION_OK)
      return fail("the database cannot be reached: " + first_line(PQerrorMessage(connection_)), shown_,
                  "start it, or name another place for the journal");
    PQsetNoticeProcessor(connection_, [](void*, const char*) {}, nullptr);
    (void)PQsetClientEncoding(connection_, "UTF8");
    return {};
  }

  // Ends what was sent; its last result.
  Expected<Result> finish(int sent) {
    if (lost_) return std::unexpected(*lost_);
    if (sent != 1) return lose(first_line(PQerrorMessage(connection_)));
    Result last;
    for (;;) {
      while (PQisBusy(connection_) != 0) {
        pollfd socket{PQsocket(connection_), POLLIN, 0};
        const int ready = ::poll(&socket, 1, kPatience_ms);
        if (ready == 0) return lose(fmt::format("it has not answered for {} s", kPatience_ms / 1000));
        if (ready > 0 && PQconsumeInput(connection_) != 1) return lose(first_line(PQerrorMessage(connection_)));
      }
      Result next(PQgetResult(connection_));
      if (!next) break;
      const bool wrong = last && PQresultStatus(last.get()) == PGRES_FATAL_ERROR;
      if (!wrong) last = std::move(next);
    }
    if (PQstatus(connection_) != CONNECTION_OK) return lose(first_line(PQerrorMessage(connection_)));
    const ExecStatusType status = PQresultStatus(last.get());
    if (status == PGRES_FATAL_ERROR || status == PGRES_BAD_RESPONSE) return refusal(last.get());
    return last;
  }

  [[nodiscard]] PGconn* get() const { return connection_; }
  // Nothing can be asked of one that is lost: what was sent last may or may not have happened.
  [[nodiscard]] const std::optional<Error>& lost() const { return lost_; }
  std::int64_t changes = 0, inserted = 0;

 private:
  std::unexpected<Error> lose(const std::string& why) {
    lost_ = Error{"the database is gone: " + why, shown_, "start it, and try again: nothing that was told is lost"};
    return std::unexpected(*lost_);
  }

  std::unexpected<Error> refusal(const PGresult* result) {
    const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
    const std::string_view code = state == nullptr ? "" : state;
    const std::string said = first_line(PQresultErrorMessage(result));
    if (code == "55P03") return fail("something else locks the database: " + said, shown_, "end it first");
    if (code == "53100") return fail("no space is left for the journal", shown_, "free some space on its disk");
    if (code == "42501") return fail("the database does not allow this: " + said, shown_, "grant the user the right");
    if (code == "25006") return fail("the database takes no writes: " + said, shown_, "name the primary server");
    // An administrator or a crash ends it; the same again would not help.
    if (code.starts_with("57P")) return lose(said);
    return fail("the database failed: " + said, shown_, "see the server's log");
  }

  PGconn* connection_ = nullptr;
  std::string shown_;
  std::optional<Error> lost_;
};

class PostgresStatement final : public Statement::Driver {
 public:
  PostgresStatement(Connection& connection, std::string name, bool commits)
      : connection_(connection), name_(std::move(name)), commits_(commits) {}

  void bind(int parameter, std::int64_t value) override { bind(parameter, std::string_view(std::to_string(value))); }
  void bind([[maybe_unused]] int parameter, std::string_view value) override {
    values_.push_back(storable(value));
    assert(values_.size() == static_cast<std::size_t>(parameter));
  }
  Expected<bool> step() override {
    if (!rows_) {
      if (auto run = execute(); !run) return std::unexpected(run.error());
    }
    return ++row_ < PQntuples(rows_.get());
  }
  void reset() override {
    rows_.reset();
    values_.clear();
    row_ = -1;
  }
  [[nodiscard]] std::int64_t integer(int column) const override { return number(row_, column); }
  [[nodiscard]] std::string text(int column) const override {
    return {PQgetvalue(rows_.get(), row_, column), static_cast<std::size_t>(PQgetlength(rows_.get(), row_, column))};
  }
  [[nodiscard]] bool is_null(int column) const override { return PQgetisnull(rows_.get(), row_, column) == 1; }

 private:
  Expected<void> execute() {
    if (connection_.lost()) return std::unexpected(*connection_.lost());
    std::vector<const char*> values;
    for (const std::string& value : values_) values.push_back(value.c_str());
    auto result = connection_.finish(PQsendQueryPrepared(
        connection_.get(), name_.c_str(), static_cast<int>(values.size()), values.data(), nullptr, nullptr, 0));
    if (!result) return std::unexpected(result.error());
    rows_ = std::move(*result);
    // A transaction in which anything failed is taken back by its commit, without an error.
    if (commits_ && std::strcmp(PQcmdStatus(rows_.get()), "COMMIT") != 0)
      return fail("the database took back what was to be committed", {}, "start the bridge again");
    const std::string_view changed = PQcmdTuples(rows_.get());
    connection_.changes = 0;
    std::from_chars(changed.data(), changed.data() + changed.size(), connection_.changes);
    connection_.inserted = PQntuples(rows_.get()) == 1 ? number(0, 0) : 0;
    return {};
  }

  [[nodiscard]] std::int64_t number(int row, int column) const {
    std::int64_t value = 0;
    const char* text = PQgetvalue(rows_.get(), row, column);
    std::from_chars(text, text + PQgetlength(rows_.get(), row, column), value);
    return value;
  }

  Connection& connection_;
  std::string name_;
  bool commits_;
  std::vector<std::string> values_;
  Result rows_;
  int row_ = -1;
};

class PostgresDatabase final : public Database {
 public:
  PostgresDatabase(const std::string& place, std::string schema) : connection_(bridge::shown(place)) {
    shown_ = bridge::shown(place);
    schema_ = std::move(schema);
    name_ = split(place).name;
  }

  Expected<void> open(const std::string& uri, Mode mode) {
    if (auto opened = connection_.open(uri); !opened) return opened;
    if (auto good = check_server(); !good) return good;
    if (auto set = execute(kSession); !set) return set;
    if (auto set = execute(fmt::format("SET search_path TO \"{}\"", schema_)); !set) return set;
    if (mode == Mode::kRead) return execute("SET default_transaction_read_only = on");
    if (auto durable = check_durability(); !durable) return durable;
    if (mode == Mode::kTurn) return {};
    auto locked = execute(fmt::format("SELECT pg_advisory_lock(hashtextextended('{}', {}))", schema_, kLockOf));
    if (locked || connection_.lost()) return locked;
    return fail("the journal is in use by another process", shown_, "end that one, or name another bridge");
  }

  [[nodiscard]] Dialect dialect() const override { return Dialect::kPostgres; }

  Expected<Statement> prepare(std::string_view sql) override {
    if (connection_.lost()) return std::unexpected(*connection_.lost());
    std::string text(sql);
    for (std::size_t at = 0; (at = text.find('?', at)) != std::string::npos;) text[at] = '$';
    std::string name = fmt::format("s{}", ++prepared_);
    auto done = connection_.finish(PQsendPrepare(connection_.get(), name.c_str(), text.c_str(), 0, nullptr));
    if (!done) return std::unexpected(done.error());
    return Statement(std::make_unique<PostgresStatement>(connection_, std::move(name), sql == "COMMIT"));
  }

  Expected<void> execute(const std::string& sql) override {
    if (connection_.lost()) return std::unexpected(*connection_.lost());
    auto done = connection_.finish(PQsendQuery(connection_.get(), sql.c_str()));
    if (!done) return std::unexpected(done.error());
    return {};
  }

  [[nodiscard]] bool in_transaction() const override {
    const auto status = PQtransactionStatus(connection_.get());
    return !connection_.lost() && (status == PQTRANS_INTRANS || status == PQTRANS_INERROR);
  }
  [[nodiscard]] std::int64_t changes() const override { return connection_.changes; }
  [[nodiscard]] std::int64_t inserted() const override { return connection_.inserted; }

  Expected<void> promise_durability() override { return {}; }  // it would not be open
  Expected<void> still_there() override {
    return connection_.lost() ? std::unexpected(*connection_.lost()) : Expected<void>{};
  }

 private:
  Expected<void> check_server() {
    if (PQserverVersion(connection_.get()) < kOldestServer)
      return fail(fmt::format("the server is of version {}", PQserverVersion(connection_.get()) / 10000), shown_,
                  fmt::format("use version {} or later", kOldestServer / 10000));
    const char* encoding = PQparameterStatus(connection_.get(), "server_encoding");
    if (encoding == nullptr || std::string_view(encoding) != "UTF8")
      return fail(fmt::format("the database keeps text as {}", encoding == nullptr ? "nobody knows what" : encoding),
                  shown_, "make one with ENCODING 'UTF8'");
    return {};
  }

  // The session's own setting is made; these are the server's. There is no way round them: nobody could be told
  // anything.
  Expected<void> check_durability() {
    for (const char* setting : {"fsync", "full_page_writes"}) {
      const auto value = text(fmt::format("SELECT current_setting('{}')", setting));
      if (!value) return std::unexpected(value.error());
      if (*value == "on") continue;
      return fail(fmt::format("the server's {} is {}: what it commits may be lost", setting, *value), shown_,
                  fmt::format("set {} = on in its postgresql.conf", setting));
    }
    return {};
  }

  Connection connection_;
  int prepared_ = 0;
};

}  // namespace

Expected<std::unique_ptr<Database>> open_postgres(const std::string& place, const std::string& schema, Mode mode) {
  auto database = std::make_unique<PostgresDatabase>(place, schema);
  if (auto opened = database->open(split(place).connection, mode); !opened) return std::unexpected(opened.error());
  return database;
}

}  // namespace pons::bridge
