// Between dialects and the desk: what was heard becomes requests, and what becomes of the tasks is told. The one
// memory of tasks is the journal's; here is only which of them somebody waits to hear of.
//
// A task has the id of its sender behind the dialect's name, "brain:t1", so that no two dialects mean the same. Who
// sends the same again hears how it stands. Of all tasks one watch tells, whatever number is followed.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/dialects/dialect.hpp"
#include "apps/ros_follow.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/dialect.hpp"

namespace pons::apps {

class Interpreter final : public gate::ros::Part {
 public:
  // Of each dialect; one more is refused, and may be sent again.
  static constexpr std::size_t kFollowedMost = 64;

  // `gate`, whose node it is a part of, has not been started.
  explicit Interpreter(gate::ros::Gate& gate) : gate_(gate) {}
  // Once. Errors, by file and place: a topic that cannot be, those of Phrasebook::compile().
  [[nodiscard]] Expected<void> speak(const std::vector<world::Dialect>& dialects, const task::SkillRegistry& skills);

  void spin(Clock::time_point now) override { later_.spin(now); }
  [[nodiscard]] Clock::time_point due() const override { return later_.due(); }

 private:
  struct Speaker {
    std::string prefix;
    std::unique_ptr<Dialect> dialect;
    std::size_t follows = 0;  // and is about to
  };
  // A task of a speaker's: as he calls it, and as the journal does.
  struct Name {
    Speaker* speaker;
    std::string id, task;
  };
  struct Followed {
    Name name;
    bool started = false;
  };

  void hear(Speaker& speaker, Wish wish);
  void refuse(const Name& name, const task::Json& heard, const Error& why);
  void submit(const Name& name, task::Json task);
  void tell_verb(const Name& name, task::Json request);
  // How a task stands, after `note` of what was not done.
  void present(const Name& name, std::int64_t after, const std::string& note);
  void follow(const Name& name, std::int64_t after);
  void watch();
  void hear_news(const task::Json& told);
  void tell(const task::Json& event);
  // Those that a bridge before this one had taken.
  void take_over(std::int64_t after);
  // After an answer of the desk's.
  void say(const Name& name, const task::Json& told, Saying::State state, std::string detail);

  gate::ros::Gate& gate_;
  Later later_;
  std::vector<std::unique_ptr<Speaker>> speakers_;
  std::map<std::string, Followed, std::less<>> followed_;  // by the journal's name
  bool watching_ = false;
  std::int64_t after_ = 0;  // the newest event that was heard of
};

}  // namespace pons::apps
