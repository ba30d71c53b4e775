#include "pons/task/schema.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace pons::task {
namespace {

Schema compiled(std::string_view text) { return Schema::compile(Json::parse(text)).value(); }

TEST(Schema, RefusesKeywordsItDoesNotCheck) {
  for (const std::string_view text :
       {R"({"oneOf":[]})", R"({"properties":{"a":{"format":"date"}}})", R"({"items":{"not":{}}})", R"({"$ref":"#"})"}) {
    const auto schema = Schema::compile(Json::parse(text));
    ASSERT_FALSE(schema) << text;
    EXPECT_NE(schema.error().what.find("not supported"), std::string::npos) << schema.error().line();
  }
  EXPECT_EQ(Schema::compile(Json::parse(R"({"properties":{"a/b":{"format":1}}})")).error().where,
            "schema/properties/a~1b/format");
}

TEST(Schema, RefusesKeywordsOfTheWrongShape) {
  for (const std::string_view text :
       {"1", "[]", R"({"type":"text"})", R"({"type":3})", R"({"required":"a"})", R"({"enum":[]})", R"({"minimum":"1"})",
        R"({"maxLength":-1})", R"({"minItems":1.5})", R"({"additionalProperties":{}})", R"({"properties":[]})",
        R"({"pattern":"(","maxLength":5})", R"({"pattern":"a"})", R"({"pattern":"a","maxLength":2000})",
        R"({"items":[]})"}) {
    EXPECT_FALSE(Schema::compile(Json::parse(text))) << text;
  }
}

TEST(Schema, RefusesASchemaWithoutEnd) {
  Json schema = Json::object();
  for (int i = 0; i < 40; ++i) schema = Json{{"items", schema}};
  EXPECT_FALSE(Schema::compile(schema));
}

TEST(Schema, ChecksTypes) {
  const Schema integer = compiled(R"({"type":"integer"})");
  EXPECT_TRUE(integer.check(3));
  EXPECT_TRUE(integer.check(3.0));
  EXPECT_FALSE(integer.check(3.5));
  EXPECT_FALSE(integer.check(true));
  EXPECT_FALSE(integer.check(std::numeric_limits<double>::infinity()));
  const Schema either = compiled(R"({"type":["string","null"]})");
  EXPECT_TRUE(either.check("a"));
  EXPECT_TRUE(either.check(nullptr));
  EXPECT_EQ(either.check(1).error().mend, "give string or null");
}

TEST(Schema, ChecksNumbersInclusively) {
  const Schema schema = compiled(R"({"type":"number","minimum":0,"maximum":1})");
  EXPECT_TRUE(schema.check(0));
  EXPECT_TRUE(schema.check(1.0));
  EXPECT_FALSE(schema.check(-0.001));
  EXPECT_FALSE(schema.check(1.001));
  EXPECT_FALSE(schema.check(std::numeric_limits<double>::quiet_NaN()));
}

TEST(Schema, CountsCharactersNotBytes) {
  const Schema schema = compiled(R"({"minLength":2,"maxLength":3})");
  EXPECT_FALSE(schema.check("ü"));
  EXPECT_TRUE(schema.check("üüü"));
  EXPECT_FALSE(schema.check("üüüü"));
}

TEST(Schema, ChecksPatternAndChoices) {
  const Schema pattern = compiled(R"({"pattern":"^[a-z]+$","maxLength":1024})");
  EXPECT_TRUE(pattern.check("abc"));
  EXPECT_TRUE(pattern.check(std::string(1024, 'a')));
  EXPECT_FALSE(pattern.check("aBc"));
  EXPECT_FALSE(pattern.check("abc\n"));
  const Schema choices = compiled(R"({"enum":["a",1,null]})");
  EXPECT_TRUE(choices.check(1));
  EXPECT_FALSE(choices.check("b"));
}

TEST(Schema, SaysWhereInsideArraysAndObjects) {
  const Schema schema = compiled(R"({"type":"object","required":["xs"],"additionalProperties":false,
      "properties":{"xs":{"type":"array","minItems":1,"maxItems":2,"items":{"type":"number"}}}})");
  EXPECT_TRUE(schema.check(Json::parse(R"({"xs":[1,2]})")));
  EXPECT_EQ(schema.check(Json::parse(R"({"xs":[1,"b"]})"), "/steps/0").error().where, "/steps/0/xs/1");
  EXPECT_EQ(schema.check(Json::parse(R"({})")).error().what, "'xs' is missing");
  EXPECT_EQ(schema.check(Json::parse(R"({"xs":[1],"y":2})")).error().line(), "'y' does not belong there; use only xs");
  EXPECT_FALSE(schema.check(Json::parse(R"({"xs":[]})")));
  EXPECT_FALSE(schema.check(Json::parse(R"({"xs":[1,2,3]})")));
}

}  // namespace
}  // namespace pons::task
