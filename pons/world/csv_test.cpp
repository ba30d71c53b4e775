#include "pons/world/csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pons/world/test_folder.hpp"

namespace pons::world {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Records = std::vector<std::vector<std::string>>;

Expected<Records> read_all(const std::filesystem::path& file) {
  auto reader = CsvReader::open(file);
  if (!reader) return std::unexpected(reader.error());
  Records records;
  std::vector<std::string> fields;
  while (true) {
    const auto more = reader->next(fields);
    if (!more) return std::unexpected(more.error());
    if (!*more) return records;
    records.push_back(fields);
  }
}

class Csv : public ::testing::Test {
 protected:
  Records records(std::string_view text) {
    auto read = read_all(folder_.write("a.csv", text));
    EXPECT_TRUE(read) << read.error().line();
    return read.value_or(Records{});
  }
  std::string error(std::string_view text) {
    const auto read = read_all(folder_.write("a.csv", text));
    return read ? "no error" : read.error().line();
  }

  TestFolder folder_;
};

TEST_F(Csv, ReadsLineEndsMarkAndEmptyLines) {
  EXPECT_THAT(records("\xEF\xBB\xBF"
                      "a,b\r\n\r\n1,2\n\n3,"),
              ElementsAre(ElementsAre("a", "b"), ElementsAre("1", "2"), ElementsAre("3", "")));
  EXPECT_THAT(records(""), ElementsAre());
  EXPECT_THAT(records("\xEF\xBB\xBF"), ElementsAre());
}

TEST_F(Csv, ReadsQuotedFields) {
  EXPECT_THAT(records("\"a,\"\"b\"\"\",\"two\nlines\"\nc,\"\"\n"),
              ElementsAre(ElementsAre("a,\"b\"", "two\nlines"), ElementsAre("c", "")));
}

TEST_F(Csv, CountsLinesInsideQuotes) {
  auto reader = CsvReader::open(folder_.write("a.csv", "\"x\ny\"\n\nz\n"));
  ASSERT_TRUE(reader);
  std::vector<std::string> fields;
  ASSERT_TRUE(reader->next(fields).value_or(false));
  EXPECT_EQ(reader->line(), 1U);
  ASSERT_TRUE(reader->next(fields).value_or(false));
  EXPECT_EQ(reader->line(), 4U);
}

TEST_F(Csv, ReadsAcrossBufferBorders) {
  std::string text;
  for (int i = 0; i < 30000; ++i) text += "abc,\"d\"\"e\"\r\n";
  const Records read = records(text);
  ASSERT_EQ(read.size(), 30000U);
  for (const auto& fields : read) ASSERT_THAT(fields, ElementsAre("abc", "d\"e"));
}

TEST_F(Csv, RefusesBrokenQuotesAndLineEnds) {
  EXPECT_THAT(error("a\nb,\"c\n"), HasSubstr("a.csv:2: a quote is opened and never closed"));
  EXPECT_THAT(error("\"a\"b\n"), HasSubstr("a.csv:1: text follows a closing quote"));
  EXPECT_THAT(error("a\"b\n"), HasSubstr("a.csv:1: a quote stands inside a field"));
  EXPECT_THAT(error("a\rb\n"), HasSubstr("a.csv:1: a carriage return without a line feed"));
}

TEST_F(Csv, RefusesWhatIsNotUtf8) {
  EXPECT_THAT(error("a\nM\xFCnchen\n"), HasSubstr("a.csv:2: the text is not UTF-8; save the file as UTF-8"));
  EXPECT_THAT(error(std::string_view("\xFF\xFE"
                                     "a\0,\0",
                                     6)),
              HasSubstr("is UTF-16"));
  EXPECT_THAT(error(std::string_view("a\0b", 3)), HasSubstr("not UTF-8"));
}

TEST_F(Csv, KnowsUtf8) {
  for (const auto* good : {"", "a", "é", "€", "𝄞", "\xF4\x8F\xBF\xBF"}) EXPECT_TRUE(is_utf8(good)) << good;
  for (const auto* bad : {"\x80", "\xC0\xAF", "\xC2", "\xE0\x80\x80", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
                          "\xF4\x90\x80\x80", "\xE2\x82"}) {
    EXPECT_FALSE(is_utf8(bad)) << testing::PrintToString(bad);
  }
}

TEST_F(Csv, PrintsHostileTextOnOneShortLine) {
  EXPECT_EQ(printable("a\n\x1b[31m\xFF é"), "a??[31m? é");
  EXPECT_LE(printable(std::string(1000, 'x')).size(), 64U);
}

// The reader must give up at its ceiling, not after the whole line: the rest of this one is a hole of 100 MB in the
// file.
TEST_F(Csv, RefusesALongLineWithoutReadingItAll) {
  for (const std::string_view begin : {"a,b\n", "a,b\n\"", "a,b\n,,,"}) {
    const auto file = folder_.write("long.csv", std::string(begin) + std::string(2 << 20, 'x'));
    std::filesystem::resize_file(file, 100'000'000);
    const auto read = read_all(file);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().line(), HasSubstr("long.csv:2: the line is longer than 1 MiB"));
  }
  EXPECT_THAT(error(std::string(2 << 20, ',')), HasSubstr("a.csv:1: the line is longer than 1 MiB"));
}

TEST_F(Csv, RefusesWhatIsNoFile) {
  EXPECT_THAT(read_all("/nowhere/a.csv").error().line(), HasSubstr("/nowhere/a.csv: there is no such file"));
  EXPECT_THAT(read_all(folder_.path()).error().line(), HasSubstr("is not a plain file"));
}

}  // namespace
}  // namespace pons::world
