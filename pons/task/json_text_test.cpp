#include "pons/task/json_text.hpp"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <map>
#include <string>

namespace pons::task {
namespace {

std::string nested(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') + std::string(static_cast<std::size_t>(depth), ']');
}

TEST(ParseJson, GivesWhatTheTextSays) {
  const auto json = parse_json(R"({"a":[1,-2.5,"ü",null,true]})");
  ASSERT_TRUE(json);
  EXPECT_EQ(*json, (Json{{"a", {1, -2.5, "ü", nullptr, true}}}));
}

TEST(ParseJson, TakesSixteenLevelsAndRefusesMore) {
  EXPECT_TRUE(parse_json(nested(16)));
  EXPECT_EQ(parse_json(nested(17)).error().what, "nested deeper than 16 levels");
  EXPECT_FALSE(parse_json(std::string(60'000, '[')));
  std::string objects;
  for (int i = 0; i < 10'000; ++i) objects += R"({"a":)";
  EXPECT_EQ(parse_json(objects).error().what, "nested deeper than 16 levels");
}

TEST(ParseJson, RefusesOneByteTooMany) {
  const std::string full = '"' + std::string(kMaxJsonBytes - 2, 'a') + '"';
  EXPECT_TRUE(parse_json(full));
  EXPECT_EQ(parse_json(full + " ").error().what, "65537 bytes of JSON");
}

TEST(ParseJson, RefusesNamesThatComeTwice) {
  EXPECT_EQ(parse_json(R"({"id":"a","id":"b"})").error().what, "the name 'id' comes twice in one object");
  EXPECT_EQ(parse_json(R"({"id":"a","\u0069d":"b"})").error().what, "the name 'id' comes twice in one object");
  EXPECT_TRUE(parse_json(R"({"a":{"id":1},"id":2,"b":[{"id":3},{"id":4}]})"));
}

TEST(ParseJson, RefusesWhatIsNotUtf8OrNotJson) {
  for (const std::string text : {"\"\xff\"",
                                 "\"\xc0\xaf\"",
                                 "\"\xed\xa0\x80\"",
                                 "\"\xf4\x90\x80\x80\"",
                                 "\"\xe2\x82\"",
                                 "",
                                 " ",
                                 "{",
                                 "[1,]",
                                 "{\"a\":}",
                                 "nul",
                                 "NaN",
                                 "Infinity",
                                 "1 2",
                                 "[1]x",
                                 "'a'",
                                 "{a:1}",
                                 "/*c*/1",
                                 "\"\\ud800\"",
                                 "01",
                                 "+1",
                                 "\"a\nb\""}) {
    const auto json = parse_json(text);
    ASSERT_FALSE(json) << text;
    EXPECT_NE(json.error().what.find("at byte"), std::string::npos) << json.error().line();
  }
  EXPECT_FALSE(parse_json(std::string("1\0", 2)));
}

TEST(ParseJson, RefusesNumbersBeyondADouble) {
  EXPECT_EQ(parse_json("[1e999]").error().what, "number out of range at byte 6");
  EXPECT_EQ(parse_json("{\n \"id\": 1\n  'x': 2}").error().what, "not JSON in UTF-8 at byte 14, in line 3");
}

using Seen = std::map<std::string, std::string, std::less<>>;

Seen seen(std::string_view text) {
  constexpr std::array<std::string_view, 4> kPlaces = {"/op", "/task", "/task/id", "/tasks/1/id"};
  return glimpse(text, kPlaces);
}

TEST(Glimpse, SeesWhatIsAtItsPlacesOnly) {
  EXPECT_EQ(seen(R"({"x":{"op":"no"},"op":"submit","task":{"steps":[{"id":"no"},1],"id":"a"},"id":"no"})"),
            (Seen{{"/op", "submit"}, {"/task", ""}, {"/task/id", "a"}}));
  EXPECT_EQ(seen(R"({"tasks":[{"id":"a","x":[[1],{"y":2}]},{"x":{},"id":"b"},{"id":"c"}]})"),
            (Seen{{"/tasks/1/id", "b"}}));
  EXPECT_EQ(seen(R"({"task/id":"a","op":1,"op":"second"})"), (Seen{{"/op", ""}}));
  EXPECT_EQ(seen(R"(["op",{"op":"x"}])"), Seen{});
}

TEST(Glimpse, SeesAsFarAsTheTextCanBeRead) {
  EXPECT_EQ(seen(R"({"op":"submit","task":{"id":"a","steps":[)"),
            (Seen{{"/op", "submit"}, {"/task", ""}, {"/task/id", "a"}}));
  EXPECT_EQ(seen("{\"op\":\"submit\",\"task\":{\"x\":\"\xff\",\"id\":\"a\"}}"),
            (Seen{{"/op", "submit"}, {"/task", ""}}));
  EXPECT_EQ(seen(R"({"task":{"x":)" + nested(1000) + R"(,"id":"a"}})"), (Seen{{"/task", ""}, {"/task/id", "a"}}));
  EXPECT_EQ(seen(R"({"op":"a","x":")" + std::string(kMaxJsonBytes, 'x') + R"(","task":1})"), (Seen{{"/op", "a"}}));
  EXPECT_EQ(seen(std::string("{\"op\":\"a\"\0,\"task\":1}", 20)), (Seen{{"/op", "a"}}));
  for (const char* text : {"", "{", "]", "op"}) EXPECT_EQ(seen(text), Seen{}) << text;
}

TEST(NestsDeeper, CountsWhatAParserWouldOpen) {
  EXPECT_FALSE(nests_deeper("", 0));
  EXPECT_FALSE(nests_deeper("1", 0));
  EXPECT_TRUE(nests_deeper("[]", 0));
  EXPECT_FALSE(nests_deeper(R"([[],{"a":[1]},[[]]])", 3));
  EXPECT_TRUE(nests_deeper(R"([[],{"a":[1]},[[]]])", 2));
  EXPECT_FALSE(nests_deeper(R"(["[[[[","\"[[[[",{"\\":"{{{"}])", 2)) << "brackets in text open nothing";
  EXPECT_TRUE(nests_deeper(R"(["\\",[[]]])", 2)) << "nor does a backslash of its own hide a quotation mark";
  EXPECT_TRUE(nests_deeper(nested(1000), 999));
  EXPECT_FALSE(nests_deeper(nested(1000), 1000));
  EXPECT_FALSE(nests_deeper("]]]]]][", 1));
}

TEST(Excerpt, CutsBetweenCharactersAndShowsControls) {
  EXPECT_EQ(excerpt("abc"), "abc");
  EXPECT_EQ(excerpt("aüb", 2), "a…");
  EXPECT_EQ(excerpt("a\nb\x7f"), "a\\x0ab\\x7f");
  EXPECT_EQ(excerpt("a\xc2\x9b"
                    "31m\xc2\xa0é"),
            "a\\x9b31m\xc2\xa0é")
      << "CSI as one character";
}

}  // namespace
}  // namespace pons::task
