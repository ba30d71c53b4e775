// What every journal does, in a database; and what only one there does.
#include <gtest/gtest.h>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/journal/postgres.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/journal/test_journal.hpp"
#include "tests/postgres/server.hpp"

namespace pons::bridge {
namespace {

using tests::PostgresServer;

class DatabaseStore final : public Store {
 public:
  [[nodiscard]] static std::unique_ptr<Store> make() { return std::make_unique<DatabaseStore>(); }
  [[nodiscard]] std::string place() const override { return PostgresServer::instance().place("postgres", name_); }
  [[nodiscard]] bool execute(const std::string& sql) override {
    return PostgresServer::instance().execute("postgres", "pons_" + name_, sql);
  }
  [[nodiscard]] std::string another_version() const override {
    return fmt::format("COMMENT ON SCHEMA pons_{} IS 'Pons journal, version 99'", name_);
  }
  [[nodiscard]] std::string unguarded() const override { return "DROP TRIGGER event_stays ON event"; }

 private:
  static std::string next() {
    static int stores = 0;
    return fmt::format("cell_{}", ++stores);
  }
  std::string name_ = next();
};

INSTANTIATE_TEST_SUITE_P(Postgres, AnyJournal, testing::Values(&DatabaseStore::make));

class OnPostgres : public testing::Test {
 protected:
  [[nodiscard]] std::string place(const std::string& name = "cell") const { return server_.place(database_, name); }
  [[nodiscard]] std::unique_ptr<Journal> open(const std::string& name = "cell") const {
    auto journal = Journal::open(place(name));
    EXPECT_TRUE(journal) << journal.error().line();
    return std::move(*journal);
  }
  static std::string refusal(const std::string& where) {
    const auto journal = Journal::open(where);
    EXPECT_FALSE(journal);
    const std::string line = journal ? "" : journal.error().line();
    EXPECT_EQ(line.find(PostgresServer::kPassword), std::string::npos) << line;
    return line;
  }

