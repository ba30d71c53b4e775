#include "tests/system/senders.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace pons::tests {
namespace {

constexpr std::array<std::string_view, 4> kChutes{"chute_1", "chute_2", "chute_3", "chute_4"};
constexpr int kAsksAPerson = 900;  // jobs from that number on
constexpr double kWithin_m = 0.05;
constexpr int kLongRounds = 150;
constexpr int kAskedOften = 40;  // then so many more times nothing is made of it: a sender looks at its end only

Duration about(Random& random, double mean_s) { return from_s(-mean_s * std::log(1.0 - random.uniform())); }

Json print_step(const std::string& task, int number) {
  return {{"skill", "print"}, {"arguments", {{"task", task}, {"number", number}}}};
}

std::string print_leaf(const std::string& task, const std::string& number) {
  return fmt::format(R"(<print task="{}" number="{}"/>)", task, number);
}

std::string tree(const std::string& inside) {
  return fmt::format(R"(<root BTCPP_format="4"><BehaviorTree>{}</BehaviorTree></root>)", inside);
}

}  // namespace

Senders::Senders(Network& network, Plant& plant, Referee& referee, Random random, Say say, Say wrong)
    : network_(network),
      plant_(plant),
      referee_(referee),
      random_(random),
      say_(std::move(say)),
      wrong_(std::move(wrong)) {}

bool Senders::content() const {
  return std::ranges::all_of(wishes_, [](const auto& entry) { return entry.second.ended || entry.second.hopeless; });
}

std::string Senders::waits_for() const {
  for (const auto& [id, wish] : wishes_) {
    if (!wish.ended && !wish.hopeless) return fmt::format("{} ({})", id, wish.accepted ? "accepted" : "not accepted");
  }
  return "nothing";
}

void Senders::step(Time now) {
  if (!calm_ && now >= next_wish_) {
    wish(now);
    next_wish_ = now + about(random_, to_s(asking.every));
  }
  if (!calm_ && now >= next_hostility_) {
    be_hostile(now);
    next_hostility_ = now + about(random_, to_s(asking.every) / asking.hostile);
  }
  if (now >= next_meddling_) {
    meddle(now);
    next_meddling_ = now + (calm_ ? from_s(2) : about(random_, to_s(asking.every) / asking.minds_change));
  }
  std::erase_if(pursued_, [&](Wishes::value_type* const wished) {
    auto& [id, wish] = *wished;
    const bool over = wish.ended || wish.hopeless;
    if (!over && now >= wish.ask_at) pursue(id, wish, now);
    return over;
  });
}

void Senders::wish(Time now) {
  const std::size_t together = random_.below(12) == 0 ? 2 + random_.below(2) : 1;
  Json tasks = Json::array();
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < together; ++i) {
    ids.push_back(fmt::format("w{}", ids_.size() + 1));
    ids_.push_back(ids.back());
    tasks.push_back(task_of(ids.back(), now));
  }
  const std::string all = together > 1 ? Json{{"op", "submit"}, {"tasks", tasks}}.dump() : std::string();
  for (std::size_t i = 0; i < together; ++i) {
    say_(fmt::format("wish {}", tasks[i].dump()));
    const Wish wish{.task = tasks[i], .together = all, .ask_at = now};
    pursued_.push_back(&*wishes_.insert_or_assign(ids[i], wish).first);
  }
}

Json Senders::task_of(const std::string& id, Time now) {
  const double which = random_.uniform();
  Json task = which < 0.55 ? parcel_task(id) : which < 0.82 ? print_task(id) : tree_task(id);
  task["id"] = id;
  const double count = random_.uniform();
  task["priority"] = count < 0.1 ? 97 : static_cast<int>(random_.below(90));
  if (random_.uniform() < 0.05) task["deadline_s"] = std::round(now.s() + 10 * random_.uniform());
  return task;
}

// A parcel of that name comes along the belt.
Json Senders::parcel_task(const std::string& id) {
  const std::string place(kChutes.at(random_.below(kChutes.size())));
  plant_.put_on_belt(id, place);
  Json task{{"steps", Json::array()}};
  task["steps"].push_back({{"skill", "pick"}, {"arguments", {{"object", id}}}});
  task["steps"].push_back({{"skill", "place"}, {"arguments", {{"place", place}, {"object", id}}}});
  if (random_.below(4) == 0) task["steps"].push_back(print_step(id, 1));
  return task;
}

Json Senders::print_task(const std::string& id) {
  Json task{{"steps", Json::array()}};
  const bool asks = random_.below(8) == 0;
  for (std::size_t i = 1 + random_.below(4); i > 0; --i)
    task["steps"].push_back(print_step(id, static_cast<int>(i) + (asks && i == 1 ? kAsksAPerson : 0)));
  return task;
}

