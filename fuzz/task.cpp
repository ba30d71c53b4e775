// A task as a brain may write it: any bytes. What is refused is refused in one readable line; what is taken survives
// the way into the journal and back.

#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "pons/bridge/review/review.hpp"

namespace {

using namespace pons;

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_task: %s\n", what.c_str());
  std::abort();
}

const task::SkillRegistry& skills() {
  static const task::SkillRegistry registry = [] {
    task::SkillRegistry made;
    made.add({.name = "pick",
              .schema = task::Json::parse(R"({"type":"object","additionalProperties":false,"required":["object"],
                "properties":{"object":{"type":"string","maxLength":64,"pattern":"^[A-Z0-9]+$"},
                              "speed":{"type":"number","minimum":0,"maximum":1},
                              "via":{"type":"array","maxItems":3,"items":{"type":"integer"}},
                              "how":{"enum":["fast","soft",null]}}})"),
              .resources = {"arm"},
              .timeout = std::chrono::seconds(1),
              .start = [](const task::Json&, Time) { return nullptr; }});
    return made;
  }();
  return registry;
}

bridge::Review ruled() {
  bridge::Review review(skills(), {"arm"});
  auto rules = bridge::Rules::compile(
      {.tiers = {"operator"},
       .rules =
           {{.name = "odd", .when = {"task.priority > 10", "object != 'A' .. task.id"}, .refuse = "no"},
            {.name = "fast", .skills = {"pick"}, .when = {"how == 'fast' || speed > 0.5"}, .approve = "operator"}}},
      skills(), {});
  if (!rules) found("its own rules: " + rules.error().line());
  review.use_rules(*std::move(rules), {});
  return review;
}

void expect_readable(const Error& error) {
  const std::string line = error.line();
  if (line.empty() || line.size() > 2000) found("an error of " + std::to_string(line.size()) + " bytes");
  if (line.find('\n') != line.npos) found("an error of several lines: " + line);
  (void)task::Json(line).dump();  // throws unless it is UTF-8
}

}  // namespace

// libFuzzer calls it so: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bridge::Review review = ruled();
  const auto tasks = bridge::Review::parse({reinterpret_cast<const char*>(data), size});
  if (!tasks) {
    expect_readable(tasks.error());
    return 0;
  }
  for (const task::Task& task : *tasks) {
    const auto again = task::task_from(task::Json::parse(task::to_json(task).dump()));
    if (!again) found("it does not come back: " + again.error().line());
    if (task::to_json(*again) != task::to_json(task)) found("it comes back as another");
    const auto program = review.check(task, Time{});
    if (!program) {
      expect_readable(program.error());
    } else if (const auto asked = review.judge(task, bridge::Review::uses(task, program->get())); !asked) {
      expect_readable(asked.error());
    }
  }
  return 0;
}
