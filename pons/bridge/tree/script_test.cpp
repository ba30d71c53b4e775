// The scripting language: what binds to what, what fits with what, and how it says that something does not.
#include "pons/bridge/tree/script.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace pons::bridge::tree {
namespace {

class Scripts : public testing::Test {
 protected:
  // As a blackboard, which makes an entry of every name it is asked for.
  Expected<int> slot(std::string_view name) {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) {
      names_.emplace_back(name);
      return static_cast<int>(names_.size() - 1);
    }
    return static_cast<int>(found - names_.begin());
  }
  void set(std::string_view name, Value value) { ASSERT_TRUE(board_.write(*slot(name), std::move(value))); }
  [[nodiscard]] const Slot& entry(std::string_view name) { return board_[*slot(name)]; }
  Expected<Value> run(std::string_view text) {
    auto script = Script::parse(text, [this](std::string_view name) { return slot(name); });
    if (!script) return std::unexpected(script.error());
    return script->run(board_);
  }
  // The value, or the line that refuses it.
  std::string said(std::string_view text) {
    const auto value = run(text);
    if (!value) return value.error().line();
    return is_text(*value) ? fmt::format("'{}'", to_text(*value)) : to_text(*value);
  }

  std::vector<std::string> names_;
  Blackboard board_{std::vector<Slot>(64)};
};

std::string at_character(std::string_view what, int place, std::string_view script) {
  return fmt::format("{} at character {} of the script '{}'; write it as BehaviorTree.CPP's scripts are written", what,
                     place, script);
}

TEST_F(Scripts, WhatBindsTighterIsDoneFirst) {
  const std::vector<std::pair<const char*, double>> cases{
      {"2 + 3 * 4", 14},
      {"(2 + 3) * 4", 20},
      {"10 - 3 - 2", 5},
      {"24 / 4 / 2", 3},
      {"2 * 3 + 4 / 2", 8},
      {"-2 + 5", 3},
      {"2 - -3", 5},
      {"!0 + 1", 2},
      {"~0 + 2", 1},
      {"1 | 2 ^ 4", 7},
      {"6 & 3 | 8", 10},
      {"1 + 1 & 2", 2},
      {"6 ^ 3", 5},
      {"1 | 2 == 3", 1},
      {"4 & 6 == 4", 1},
      {"1 < 2 && 3 < 2", 0},
      {"0 && 0 || 1", 1},
      {"1 || 0 && 0", 1},
      {"1 ? 2 : 3", 2},
      {"0 ? 2 : 3", 3},
      {"0 ? 1 : 0 ? 2 : 3", 3},
      {"1 ? 0 ? 4 : 5 : 6", 5},
      {"1 || 0 ? 7 : 8", 7},
      {"a := 1 ? 2 : 3; a", 2},
      {"a := 1 + 1; a", 2},
      {"x := y := 4; x + y", 8},
      {"1 | 2 & 4", 1},
      {"6 | 1 ^ 3", 4},
      {"4 | 1 == 1", 0},
      {"1 == 1 | 4", 0},
      {"4 ^ 1 < 5", 0},
      {"- 2 * 3", -6},
      {"!(1 > 2)", 1},
  };
  for (const auto& [text, value] : cases) {
    const auto found = run(text);
    ASSERT_TRUE(found) << text << ": " << found.error().line();
    ASSERT_TRUE(is_number(*found)) << text;
    EXPECT_EQ(number_of(*found), value) << text;
  }
}

TEST_F(Scripts, NumbersAreOfTheirKinds) {
  EXPECT_EQ(*run("7"), Value(std::int64_t{7}));
  EXPECT_EQ(*run("0x1F"), Value(std::int64_t{31}));
  EXPECT_EQ(*run("0Xff"), Value(std::int64_t{255}));
  EXPECT_EQ(*run("9223372036854775807"), Value(INT64_MAX));
  EXPECT_EQ(*run("1.5"), Value(1.5));
  EXPECT_EQ(*run("2e3"), Value(2000.0));
  EXPECT_EQ(*run("25e-1"), Value(2.5));
  EXPECT_EQ(*run("1 + 1"), Value(2.0)) << "what is calculated is a real number";
  EXPECT_EQ(*run("true"), Value(1.0));
  EXPECT_EQ(*run("false"), Value(0.0));
  for (const char* text :
       {"0x", "0xG", "1.2.3", "1.", "12ab", "9223372036854775808", "1e", "0x8000000000000000", "1e999"})
    EXPECT_EQ(said(text), at_character("no number", 1, text));
}

TEST_F(Scripts, ComparisonsAreChained) {
  for (const char* text : {"1 < 2 < 3", "1 < 3 > 2", "3 >= 3 == 3 != 4", "1 == 1.00000001", "'a' < 'b' <= 'b'",
                           "'2' == 2", "'true' == 1", "1 <= 2 <= 2"})
    EXPECT_EQ(said(text), "1.000000") << text;
  for (const char* text : {"3 > 2 > 2", "1 < 2 < 2", "1 == 1.001", "'a' == 'b'", "2 != 2", "1 < 0 < 5"})
    EXPECT_EQ(said(text), "0.000000") << text;
  EXPECT_EQ(said("1 < 0 < nothing"), "0.000000") << "the rest is not asked";
  EXPECT_EQ(said("'x' < 1"), "text cannot be compared with a number in the script ''x' < 1'");
}

