// One order book, several bridges: each order is run by one of them and ends once.
#include "pons/bridge/journal/book.hpp"

#include <gtest/gtest.h>

#include <set>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/journal/test_journal.hpp"
#include "tests/postgres/server.hpp"

namespace pons::bridge {
namespace {

using tests::PostgresServer;

task::Task order(const std::string& id, int priority = 50, const std::string& skill = "pick") {
  return {.id = id, .priority = priority, .steps = {{skill}}};
}

constexpr Duration kAgeing = std::chrono::seconds(30);  // as a world says it

class BookTest : public testing::Test {
 protected:
  BookTest() {
    world_.resources = {{"arm"}};
    skills_.add(pick_.type());
    skills_.add(heavy_.type());
  }
  [[nodiscard]] std::string place(const std::string& name) const { return server_.place(database_, name); }
  [[nodiscard]] std::unique_ptr<Journal> open(const std::string& name) const {
    auto journal = Journal::open(place(name));
    EXPECT_TRUE(journal) << journal.error().line();
    return std::move(*journal);
  }
  [[nodiscard]] std::unique_ptr<OrderBook> book() const {
    auto opened = OrderBook::open(place(""));
    EXPECT_TRUE(opened) << opened.error().line();
    return std::move(*opened);
  }
  [[nodiscard]] OrderRecord found(const std::string& id) const {
    const auto orders = OrderBook::open_to_read(place("")).value()->orders(OrderBook::Which::kAll).value();
    const auto at = std::ranges::find(orders, id, &OrderRecord::id);
    EXPECT_NE(at, orders.end());
    return at == orders.end() ? OrderRecord{} : *at;
  }
  static std::string ids(const Expected<std::vector<Order>>& orders) {
    if (!orders) return orders.error().line();
    std::string all;
    for (const Order& one : *orders) all += one.id + " ";
    return all;
  }
  std::vector<OutcomeReport> run(Bridge& bridge, double for_s = 5) {
    std::vector<OutcomeReport> all;
    for (const Time end = now_ + from_s(for_s); now_ < end; now_ += from_s(0.01)) {
      bridge.tick(now_);
      for (OutcomeReport& report : bridge.take_outcomes()) all.push_back(std::move(report));
    }
    return all;
  }

