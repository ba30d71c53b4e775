#include "tests/postgres/server.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <libpq-fe.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace pons::tests {
namespace {

namespace fs = std::filesystem;

// Whom root hands the server to; nobody where it is not root who asks.
const passwd* other_user() {
  if (::geteuid() != 0) return nullptr;
  for (const char* name : {"postgres", "nobody"}) {
    if (const passwd* user = ::getpwnam(name); user != nullptr) return user;
  }
  throw std::runtime_error("PostgreSQL does not run as root, and there is no other user");
}

struct Child {
  pid_t process;
  int words;  // what it says, to read
};

// In `folder`, as the other user; it ends with this program, however that ends.
Child run_in(const fs::path& folder, std::vector<std::string> command) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const passwd* user = other_user();
  std::vector<char*> arguments;
  command.front() = fs::path(PONS_POSTGRES_BIN) / command.front();
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    if (user != nullptr && (::setgroups(0, nullptr) != 0 || ::setgid(user->pw_gid) != 0 || ::setuid(user->pw_uid) != 0))
      ::_exit(126);
    ::prctl(PR_SET_PDEATHSIG, SIGQUIT);
    ::setenv("LC_ALL", "C", 1);
    // Who does not read on must not hold it up.
    (void)::fcntl(ends[1], F_SETFL, O_NONBLOCK);
    ::dup2(ends[1], 1);
    ::dup2(ends[1], 2);
    if (::chdir(folder.c_str()) != 0) ::_exit(126);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(ends[1]);
  return {child, ends[0]};
}

// Until it says `until`, or no more; what it has said.
std::string listen(int words, const std::string& until) {
  std::string said;
  char byte = 0;
  while (said.find(until) == std::string::npos && ::read(words, &byte, 1) == 1) said += byte;
  return said;
}

struct Connection {
  explicit Connection(const std::string& place) : connection(PQconnectdb(place.c_str())) {
    if (PQstatus(connection) != CONNECTION_OK) throw std::runtime_error(PQerrorMessage(connection));
    PQsetNoticeProcessor(connection, [](void*, const char*) {}, nullptr);
  }
  ~Connection() { PQfinish(connection); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  PGconn* connection;
};

}  // namespace

PostgresServer::PostgresServer(const fs::path& in) {
  std::string name = (in / "pons-pg-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  folder_ = name;
  try {
    initialise();
    start();
  } catch (...) {
    fs::remove_all(folder_);
    throw;
  }
}

PostgresServer::~PostgresServer() {
  stop();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

PostgresServer& PostgresServer::instance() {
  static PostgresServer server(fs::temp_directory_path());
  return server;
}

void PostgresServer::initialise() {
  std::ofstream(folder_ / "password") << kPassword << '\n';
  if (const passwd* user = other_user(); user != nullptr) {
    if (::chown(folder_.c_str(), user->pw_uid, user->pw_gid) != 0) throw std::runtime_error("cannot hand it over");
  }
  const Child made = run_in(folder_, {"initdb", "-D", "data", "-U", "pons", "-E", "UTF8", "--locale=C",
                                      "--auth=scram-sha-256", "--pwfile=password", "--no-sync", "--no-instructions"});
  const std::string said = listen(made.words, "\x01");
  ::close(made.words);
  int status = 0;
  ::waitpid(made.process, &status, 0);
  if (status != 0) throw std::runtime_error("initdb: " + said);
}

void PostgresServer::start(const std::string& settings) {
  std::vector<std::string> command{"postgres",
                                   "-D",
                                   "data",
                                   "-k",
                                   folder_.string(),
                                   "-c",
                                   "listen_addresses=",
                                   "-c",
                                   "log_min_messages=log",
                                   "-c",
                                   "log_checkpoints=off",
                                   "-c",
                                   "max_connections=30",
                                   "-c",
                                   "shared_buffers=16MB"};
  if (!settings.empty()) command.insert(command.end(), {"-c", settings});
  const Child child = run_in(folder_, std::move(command));
  server_ = child.process;
  const std::string ready = "ready to accept connections";
  const std::string said = listen(child.words, ready);
  // From here on nobody listens: the server goes on without its words.
  if (said.find(ready) != std::string::npos) {
    static std::vector<int> kept;  // closed, each word would be a signal to it
    kept.push_back(child.words);
    return;
  }
  ::close(child.words);
  stop();
  throw std::runtime_error("postgres: " + said);
}

void PostgresServer::stop() {
  if (server_ < 0) return;
  ::kill(server_, SIGQUIT);
  ::waitpid(server_, nullptr, 0);
  server_ = -1;
}

std::string PostgresServer::make_database() {
  std::string name = fmt::format("test_{}", ++databases_);
  (void)execute("postgres", "public", "CREATE DATABASE " + name);
  return name;
}

std::string PostgresServer::place(const std::string& database, const std::string& name) const {
  std::string host;
  for (const char letter : folder_.string()) host += letter == '/' ? "%2F" : std::string(1, letter);
  return fmt::format("postgresql://pons:{}@{}/{}{}{}", kPassword, host, database, name.empty() ? "" : "#", name);
}

bool PostgresServer::execute(const std::string& database, const std::string& schema, const std::string& sql) const {
  const Connection there(place(database));
  PQclear(PQexec(there.connection, fmt::format("SET search_path TO \"{}\"", schema).c_str()));
  PGresult* result = PQexec(there.connection, sql.c_str());
  const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const std::string code = state == nullptr ? "" : state;
  // Of constraints, and of types.
  const bool refused = code.starts_with("23") || code.starts_with("22");
  const std::string said = PQresultErrorMessage(result);
  PQclear(result);
  if (!code.empty() && !refused) throw std::runtime_error(said);
  return code.empty();
}

std::string PostgresServer::ask(const std::string& database, const std::string& sql) const {
  const Connection there(place(database));
  PGresult* result = PQexec(there.connection, sql.c_str());
  std::string answer = PQntuples(result) == 0 ? "" : PQgetvalue(result, 0, 0);
  const std::string said = PQresultErrorMessage(result);
  PQclear(result);
  if (!said.empty()) throw std::runtime_error(said);
  return answer;
}

}  // namespace pons::tests
