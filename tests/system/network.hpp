// What lies between those who ask and the bridge: a network that loses, repeats, delays and so reorders what it
// carries, in both directions. Whoever stands beside the machine speaks to it directly: their words arrive at once, if
// somebody listens.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/local_socket.hpp"
#include "tests/system/steps.hpp"

namespace pons::tests {

using Json = nlohmann::json;

enum class Way : std::uint8_t { kNetwork, kBeside };

struct Question {
  std::int64_t number = 0;  // whoever asks knows its answer by it
  std::string text;
  Way way = Way::kNetwork;
};

struct Answer {
  std::int64_t question = 0;
  Json json;
};

struct NetworkFaults {
  double lost = 0.05, repeated = 0.05, late = 0.03;
};

// What came of them, in questions and answers.
struct NetworkLosses {
  std::size_t lost = 0, repeated = 0, late = 0;
};

class Network {
 public:
  explicit Network(Random random) : random_(random) {}

  void ask(const Question& question, Time now);
  // What has arrived goes to who listens, or is lost.
  enum class Listens : std::uint8_t { kSomebody, kNobody };
  void advance(Time now, Listens listens);
  // Of who listens; nothing that came before is left to who listens next.
  [[nodiscard]] std::vector<Question> hear();
  void answer(const Question& question, const Json& json, Time now);
  [[nodiscard]] std::vector<Answer> take_answers(Time now);

  [[nodiscard]] const NetworkLosses& losses() const { return losses_; }

  NetworkFaults faults;
  std::function<void(const Question&)> when_heard;
  std::function<void(const Question&, const Json&)> when_answered;

 private:
  [[nodiscard]] int copies();
  [[nodiscard]] Duration takes();

  Random random_;
  NetworkLosses losses_;
  std::multimap<Time, Question> under_way_;
  std::multimap<Time, Answer> back_;
  std::vector<Question> heard_;
};

// Where the bridge meets the network.
class Counter final : public gate::Visitors {
 public:
  // All must outlive it; `now` is the world's clock.
  Counter(Network& network, Steps& steps, const Time& now) : network_(network), steps_(steps), now_(now) {}
  [[nodiscard]] std::vector<gate::Request> poll() override;

 private:
  Network& network_;
  Steps& steps_;
  const Time& now_;
};

}  // namespace pons::tests