  PostgresServer& server_ = PostgresServer::instance();
  std::string database_ = server_.make_database();
  world::World world_;
  Actor pick_{"pick", {{.ticks = 3}}};
  Actor heavy_{"heavy", {{.end = ends(Status::kException, "too heavy")}}};
  task::SkillRegistry skills_;
  Time now_;
};

TEST_F(BookTest, TakesAnOrderOnceAndNothingElseUnderItsId) {
  EXPECT_NE(OrderBook::open_to_read(place("")).error().line().find("there is no order book"), std::string::npos);
  EXPECT_NE(OrderBook::open("day.db").error().line().find("PostgreSQL"), std::string::npos);
  const auto senders = book();
  EXPECT_EQ(senders->submit(order("a")), Accepted::kNew);
  EXPECT_EQ(senders->submit(order("a")), Accepted::kAlready);
  EXPECT_EQ(book()->submit(order("a")), Accepted::kAlready) << "of another sender";
  EXPECT_EQ(senders->submit(order("a", 51)).error().what, "the id 'a' belongs to another task");
  task::Task late = order("b");
  late.deadline = at(9);
  EXPECT_NE(senders->submit(late).error().line().find("an order has no deadline"), std::string::npos);
  const auto orders = senders->orders(OrderBook::Which::kAll).value();
  ASSERT_EQ(orders.size(), 1u);
  EXPECT_EQ(orders[0].priority, 50);
  EXPECT_FALSE(orders[0].submitted.empty());
  EXPECT_TRUE(orders[0].claimed_by.empty() && !orders[0].outcome);
}

TEST_F(BookTest, EachBridgeTakesWhatNoOtherIsAboutToTakeAndWaitsForNobody) {
  const auto senders = book();
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(senders->submit(order(id)));
  ASSERT_TRUE(senders->submit(order("first", 80)));
  const auto one = open("one"), two = open("two");
  EXPECT_EQ(ids(one->claim(2, 0, kAgeing)), "first a ") << "the most important, then the oldest";
  EXPECT_EQ(ids(two->claim(9, 0, kAgeing)), "b c ") << "before the other has committed";
  EXPECT_EQ(found("a").claimed_by, "") << "nor is it so before";
  ASSERT_TRUE(one->commit() && two->commit());
  EXPECT_EQ(found("a").claimed_by, "one");
  EXPECT_EQ(found("b").claimed_by, "two");
  EXPECT_EQ(ids(one->claim(9, 0, kAgeing)) + ids(two->claim(9, 0, kAgeing)), "");
}

TEST_F(BookTest, TheOldestComesFirstOnceItHasWaitedLongEnough) {
  const auto senders = book();
  for (const int i : {1, 2}) ASSERT_TRUE(senders->submit(order("old-" + std::to_string(i), 20)));
  for (const int i : {1, 2, 3, 4}) ASSERT_TRUE(senders->submit(order("new-" + std::to_string(i), 50)));
  const auto waited = [&](int seconds) {
    ASSERT_TRUE(server_.execute(database_, "pons",
                                "UPDATE book SET submitted = now() - interval '" + std::to_string(seconds) +
                                    " s' WHERE claimed_by IS NULL AND priority = 20"));
  };
  const auto one = open("one");
  const auto takes = [&](int least) {
    const std::string taken = ids(one->claim(1, least, kAgeing));
    EXPECT_TRUE(one->commit());
    return taken;
  };
  waited(29 * 30);
  EXPECT_EQ(takes(0), "new-1 ") << "49 of 50";
  waited(32 * 30);
  EXPECT_EQ(takes(50), "new-2 ") << "when only what is urgent may come";
  EXPECT_EQ(takes(0), "old-1 ");
  EXPECT_EQ(takes(0), "old-2 ") << "the next one is the oldest now";
  EXPECT_EQ(takes(0), "new-3 ");
}

TEST_F(BookTest, TheTablesHoldThemselvesToIt) {
  const auto senders = book();
  for (const char* id : {"a", "b"}) ASSERT_TRUE(senders->submit(order(id)));
  {
    const auto journal = open("one");
    EXPECT_EQ(ids(journal->claim(1, 0, kAgeing)), "a ");
    ASSERT_TRUE(journal->accept(order("a"), at(1)));
    ASSERT_TRUE(journal->commit());
    const auto refused = [this](const std::string& sql) { return !server_.execute(database_, "pons", sql); };
    EXPECT_TRUE(refused("UPDATE book SET claimed_by = 'two' WHERE id = 'a'")) << "claimed by another";
    EXPECT_TRUE(refused("UPDATE book SET claimed_by = NULL, claimed = NULL WHERE id = 'a'"));
    EXPECT_TRUE(refused("UPDATE book SET body = '{}' WHERE id = 'b'"));
    EXPECT_TRUE(refused("UPDATE book SET outcome = 'FAILED', reason = '', ended = now() WHERE id = 'b'"))
        << "by nobody";
    EXPECT_TRUE(refused("DELETE FROM book"));
    ASSERT_TRUE(journal->outcome("a", task::Outcome::kSucceeded, "", at(2)));
    ASSERT_TRUE(journal->commit());
    EXPECT_TRUE(refused("UPDATE book SET outcome = 'FAILED' WHERE id = 'a'")) << "a second outcome";
  }
  EXPECT_EQ(found("a").outcome, task::Outcome::kSucceeded);
}

// A claim and its acceptance, an outcome and the task's last event: both or neither, whoever dies when.
TEST_F(BookTest, WhatWasNotCommittedIsNeitherInTheJournalNorInTheBook) {
  ASSERT_TRUE(book()->submit(order("a")));
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(place("one"));
    const bool done = journal && ids((*journal)->claim(1, 0, kAgeing)) == "a " && (*journal)->accept(order("a"), at(1));
    return done && journal->release() != nullptr;
  });
  {
    const auto journal = open("one");  // the one before is gone for the server, too
    EXPECT_EQ(found("a").claimed_by, "");
    EXPECT_EQ(journal->counts().value().accepted, 0);
  }
  in_a_process_that_is_killed([this] {
    auto journal = Journal::open(place("one"));
    const bool done = journal && ids((*journal)->claim(1, 0, kAgeing)) == "a " &&
                      (*journal)->accept(order("a"), at(1)) && (*journal)->commit() &&
                      (*journal)->outcome("a", task::Outcome::kFailed, "no", at(2));
    return done && journal->release() != nullptr;
  });
  EXPECT_EQ(ids(open("two")->claim(9, 0, kAgeing)), "") << "it waits for the next bridge of that name";
  const auto journal = open("one");
  EXPECT_EQ(found("a").claimed_by, "one");
  EXPECT_FALSE(found("a").outcome);
  EXPECT_EQ(journal->counts().value().open, 1);
  Bridge bridge(*journal, skills_, world_);
  ASSERT_TRUE(bridge.recover([](const task::Task&, std::size_t done) { return Resumption{.done = done}; }, now_));
  EXPECT_EQ(run(bridge).size(), 1u);
  EXPECT_EQ(found("a").outcome, task::Outcome::kSucceeded);
}

