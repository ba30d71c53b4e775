// A journal as a file.
#include "pons/bridge/journal/journal.hpp"

#include "pons/bridge/journal/test_journal.hpp"

namespace pons::bridge {
namespace {

INSTANTIATE_TEST_SUITE_P(File, AnyJournal, testing::Values(&FileStore::make));

TEST_F(JournalTest, RefusesAnotherVersionAndLeavesItAlone) {
  (void)open();
  execute(file_, "PRAGMA user_version = 99");
  const std::string before = bytes(file_);
  EXPECT_NE(refusal(file_).find("this journal has version 99, this program reads version 2"), std::string::npos);
  EXPECT_EQ(bytes(file_), before);
}

TEST_F(JournalTest, RefusesWhatIsNotAJournalAndLeavesItAlone) {
  const fs::path text = folder_ / "notes.txt";
  std::ofstream(text) << std::string(5000, 'x');
  EXPECT_NE(refusal(text).find("notes.txt: this file is not a journal"), std::string::npos);
  EXPECT_EQ(bytes(text), std::string(5000, 'x'));

  const fs::path other = folder_ / "other.db";
  execute(other, "CREATE TABLE t(a); INSERT INTO t VALUES(1)");
  const std::string before = bytes(other);
  EXPECT_NE(refusal(other).find("this database is not a journal"), std::string::npos);
  EXPECT_EQ(bytes(other), before);
}

TEST_F(JournalTest, RefusesPlacesWhereNoFileCanBe) {
  EXPECT_NE(refusal(folder_ / "none/day.db").find("/none' does not exist; create it"), std::string::npos);
  std::ofstream(folder_ / "file") << "x";
  EXPECT_NE(refusal(folder_ / "file/day.db").find("/file' does not exist"), std::string::npos);
  std::filesystem::create_directory(folder_ / "sub");
  EXPECT_NE(refusal(folder_ / "sub").find("this is a folder"), std::string::npos);
  EXPECT_NE(refusal("/proc/day.db").find("cannot be opened"), std::string::npos);
}

TEST_F(JournalTest, IsNotReadBesideItsOwner) {
  const auto journal = open();
  EXPECT_FALSE(Journal::open_to_read(file_));
  fs::create_symlink(file_, folder_ / "latest.db");
  EXPECT_FALSE(Journal::open_to_read(folder_ / "latest.db"));
}

TEST_F(JournalTest, ReadingLeavesNothingBehindWhateverItIsCalled) {
  const fs::path odd = folder_ / "day #a? 100%.db";
  ASSERT_TRUE(Journal::open(odd).value()->accept(sample("a"), at(1)));
  for (int times = 0; times < 2; ++times) {
    const auto reader = Journal::open_to_read(odd);
    ASSERT_TRUE(reader) << reader.error().line();
    EXPECT_EQ((*reader)->tasks().value().size(), 1u);
    EXPECT_EQ(std::distance(fs::directory_iterator(odd.parent_path()), fs::directory_iterator{}), 1);
  }
}

TEST_F(JournalTest, WorksInMemory) {
  const auto journal = Journal::open(":memory:");
  ASSERT_TRUE(journal) << journal.error().line();
  EXPECT_EQ((*journal)->accept(sample("a"), at(1)), Accepted::kNew);
  EXPECT_EQ((*journal)->tasks().value().size(), 1u);
}

TEST_F(JournalTest, OneThatIsAbandonedLosesWhatWasPending) {
  for (const bool abandoned : {true, false}) {
    auto journal = open();
    const std::int64_t before = journal->counts().value().accepted;
    ASSERT_TRUE(journal->accept(sample(abandoned ? "a" : "c"), at(1)));
    ASSERT_TRUE(journal->commit());
    ASSERT_TRUE(journal->accept(sample(abandoned ? "b" : "d"), at(2)));
    if (abandoned) journal->abandon();
    EXPECT_EQ(journal->commit().has_value(), !abandoned);
    journal.reset();
    EXPECT_EQ(open()->counts().value().accepted, before + (abandoned ? 1 : 2));
  }
}

TEST_F(JournalTest, CompactingGivesTheDiskBackWhatItFrees) {
  {
    const auto journal = open();
    ASSERT_TRUE(journal->accept(sample("a"), at(1)));
    for (int i = 0; i < 500; ++i) ASSERT_TRUE(journal->event("a", at(2), "odd", {{"what", std::string(100, 'x')}}));
    ASSERT_TRUE(journal->outcome("a", task::Outcome::kFailed, "no", at(3)));
  }
  const auto size = fs::file_size(file_);
  EXPECT_EQ(open()->compact(0), 500);
  EXPECT_LT(fs::file_size(file_), size / 2);
}

}  // namespace
}  // namespace pons::bridge
