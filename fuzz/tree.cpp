// A tree as a brain may send it: any bytes. What is refused is refused in one readable line; what is taken runs:
// paused, cancelled, written down and taken up again at whatever moment, it does not crash, nor does a tick take long.
//
// The first four bytes say when; the rest is the document.

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "pons/bridge/tree/tree.hpp"

namespace {

using namespace pons;
using bridge::tree::Tree;
using task::Json;

constexpr std::size_t kWhen = 4;
constexpr int kTicks = 60;

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_tree: %s\n", what.c_str());
  std::abort();
}

// Ends after two ticks; stands, and ends when told to, in the next.
class Short final : public task::Skill {
 public:
  explicit Short(task::Progress end) : end_(std::move(end)) {}
  task::Progress tick(Time) override {
    if (told_) return {.status = task::Status::kFailed, .reason = "broken off", .stop = task::StopResult::kConfirmed};
    if (paused_) return {.status = task::Status::kPaused, .stop = task::StopResult::kConfirmed};
    return --left_ > 0 ? task::Progress{} : end_;
  }
  void pause(Time, task::Pause) override { paused_ = true; }
  void resume(Time) override { paused_ = false; }
  void cancel(Time) override { told_ = true; }
  void halt(Time) override { told_ = true; }

 private:
  task::Progress end_;
  int left_ = 2;
  bool paused_ = false, told_ = false;
};

const task::SkillRegistry& skills() {
  static const task::SkillRegistry registry = [] {
    task::SkillRegistry made;
    const auto add = [&](std::string name, std::string resource, const task::Progress& end) {
      made.add({.name = std::move(name),
                .schema = Json::parse(R"({"type":"object","additionalProperties":false,
                  "properties":{"object":{"type":"string","maxLength":64,"pattern":"^[A-Z0-9]*$"},
                                "speed":{"type":"number","minimum":0,"maximum":1},
                                "often":{"type":"integer"}, "softly":{"type":"boolean"}, "any":{},
                                "via":{"type":"array","maxItems":3,"items":{"type":"integer"}},
                                "at":{"type":["object","null"]}}})"),
                .resources = {std::move(resource)},
                .timeout = std::chrono::milliseconds(100),
                .attempts = 2,
                .outputs = {"mass_kg", "seen"},
                .start = [end](const Json&, Time) { return std::make_unique<Short>(end); }});
    };
    add("pick", "arm", {task::Status::kSucceeded, "", {{"mass_kg", 1.5}, {"seen", {1, 2, 3}}}});
    add("miss", "arm", {task::Status::kRetry, "missed"});
    add("look", "camera", {task::Status::kFailed, "dark"});
    add("odd", "scale", {task::Status::kException, "too heavy"});
    return made;
  }();
  return registry;
}

void expect_readable(const std::string& line) {
  if (line.empty() || line.size() > 2000) found("an error of " + std::to_string(line.size()) + " bytes");
  if (line.find('\n') != line.npos) found("an error of several lines: " + line);
  (void)Json(line).dump();  // throws unless it is UTF-8
}

std::unique_ptr<Tree> made_of(const std::shared_ptr<const bridge::tree::Program>& program) {
  return std::make_unique<Tree>(program, [](const bridge::tree::Attempt&, Time) -> Expected<void> { return {}; });
}

void run(const std::shared_ptr<const bridge::tree::Program>& program, std::array<std::uint8_t, kWhen> when) {
  const auto is_time = [&](int which, int tick) {
    const int turn = when[static_cast<std::size_t>(which)];
    return turn != 0 && tick % turn == turn - 1;
  };
  auto tree = made_of(program);
  for (int i = 0; i < kTicks; ++i) {
    const Time now(std::chrono::milliseconds(10 * i));
    if (is_time(0, i)) tree->pause(now, i % 2 == 0 ? task::Pause::kStand : task::Pause::kHandOver);
    if (is_time(1, i)) tree->resume(now);
    if (is_time(2, i)) i < kTicks / 2 ? tree->cancel(now) : tree->halt(now);
    const task::Status status = tree->tick(now);
    if (task::is_end(status)) {
      if (status != task::Status::kSucceeded) expect_readable(tree->result().reason);
      (void)tree->blackboard().dump();
      return;
    }
    if (!is_time(3, i)) continue;
    auto again = made_of(program);
    const std::string written = tree->checkpoint().dump();
    if (const auto restored = again->restore(Json::parse(written)); !restored)
      found("it does not come back: " + restored.error().line());
    // Of skills it knows that they were begun, not what they were at.
    if (again->checkpoint().dump() != written) found("it comes back as another: " + written);
    tree = std::move(again);
  }
}

}  // namespace

// libFuzzer calls it so: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < kWhen) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + kWhen, size - kWhen);
  const auto document = bridge::tree::read_document(text, "tree.xml");
  if (!document) {
    expect_readable(document.error().line());
    return 0;
  }
  const auto program = bridge::tree::compile(*document, "", skills());
  if (!program) {
    expect_readable(program.error().line());
    return 0;
  }
  run(*program, {data[0], data[1], data[2], data[3]});
  return 0;
}
