// A dialect: the messages in which others ask for tasks, and those in which they are answered. What becomes of a task
// is the same in all of them (interpreter.hpp); each only has other words for it. All of it on the node's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "apps/dialects/phrasebook.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/task/task.hpp"
#include "pons/world/dialect.hpp"

namespace pons::apps {

// What a message asks for.
struct Wish {
  std::string id;              // of the task, as its sender calls it; any text
  Expected<task::Json> asked;  // a task, its id left out; or of a verb {"op":"cancel","reason":…}; or why it is neither
  task::Json heard;            // the message, for the journal where nothing comes of it
};

// What there is to say of a task.
struct Saying {
  enum class State : std::uint8_t { kAccepted, kExecuting, kSucceeded, kFailed, kRefused };
  std::string id;  // as its sender calls it
  State state = State::kRefused;
  std::string detail;  // one line: what happened, how it stands, or why not
  Time stamp;          // run time
  task::Json event;    // of the journal, as in journal_json.hpp, which this is about; null: none
};

// Whether it is about the course of its task, rather than one of the many things that happen on the way.
[[nodiscard]] bool is_course(const Saying& saying);

class Dialect {
 public:
  using Hears = std::function<void(Wish)>;
  virtual ~Dialect() = default;
  // Once. Errors: those of its topics.
  [[nodiscard]] virtual Expected<void> open(gate::ros::Node& node, Hears hears) = 0;
  virtual void tell(const Saying& saying) = 0;
};

// Each knows its own part of `spec`.
[[nodiscard]] std::unique_ptr<Dialect> agent(const world::Dialect& spec);
[[nodiscard]] std::unique_ptr<Dialect> brain(const world::Dialect& spec, Phrasebook phrases);
[[nodiscard]] std::unique_ptr<Dialect> universal(const world::Dialect& spec, Phrasebook phrases);
[[nodiscard]] std::unique_ptr<Dialect> high_level(const world::Dialect& spec, Phrasebook phrases);
[[nodiscard]] std::unique_ptr<Dialect> motion(const world::Dialect& spec);

// What they share.

// With as many tasks from nothing to everything: 0, which is what a message has whose sender did not think of it, is
// our 50; each step is one, as far as ours go, 0 to 100.
[[nodiscard]] int priority_of(std::int64_t theirs);
// The word that has no other than these three.
[[nodiscard]] std::string_view three_words(Saying::State state);  // "EXECUTING", "SUCCEEDED", "FAILED"

// Samples kept for who hears slowly.
inline constexpr gate::ros::Qos kDialectQos{.depth = 100};

// Listens at `topic`, and hands `heard` what came. Errors: those of the topic, with its place in the world's file.
template <typename T>
[[nodiscard]] Expected<void> listen(gate::ros::Node& node, const world::Placed& topic,
                                    std::function<void(const T&)> heard) {
  auto listening = node.subscribe<T>(topic.text, kDialectQos, std::move(heard));
  if (!listening) listening.error().where = topic.where + ": " + listening.error().where;
  return listening;
}
// Likewise, to speak there.
template <typename T>
[[nodiscard]] Expected<gate::ros::Publisher<T>> speak_at(gate::ros::Node& node, const world::Placed& topic) {
  auto made = node.advertise<T>(topic.text, kDialectQos);
  if (!made) made.error().where = topic.where + ": " + made.error().where;
  return made;
}

}  // namespace pons::apps
