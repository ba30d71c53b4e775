#include "tests/system/network.hpp"

#include <cmath>
#include <utility>

namespace pons::tests {
namespace {

constexpr double kUsually_s = 0.03, kLate_s = 10;

}  // namespace

int Network::copies() {
  if (random_.uniform() < faults.lost) {
    ++losses_.lost;
    return 0;
  }
  const bool repeated = random_.uniform() < faults.repeated;
  losses_.repeated += repeated ? 1 : 0;
  return repeated ? 2 : 1;
}

Duration Network::takes() {
  const bool late = random_.uniform() < faults.late;
  losses_.late += late ? 1 : 0;
  const double mean_s = late ? kLate_s : kUsually_s;
  return from_s(-mean_s * std::log(1.0 - random_.uniform()));
}

void Network::ask(const Question& question, Time now) {
  if (question.way == Way::kBeside) {
    under_way_.emplace(now, question);
    return;
  }
  for (int i = copies(); i > 0; --i) under_way_.emplace(now + takes(), question);
}

void Network::advance(Time now, Listens listens) {
  if (listens == Listens::kNobody) heard_.clear();
  while (!under_way_.empty() && under_way_.begin()->first <= now) {
    if (listens == Listens::kSomebody) heard_.push_back(std::move(under_way_.begin()->second));
    under_way_.erase(under_way_.begin());
  }
}

std::vector<Question> Network::hear() {
  for (const Question& question : heard_) {
    if (when_heard) when_heard(question);
  }
  return std::exchange(heard_, {});
}

void Network::answer(const Question& question, const Json& json, Time now) {
  if (when_answered) when_answered(question, json);
  if (question.way == Way::kBeside) {
    back_.emplace(now, Answer{question.number, json});
    return;
  }
  for (int i = copies(); i > 0; --i) back_.emplace(now + takes(), Answer{question.number, json});
}

std::vector<Answer> Network::take_answers(Time now) {
  std::vector<Answer> answers;
  while (!back_.empty() && back_.begin()->first <= now) {
    answers.push_back(std::move(back_.begin()->second));
    back_.erase(back_.begin());
  }
  return answers;
}

std::vector<gate::Request> Counter::poll() {
  std::vector<gate::Request> requests;
  if (!steps_.at(Act::kHear, Moment::kBefore)) return requests;
  std::vector<Question> questions = network_.hear();
  if (!steps_.at(Act::kHear, Moment::kAfter)) return requests;
  for (Question& question : questions) {
    const auto reply = [this, question](const Json& answer) {
      if (!steps_.at(Act::kReply, Moment::kBefore)) return;
      network_.answer(question, answer, now_);
      (void)steps_.at(Act::kReply, Moment::kAfter);
    };
    requests.push_back({std::move(question.text), reply});
  }
  return requests;
}

}  // namespace pons::tests