// The journal of one name, with a body that died in the middle of "a", and then with another one.
TEST_F(BookTest, OrdersThatABodyHadNotBegunAreTheNextOnesAndWhatItHadBegunHasFailed) {
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(book()->submit(order(id)));
  now_ = at(500);
  {
    const auto journal = open("one");
    Bridge bridge(*journal, skills_, world_);
    bridge.tick(now_);
    ASSERT_EQ(bridge.running(), std::vector<std::string>{"a"});
    ASSERT_TRUE(bridge.submit(R"({"id":"direct","steps":[{"skill":"pick"}]})", now_));
    ASSERT_TRUE(journal->commit());
    journal->abandon();
  }
  EXPECT_EQ(ids(open("two")->claim(9, 0, kAgeing)), "") << "they wait for the next bridge of that name";
  now_ = at(0.1);
  pick_.log.started.clear();
  const auto journal = open("one");
  EXPECT_EQ(journal->claimed(), (std::set<std::string>{"a", "b", "c"}));
  ASSERT_TRUE(end_with_body(*journal, now_));
  ASSERT_TRUE(end_with_body(*journal, now_)) << "once more has nothing to end";
  Bridge bridge(*journal, skills_, world_);
  const auto look = [](const task::Task& task, std::size_t done) {
    ADD_FAILURE() << task.id << " was begun with another body";
    return Resumption{.done = done};
  };
  ASSERT_TRUE(bridge.recover(look, now_));
  EXPECT_EQ(run(bridge).size(), 2u);
  EXPECT_EQ(pick_.log.started.size(), 2u);
  EXPECT_EQ(found("a").outcome, task::Outcome::kFailed);
  EXPECT_EQ(found("a").reason, "its body is gone");
  EXPECT_EQ(found("b").outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(found("c").outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(journal->record("direct").value()->outcome->reason, "its body is gone") << "it was that body's alone";
  const auto story = journal->history("b").value();
  for (const Event& event : story)
    EXPECT_GE(event.detail.value("waited_s", 0.0), 0.0) << "in the time of a run that is over";
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
}

TEST_F(BookTest, ABridgeTakesOrdersWhileItHasLittleToDoAndTellsHowTheyEnd) {
  const auto senders = book();
  for (int i = 0; i < 9; ++i) ASSERT_TRUE(senders->submit(order(fmt::format("t{}", i))));
  ASSERT_TRUE(senders->submit(order("heavy", 90, "heavy")));
  const auto journal = open("one");
  Bridge bridge(*journal, skills_, world_);
  bridge.hold(Bridge::Hold::kOn);
  EXPECT_TRUE(run(bridge).empty());
  EXPECT_EQ(found("t0").claimed_by, "") << "a robot that stands takes none";
  bridge.hold(Bridge::Hold::kOff);
  bridge.tick(now_);
  EXPECT_EQ(found("t2").claimed_by, "one");
  EXPECT_EQ(found("t3").claimed_by, "") << "no more than four at once";
  const auto outcomes = run(bridge);
  EXPECT_EQ(outcomes.size(), 10u);
  EXPECT_EQ(found("heavy").outcome, task::Outcome::kException);
  EXPECT_EQ(found("heavy").reason, "too heavy");
  EXPECT_TRUE(senders->orders(OrderBook::Which::kOpen).value().empty());
  EXPECT_EQ(senders->orders(OrderBook::Which::kAll).value().size(), 10u);
  EXPECT_EQ(pick_.log.started.size(), 9u);
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
  // Looking costs little, and is not done in every tick.
  ASSERT_TRUE(senders->submit(order("later")));
  bridge.tick(now_ - from_s(0.005));
  EXPECT_EQ(found("later").claimed_by, "");
  bridge.stop(now_, "enough");
  EXPECT_TRUE(run(bridge).empty());
  EXPECT_EQ(found("later").claimed_by, "") << "nor does one that stops";
}

TEST_F(BookTest, AnUrgentOrderWaitsForNoRoom) {
  const auto senders = book();
  Actor patrol("patrol", {{.ticks = 1'000'000}});
  skills_.add(patrol.type());
  const auto journal = open("one");
  Bridge bridge(*journal, skills_, world_);
  for (int i = 0; i < 6; ++i)
    ASSERT_TRUE(bridge.submit(fmt::format(R"({{"id":"own{}","steps":[{{"skill":"patrol"}}]}})", i), now_));
  bridge.tick(now_);
  for (int i = 0; i < 9; ++i) ASSERT_TRUE(senders->submit(order(fmt::format("urgent{}", i), 95)));
  ASSERT_TRUE(senders->submit(order("usual")));
  run(bridge, 0.2);
  EXPECT_EQ(found("urgent0").outcome, task::Outcome::kSucceeded) << "it was preempted for it";
  EXPECT_EQ(found("urgent8").claimed_by, "") << "of those, too, no more than four at once";
  run(bridge);
  EXPECT_EQ(found("urgent8").outcome, task::Outcome::kSucceeded);
  EXPECT_EQ(found("usual").claimed_by, "") << "there is no room for it";
}

// People may be long in coming.
TEST_F(BookTest, WhatAsksAPersonKeepsNoOtherOut) {
  const world::Review review{.tiers = {"operator"},
                             .rules = {{.name = "all of it", .skills = {"heavy"}, .approve = "operator"}}};
  const auto senders = book();
  for (int i = 0; i < 80; ++i) ASSERT_TRUE(senders->submit(order(fmt::format("asks{}", i), 60, "heavy")));
  const auto journal = open("one");
  Bridge bridge(*journal, skills_, world_);
  const task::Facts facts;
  bridge.use_rules(Rules::compile(review, skills_, facts).value(), Contradictions(review.contradictions));
  run(bridge);
  EXPECT_EQ(bridge.parked().size(), 64u) << "nor does one bridge take all";
  for (const std::string& id : std::set<std::string>(bridge.parked()))
    ASSERT_TRUE(bridge.cancel(id, now_, "nobody comes"));
  run(bridge);
  EXPECT_EQ(bridge.parked().size(), 16u);
  ASSERT_TRUE(senders->submit(order("usual")));
  run(bridge);
  EXPECT_EQ(found("usual").outcome, task::Outcome::kSucceeded);
}

TEST_F(BookTest, WhatTheBridgeRefusesFailsWithTheReason) {
  const auto senders = book();
  ASSERT_TRUE(senders->submit(order("odd", 50, "fly")));
  ASSERT_TRUE(senders->submit(order("mine", 70)));
  ASSERT_TRUE(senders->submit(order("same")));
  const auto journal = open("one");
  Bridge bridge(*journal, skills_, world_);
  // The same ids came to this bridge itself before.
  ASSERT_TRUE(journal->accept(order("mine"), now_));
  ASSERT_TRUE(journal->accept(order("same"), now_));
  ASSERT_TRUE(journal->outcome("same", task::Outcome::kCancelled, "not wanted", now_));
  run(bridge, 0.05);
  EXPECT_EQ(found("odd").outcome, task::Outcome::kFailed);
  EXPECT_NE(found("odd").reason.find("there is no skill 'fly'"), std::string::npos);
  EXPECT_EQ(found("mine").reason, "/id: the id 'mine' belongs to another task; choose an id that was never used");
  EXPECT_EQ(found("same").outcome, task::Outcome::kCancelled);
  EXPECT_EQ(found("same").reason, "not wanted");
  const auto told = journal->history("odd").value();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].kind, "refused");
  EXPECT_EQ(audit(*journal), std::vector<std::string>{});
}

TEST_F(BookTest, ABookThatVanishesIsAFaultOfTheBridge) {
  const auto senders = book();
  const auto journal = open("one");
  Bridge bridge(*journal, skills_, world_);
  run(bridge, 0.2);
  server_.stop();
  const auto refused = senders->submit(order("a"));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().line().find("the database is gone"), std::string::npos);
  EXPECT_TRUE(run(bridge, 0.2).empty());
  ASSERT_TRUE(bridge.fault());
  EXPECT_NE(bridge.fault()->line().find("the database is gone"), std::string::npos);
  server_.start();
  EXPECT_EQ(book()->submit(order("a")), Accepted::kNew);
}

}  // namespace
}  // namespace pons::bridge