TEST_F(Scripts, TextsAreJoined) {
  EXPECT_EQ(said("'a' + 'b'"), "'ab'");
  EXPECT_EQ(said("'a' .. \"b\""), "'ab'");
  EXPECT_EQ(said("'n' .. 1"), "'n1'");
  EXPECT_EQ(said("1..'n'"), "'1n'");
  EXPECT_EQ(said("1.5 .. 'n'"), "'1.500000n'");
  EXPECT_EQ(said("''"), "''");
  EXPECT_EQ(said("\"it's\""), "'it's'");
  EXPECT_EQ(said("1 .. 2"), "two numbers cannot be joined in the script '1 .. 2'");
  EXPECT_EQ(said("'a' + 1"), "text and a number cannot be combined like that in the script ''a' + 1'");
  EXPECT_EQ(said("'a' - 'b'"), "text and text cannot be combined like that in the script ''a' - 'b''");
}

TEST_F(Scripts, EveryAssignment) {
  EXPECT_EQ(said("a := 6; a += 4; a"), "10");
  EXPECT_EQ(said("a -= 4; a"), "6");
  EXPECT_EQ(said("a *= 5; a"), "30");
  EXPECT_EQ(said("a /= 3; a"), "10");
  EXPECT_EQ(said("a = 2; a"), "2");
  EXPECT_EQ(entry("a").writes, 6);
  EXPECT_EQ(said("b := 'x'; b += 'y'; b = b .. 1; b"), "'xy1'");
  EXPECT_EQ(said(" c:=1 ;; d := 2;c+d; "), "3.000000") << "the last statement's value";
  EXPECT_EQ(said("(e := 2) + 1"), "3.000000");
}

TEST_F(Scripts, AnEntryKeepsItsKind) {
  EXPECT_EQ(said("a := 1; a = 2.5"), "'a' holds a number, and cannot take this in the script 'a := 1; a = 2.5'");
  EXPECT_EQ(said("a = 'x'"), "'a' holds a number, and cannot take this in the script 'a = 'x''");
  EXPECT_EQ(said("a := 4; a"), "4") << "nor does := change it";
  EXPECT_EQ(said("a /= 8"), "'a' holds a number, and cannot take this in the script 'a /= 8'");
  EXPECT_EQ(said("a = '2.5'; a"), "2.500000") << "a text that is a number makes it a real one";
  EXPECT_EQ(said("b := 'x'; b = 1"), "'b' holds text, and cannot take this in the script 'b := 'x'; b = 1'");
  EXPECT_EQ(said("b -= 'x'"), "text and text cannot be combined like that in the script 'b -= 'x''");
  set("list", Json{1, 2});
  EXPECT_EQ(said("list + 1"), "a list or an object and a number cannot be combined like that in the script 'list + 1'");
  EXPECT_EQ(said("list < 1"), "a list or an object cannot be compared with a number in the script 'list < 1'");
  EXPECT_EQ(said("-list"), "a list or an object has no sign and no opposite in the script '-list'");
}