  PostgresServer& server_ = PostgresServer::instance();
  std::string database_ = server_.make_database();
};

TEST_F(OnPostgres, SeveralBridgesHaveAJournalEach) {
  const auto one = open("one"), two = open("two");
  EXPECT_EQ(one->accept(sample("a"), at(1)), Accepted::kNew);
  EXPECT_EQ(two->accept(sample("a", 51), at(1)), Accepted::kNew);
  ASSERT_TRUE(one->commit() && two->commit());
  EXPECT_EQ(one->counts().value().accepted, 1);
  EXPECT_EQ(audit(*two), std::vector<std::string>{});
}

TEST_F(OnPostgres, IsReadBesideItsOwner) {
  const auto owner = open();
  ASSERT_TRUE(owner->accept(sample("a"), at(1)) && owner->commit());
  ASSERT_TRUE(owner->accept(sample("b"), at(1)));
  const auto reader = Journal::open_to_read(place());
  ASSERT_TRUE(reader) << reader.error().line();
  EXPECT_EQ((*reader)->tasks().value().size(), 1u) << "as of the last commit";
}

TEST_F(OnPostgres, AnOwnerThatWasKilledIsFollowedAtOnce) {
  for (int times = 1; times < 6; ++times) {
    in_a_process_that_is_killed([this, times] {
      auto journal = Journal::open(place());
      return journal && (*journal)->run() == times && journal->release() != nullptr;
    });
  }
  EXPECT_EQ(open()->run(), 6);
}

TEST_F(OnPostgres, RefusesAServerThatLosesWhatItCommits) {
  server_.stop();
  server_.start("fsync=off");
  EXPECT_NE(refusal(place()).find("the server's fsync is off"), std::string::npos);
  server_.stop();
  server_.start("full_page_writes=off");
  EXPECT_NE(refusal(place()).find("the server's full_page_writes is off"), std::string::npos);
  server_.stop();
  server_.start();
  EXPECT_EQ(server_.ask(database_, "SELECT count(*) FROM pg_namespace WHERE nspname LIKE 'pons%'"), "0");
  EXPECT_EQ(open()->run(), 1);
}

TEST_F(OnPostgres, RefusesWhatIsAnotherPrograms) {
  ASSERT_TRUE(server_.execute(database_, "public", "CREATE SCHEMA pons_cell; CREATE TABLE pons_cell.run(id BIGINT)"));
  EXPECT_NE(refusal(place()).find("the schema 'pons_cell' is another program's"), std::string::npos);
  EXPECT_EQ(server_.ask(database_,
                        "SELECT count(*) FROM pg_class c JOIN pg_namespace n ON n.oid = relnamespace WHERE "
                        "nspname = 'pons_cell'"),
            "1")
      << "left alone";
  ASSERT_TRUE(server_.execute(database_, "public", "CREATE SCHEMA pons_given"));
  EXPECT_EQ(open("given")->run(), 1) << "an empty one, as an administrator gives it";
  ASSERT_TRUE(server_.execute(database_, "public", "COMMENT ON SCHEMA pons IS 'Pons order book, version 7'"));
  EXPECT_NE(refusal(place("other")).find("this order book has version 7, this program reads version 1"),
            std::string::npos);
}

TEST_F(OnPostgres, RefusesPlacesWhereNoneCanBe) {
  EXPECT_NE(refusal(server_.place(database_)).find("no bridge is named"), std::string::npos);
  for (const char* name : {"Cell", "a-b", "a\"; DROP SCHEMA pons; --", "a12345678901234567890123456789012345678901"})
    EXPECT_NE(refusal(place(name)).find("no name that a bridge can have"), std::string::npos) << name;
  EXPECT_NE(refusal(server_.place("none", "cell")).find("database \"none\" does not exist"), std::string::npos);
  std::string wrong = place();
  wrong.replace(wrong.find(PostgresServer::kPassword), 4, "shut");
  EXPECT_NE(refusal(wrong).find("password authentication failed"), std::string::npos);
  const std::string odd = fmt::format("postgresql://pons:{}@[/postgres#cell", PostgresServer::kPassword);
  EXPECT_NE(refusal(odd).find("postgresql://…: this is no connection URI"), std::string::npos);
}

TEST_F(OnPostgres, AGuardThatIsGoneIsDamage) {
  (void)open();
  ASSERT_TRUE(server_.execute(database_, "pons_cell", "DROP INDEX one_end"));
  const auto wrong = audit(*open());
  ASSERT_EQ(wrong.size(), 1u);
  EXPECT_NE(wrong[0].find("damaged"), std::string::npos);
}

// Whoever asks hears what is wrong, and of nothing that is not durable.
TEST_F(OnPostgres, AServerThatVanishesIsSaidAndNothingIsLost) {
  world::World world;
  world.resources = {{"arm"}};
  Actor pick("pick", {{.ticks = 5}});
  task::SkillRegistry skills;
  skills.add(pick.type());
  const auto submit = [](Bridge& bridge, const std::string& id) {
    return bridge.submit(fmt::format(R"({{"id":"{}","steps":[{{"skill":"pick"}}]}})", id), at(1));
  };
  {
    const auto journal = open();
    Bridge bridge(*journal, skills, world);
    ASSERT_TRUE(submit(bridge, "told"));
    ASSERT_TRUE(bridge.commit(at(1)));
    ASSERT_TRUE(submit(bridge, "untold"));
    ASSERT_TRUE(bridge.unkept());
    server_.stop();
    const auto kept = bridge.commit(at(1));
    ASSERT_FALSE(kept);
    EXPECT_NE(kept.error().line().find("the database is gone"), std::string::npos) << kept.error().line();
    EXPECT_EQ(kept.error().line().find(PostgresServer::kPassword), std::string::npos);
    EXPECT_NE(submit(bridge, "after").error().line().find("the database is gone"), std::string::npos);
    for (int i = 0; i < 9; ++i) bridge.tick(at(1 + 0.01 * i));
    EXPECT_TRUE(bridge.fault());
    EXPECT_TRUE(bridge.take_outcomes().empty());
    EXPECT_TRUE(pick.log.started.empty()) << "nothing moves that the journal does not know of";
    EXPECT_NE(refusal(place()).find("cannot be reached"), std::string::npos);
    server_.start();
    EXPECT_FALSE(bridge.commit(at(2))) << "opened anew, or not at all";
  }
  const auto journal = open();
  ASSERT_EQ(journal->tasks().value().size(), 1u);
  Bridge bridge(*journal, skills, world);
  ASSERT_TRUE(bridge.recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, at(1)));
  EXPECT_EQ(submit(bridge, "told")->accepted, Accepted::kAlready);
  EXPECT_EQ(submit(bridge, "untold")->accepted, Accepted::kNew);
  for (int i = 0; i < 100 && !bridge.idle(); ++i) bridge.tick(at(1 + 0.01 * i));
  EXPECT_EQ(journal->counts().value().succeeded, 2);
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
}

// As a server does whose disk hangs.
TEST_F(OnPostgres, AServerThatSaysNothingIsGoneToo) {
  const auto journal = open();
  ASSERT_TRUE(journal->accept(sample("a"), at(1)));
  const pid_t backend = std::stoi(server_.ask(
      database_,
      fmt::format("SELECT pid FROM pg_stat_activity WHERE datname = '{}' AND application_name = 'pons'", database_)));
  ASSERT_EQ(::kill(backend, SIGSTOP), 0);
  EXPECT_NE(journal->commit().error().line().find("it has not answered for 10 s"), std::string::npos);
  EXPECT_FALSE(journal->accept(sample("b"), at(1)));
  ::kill(backend, SIGCONT);
}

TEST_F(OnPostgres, WhatItTookBackWhenAReadFoundItGoneIsNotCommitted) {
  const auto journal = open();
  ASSERT_TRUE(journal->accept(sample("pending"), at(1)));
  server_.stop();
  ASSERT_FALSE(journal->history("pending"));
  const auto kept = journal->commit();
  ASSERT_FALSE(kept);
  EXPECT_NE(kept.error().line().find("the database is gone"), std::string::npos) << kept.error().line();
  server_.start();
  EXPECT_FALSE(journal->commit());
}

// After any failure in it PostgreSQL takes a transaction back, and tells who commits it so in its answer only.
TEST_F(OnPostgres, ACommitThatTookEverythingBackIsAFailure) {
  const auto database = open_postgres(place(), "pons_cell", Mode::kOwn);
  ASSERT_TRUE(database) << database.error().line();
  auto commit = (*database)->prepare("COMMIT");
  ASSERT_TRUE(commit);
  ASSERT_TRUE((*database)->execute("BEGIN; SELECT 1"));
  EXPECT_TRUE(commit->run());
  ASSERT_TRUE((*database)->execute("BEGIN"));
  ASSERT_FALSE((*database)->execute("SELECT 1/0"));
  ASSERT_TRUE((*database)->in_transaction());
  EXPECT_NE(commit->run().error().what.find("took back"), std::string::npos);
  EXPECT_FALSE((*database)->in_transaction());
}

TEST(Place, ShowsNoPassword) {
  EXPECT_EQ(shown("day.db"), "day.db");
  EXPECT_EQ(shown("postgres://me:secret@host:5433/db#cell"), "postgresql://me@host:5433/db#cell");
  EXPECT_EQ(shown("postgresql://host/db?user=me&password=secret#cell"), "postgresql://me@host/db#cell");
  EXPECT_EQ(shown("postgresql://me:secret@host:port:x/db?nonsense#cell"), "postgresql://…");
  EXPECT_EQ(named("postgresql://host/db", "cell"), "postgresql://host/db#cell");
  EXPECT_EQ(named("postgresql://host/db#mine", "cell"), "postgresql://host/db#mine");
  EXPECT_EQ(named("day#1.db", "cell"), "day#1.db");
}

}  // namespace
}  // namespace pons::bridge