Json Senders::tree_task(const std::string& id) {
  const auto print = [&](int number) { return print_leaf(id, std::to_string(number)); };
  const auto with = [](const std::string& xml) { return Json{{"tree", {{"xml", tree(xml)}}}}; };
  switch (random_.below(4)) {
    case 0:
      return with("<Sequence>" + print(1) + "<Sleep msec=\"700\"/>" + print(2) + "</Sequence>");
    case 1:
      return with("<Fallback><Sequence>" + print(1) + "<AlwaysFailure/></Sequence>" + print(2) + "</Fallback>");
    case 2: {
      const std::string place(kChutes.at(random_.below(kChutes.size())));
      plant_.put_on_belt(id, place);
      return with(fmt::format(R"(<Sequence>{}<pick object="{}"/><place place="{}" object="{}"/>{}</Sequence>)",
                              print(1), id, place, id, print(2)));
    }
    default: {
      const int rounds = std::exchange(long_tree_, true) ? 5 : kLongRounds;
      return with(fmt::format(
          R"(<Sequence><Script code="n := 0"/><Repeat num_cycles="{}"><Sequence><Script code="n = n + 1"/>{}</Sequence></Repeat></Sequence>)",
          rounds, print_leaf(id, "{n}")));
    }
  }
}

void Senders::ask(About about_what, const std::string& id, const Json& json, Time now) {
  const std::int64_t number = kSendersBegin + ++questions_;
  asked_.emplace(number, Asked{about_what, id});
  network_.ask({number, json.dump(), Way::kNetwork}, now);
}

// As a scanner at the pick zone would have them asked for.
bool Senders::is_far(const std::string& id) const {
  const auto parcel = plant_.parcels().find(id);
  return parcel != plant_.parcels().end() && parcel->second.where == Parcel::Where::kBelt &&
         parcel->second.x_m < plant_.world().belt.pick_x_min_m + kWithin_m;
}

void Senders::pursue(const std::string& id, Wish& wish, Time now) {
  if (is_far(id)) {
    wish.ask_at = now + std::chrono::milliseconds(500);
    return;
  }
  ++wish.asked;
  wish.ask_at = now + std::chrono::seconds(1) + about(random_, wish.accepted ? 4 : 1);
  if (!wish.accepted) {
    const Json submit =
        wish.together.empty() ? Json{{"op", "submit"}, {"task", wish.task}} : Json::parse(wish.together);
    return ask(About::kSubmit, id, submit, now);
  }
  // Some only ask, some watch, and some do not believe that it was accepted.
  const std::uint64_t how = random_.below(8);
  if (how == 0) return ask(About::kSubmit, id, {{"op", "submit"}, {"task", wish.task}}, now);
  ask(About::kFate, id, {{"op", how < 4 && wish.asked < kAskedOften ? "watch" : "history"}, {"id", id}}, now);
}

// Of tasks that may or may not be there.
void Senders::meddle(Time now) {
  if (ids_.empty()) return;
  if (calm_) {
    for (const std::string& id : paused_) ask(About::kOther, id, {{"op", "resume"}, {"id", id}}, now);
    for (const auto& [id, wish] : wishes_) {
      if (wish.ended || wish.hopeless || !wish.accepted) continue;
      ask(About::kOther, id, {{"op", "approve"}, {"id", id}, {"tier", "operator"}, {"by", "Kim"}}, now);
    }
    return;
  }
  const std::size_t lately = std::min<std::size_t>(ids_.size(), 6);
  const std::vector<std::string> seen = at_work();
  const std::string id = seen.empty() || random_.below(2) == 0 ? ids_[ids_.size() - 1 - random_.below(lately)]
                                                               : seen[random_.below(seen.size())];
  constexpr std::array<std::string_view, 8> kWords{"pause",  "pause",   "resume", "resume",
                                                   "cancel", "approve", "halt",   "list"};
  const std::string word(kWords.at(random_.below(kWords.size())));
  say_(fmt::format("somebody says {} {}", word, id));
  if (word == "pause") paused_.insert(id);
  Json json{{"op", word}};
  if (word != "list") json["id"] = id;
  if (word == "approve") json.update({{"tier", "operator"}, {"by", "Kim"}});
  ask(word == "cancel" || word == "halt" ? About::kEnd : About::kOther, id, json, now);
}

// What must be refused, and change nothing.
void Senders::be_hostile(Time now) {
  std::vector<std::string> known;
  for (const auto& [id, wish] : wishes_) {
    if (wish.accepted) known.push_back(id);
  }
  const Json good{{"id", fmt::format("h{}", questions_)}, {"steps", {print_step("hostile", 1)}}};
  Json task = good;
  switch (random_.below(7)) {
    case 0:
      if (known.empty()) return;
      task["id"] = known[random_.below(known.size())];
      break;
    case 1:
      task["steps"][0]["skill"] = "explode";
      break;
    case 2:
      task["steps"][0]["arguments"]["number"] = "one";
      break;
    case 3:
      task["priority"] = 1000;
      break;
    case 4:
      task["id"] = "../../" + std::string(100, 'x');
      break;
    case 5:
      return network_.ask(
          {kSendersBegin + ++questions_, R"({"op":"submit","task":)" + std::string(500, '['), Way::kNetwork}, now);
    default:
      task = {{"id", good.at("id")}, {"tree", {{"xml", tree("<Sequence><Sequence>")}}}};
  }
  ask(About::kHostile, task.at("id").get<std::string>(), {{"op", "submit"}, {"task", task}}, now);
}

}  // namespace pons::tests
