// Debian's PostgreSQL for a test program or a benchmark: a cluster of its own in a folder that goes away, reached by a
// socket in there and by no network. Run by root it is another user's, since PostgreSQL refuses root. No cluster of the
// system's is touched.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

namespace pons::tests {

class PostgresServer {
 public:
  // Made in a folder of its own below `in`, and started. This and all below throws std::runtime_error with the server's
  // own words where it fails.
  explicit PostgresServer(const std::filesystem::path& in);
  // Ends it, and all that it left.
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;
  // This test program's one.
  static PostgresServer& instance();

  // `settings` as on its command line: "fsync=off". Returns when it takes connections.
  void start(const std::string& settings = "");
  // At once, as a fault would: it has to recover when it is started again. Returns when it is gone.
  void stop();

  // A new database, by its name.
  [[nodiscard]] std::string make_database();
  // As libpq and Pons take it; `name`, if any, is a bridge's.
  [[nodiscard]] std::string place(const std::string& database, const std::string& name = "") const;
  // Runs it there, in the schema `schema`. False: a constraint refuses it.
  [[nodiscard]] bool execute(const std::string& database, const std::string& schema, const std::string& sql) const;
  // The first column of the first row.
  [[nodiscard]] std::string ask(const std::string& database, const std::string& sql) const;

  // In whatever a person is shown, this must not be.
  static constexpr const char* kPassword = "open-sesame-7";

 private:
  void initialise();

  std::filesystem::path folder_;
  pid_t server_ = -1;
  int databases_ = 0;
};

}  // namespace pons::tests