TEST_F(Scripts, WhatIsNotThereIsSaid) {
  EXPECT_EQ(said("none + 1"), "there is no 'none' in the script 'none + 1'");
  EXPECT_EQ(said("none = 1"), "there is no 'none' yet (':=' makes one) in the script 'none = 1'");
  EXPECT_EQ(said("none += 1"), "there is no 'none' yet (':=' makes one) in the script 'none += 1'");
  set("unset", {});
  EXPECT_EQ(said("unset + 1"), "a variable is used that is not set in the script 'unset + 1'");
  EXPECT_EQ(said("unset == 1"), "a variable is compared that is not set in the script 'unset == 1'");
  EXPECT_EQ(said("a := unset"), "a variable is assigned that is not set in the script 'a := unset'");
  EXPECT_EQ(said("unset += 1"), "'unset' is not set in the script 'unset += 1'");
  const std::string name(100'000, 'n');
  EXPECT_LT(said(name).size(), 400U) << "however long the name";
}

TEST_F(Scripts, TruthValuesAndBitsAreOfNumbersThatFit) {
  EXPECT_EQ(said("2 && 1"), "a negative number, or an integer above 1, is no truth value in the script '2 && 1'");
  EXPECT_EQ(said("0.5 && 1"), "1.000000");
  EXPECT_EQ(said("'a' ? 1 : 2"), "text is no truth value in the script ''a' ? 1 : 2'");
  EXPECT_EQ(said("1.5 | 1"), "bits are of integers only in the script '1.5 | 1'");
  EXPECT_EQ(said("~1e300"), "a number is too large for '~' in the script '~1e300'");
  EXPECT_EQ(said("!'a'"), "text has no sign and no opposite in the script '!'a''");
  EXPECT_EQ(said("1 / 0"), "inf");
  EXPECT_EQ(said("0xFF & 0x0F | ~-2"), "15.000000");
  const auto script = Script::parse("-1", [this](std::string_view name) { return slot(name); });
  ASSERT_TRUE(script);
  const auto held = script->holds(board_);
  EXPECT_EQ(held ? "holds" : held.error().line(), "a number is no truth value in the script '-1'");
}

TEST_F(Scripts, WhatCannotBeReadIsRefusedWithItsPlace) {
  EXPECT_EQ(said(""), "the script is empty; write a statement, or leave it out");
  EXPECT_EQ(said(" \n"), "the script is empty; write a statement, or leave it out");
  EXPECT_EQ(said("a +"), at_character("a value is missing", 4, "a +"));
  EXPECT_EQ(said("(1 + 2"), at_character("')' is missing", 7, "(1 + 2"));
  EXPECT_EQ(said("1 = 2"), at_character("only a variable can be assigned to", 3, "1 = 2"));
  EXPECT_EQ(said("a + b = 2"), at_character("only a variable can be assigned to", 7, "a + b = 2"));
  EXPECT_EQ(said("1 ? 2"), at_character("':' is missing", 6, "1 ? 2"));
  EXPECT_EQ(said("'abc"), at_character("a text without its end", 1, "'abc"));
  EXPECT_EQ(said("a := )"), at_character("no value", 6, "a := )"));
  EXPECT_EQ(said("; 1"), at_character("no value", 1, "; 1"));
  EXPECT_EQ(said("a $ b"), at_character("no value", 3, "a $ b"));
  EXPECT_EQ(said("a := 1 # b"), at_character("no value", 8, "a := 1 # b"));
}

// ---- what is long or deep ----

TEST_F(Scripts, NestingIsBounded) {
  const auto in = [](std::size_t depth) { return std::string(depth, '(') + "1" + std::string(depth, ')'); };
  EXPECT_EQ(said(in(64)), "1");
  EXPECT_TRUE(said(in(65)).starts_with("too deep a nesting at character 66 of the script '((((")) << said(in(65));
  for (const char* sign : {"!", "-", "(", "a := ", "1 ? "}) {
    std::string text;
    while (text.size() < 300'000) text += sign;
    EXPECT_TRUE(said(text + "1").starts_with("too deep a nesting")) << sign;
  }
}

TEST_F(Scripts, AnExpressionIsNotAsDeepAsItIsLong) {
  for (const char* more : {" + 1", " && 1", " * 1", " | 1"}) {
    std::string text = "1";
    while (text.size() < 500'000) text += more;
    EXPECT_TRUE(said(text).starts_with("more than 256 operators in one another at character")) << said(text);
    EXPECT_FALSE(said(text.substr(0, 200 * std::string_view(more).size() + 1)).empty());
  }
  std::string sum = "1";
  for (int i = 0; i < 256; ++i) sum += "+1";
  EXPECT_EQ(said(sum), "257.000000");
  std::string chain = "1";
  while (chain.size() < 64 * 1024) chain += "<=1";
  EXPECT_EQ(said(chain), "1.000000");
}

TEST_F(Scripts, SixtyFourKilobytesAreAScript) {
  std::string text = "a := 0";
  int times = 0;
  for (; text.size() < 64 * 1024; ++times) text += "; a += 1";
  EXPECT_EQ(said(text + "; a"), fmt::to_string(times));
}

TEST_F(Scripts, ATextDoesNotGrowWithoutEnd) {
  std::string text = "s := '0123456789abcdef'";
  for (int i = 0; i < 10; ++i) text += "; s += s";
  EXPECT_EQ(said(text + "; 1"), "1");
  EXPECT_EQ(std::get<std::string>(entry("s").value).size(), kMaxTextBytes);
  EXPECT_EQ(said("s += 'x'"), "a text would have more than 16384 bytes in the script 's += 'x''");
  EXPECT_EQ(said("s .. 1"), "a text would have more than 16384 bytes in the script 's .. 1'");
}

TEST(ScriptSlots, AreReadOrWritten) {
  std::vector<std::string> names;
  const auto script = Script::parse("a := b + a; c += d; e = -f == 1 ? g : 'h'", [&](std::string_view name) {
    const auto found = std::ranges::find(names, name);
    const auto slot = static_cast<int>(found - names.begin());
    if (found == names.end()) names.emplace_back(name);
    return Expected<int>(slot);
  });
  ASSERT_TRUE(script) << script.error().line();
  const auto named = [&](const std::vector<std::int32_t>& slots) {
    std::string all;
    for (const std::int32_t slot : slots) all += names[static_cast<std::size_t>(slot)];
    return all;
  };
  EXPECT_EQ(named(script->reads()), "badfg");
  EXPECT_EQ(named(script->writes()), "ace");
}

}  // namespace
}  // namespace pons::bridge::tree
