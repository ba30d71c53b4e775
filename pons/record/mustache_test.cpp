#include "pons/record/mustache.hpp"

#include <gtest/gtest.h>

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

std::string rendered(std::string_view text, const Json& view) {
  const auto out = render(text, view);
  EXPECT_TRUE(out) << out.error().line();
  return out.value_or("");
}

TEST(Mustache, PutsValuesAndEscapesThem) {
  const Json view = {{"a", "<b>\"'&"}, {"n", 1.5}, {"o", {{"p", "q"}}}, {"nothing", nullptr}};
  EXPECT_EQ(rendered("{{a}} {{ n }} {{o.p}} [{{nothing}}]", view), "&lt;b&gt;&quot;&#39;&amp; 1.5 q []");
  EXPECT_EQ(rendered("no tag } { here", view), "no tag } { here");
}

TEST(Mustache, RepeatsSectionsAndLooksOutwards) {
  const Json view = {{"rows", {{{"x", 1}}, {{"x", 2}}}}, {"unit", "m"}, {"words", {"a", "b"}}};
  EXPECT_EQ(rendered("{{#rows}}{{x}}{{unit}};{{/rows}}", view), "1m;2m;");
  EXPECT_EQ(rendered("{{#words}}{{.}},{{/words}}", view), "a,b,");
  EXPECT_EQ(rendered("{{#rows}}{{#words}}{{x}}{{.}} {{/words}}{{/rows}}", view), "1a 1b 2a 2b ");
}

TEST(Mustache, ShowsWhatIsThereAndElseWhatIsNot) {
  for (const Json& none : {Json(false), Json(nullptr), Json(""), Json::array(), Json(0)})
    EXPECT_EQ(rendered("{{#a}}yes{{b}}{{/a}}{{^a}}no{{/a}}", {{"a", none}}), "no") << none;
  EXPECT_EQ(rendered("{{#a}}yes{{b}}{{/a}}{{^a}}no{{/a}}", {{"a", {{"b", "!"}}}}), "yes!");
  EXPECT_EQ(rendered("{{#a}}yes{{/a}}{{^a}}no{{/a}}", {{"a", true}}), "yes");
}

TEST(Mustache, TagsAloneTakeTheirLine) {
  EXPECT_EQ(rendered("<ul>\n  {{#a}}\n  <li>{{.}}</li>\n  {{/a}}\n</ul>\n{{! words }}\nend", {{"a", {1, 2}}}),
            "<ul>\n  <li>1</li>\n  <li>2</li>\n</ul>\nend");
}

TEST(Mustache, RefusesByLineWhatCannotBe) {
  const Json view = {{"a", {1}}, {"o", {{"p", "q"}}}};
  const auto refused = [&](std::string_view text) {
    const auto out = render(text, view);
    EXPECT_FALSE(out) << text;
    return out ? std::string() : out.error().line();
  };
  EXPECT_TRUE(refused("one\n{{b}}").starts_with("template:2: there is no 'b'"));
  EXPECT_TRUE(refused("{{o.r}}").starts_with("template:1: there is no 'o.r'"));
  EXPECT_TRUE(refused("{{a}}").contains("no single value"));
  EXPECT_TRUE(refused("{{#a}}").contains("'a' is not closed"));
  EXPECT_TRUE(refused("{{/a}}").contains("'a' is not open"));
  EXPECT_TRUE(refused("{{#a}}{{/o}}").contains("'o' is not open"));
  EXPECT_TRUE(refused("{{a").contains("has no end"));
}

}  // namespace
}  // namespace pons::record
