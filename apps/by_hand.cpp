#include "apps/by_hand.hpp"

#include <fmt/format.h>

#include <chrono>
#include <string_view>

namespace pons::apps {
namespace {

constexpr int kGoesLast = 0;  // by priority

}  // namespace

Expected<ByHand::Taken> ByHand::take(const bridge::Json& arguments, Time now) {
  const std::string_view state = bridge_.state(id_);
  if (state == "waiting" || state == "running") return Taken{id_};
  if (!state.empty()) return fail(fmt::format("{} is {}", id_, state), skill_, "wait for another task's end");
  if (bridge_.has_holder(resource_) || bridge_.is_waited_for(resource_))
    return fail(fmt::format("a task has the {}", resource_), skill_, "wait for its end, or cancel it");
  // By time, for a bridge that takes over on the same journal knows no number.
  const std::string id =
      fmt::format("{}-{}", skill_, std::chrono::duration_cast<std::chrono::milliseconds>(now - Time{}).count());
  const bridge::Json task{
      {"id", id}, {"priority", kGoesLast}, {"steps", {{{"skill", skill_}, {"arguments", arguments}}}}};
  if (const auto admitted = bridge_.submit(task.dump(), now); !admitted) return std::unexpected(admitted.error());
  id_ = id;
  // Nobody hears of a task before the disk has it.
  if (const auto kept = bridge_.commit(now); !kept) return std::unexpected(kept.error());
  return Taken{id_, true};
}

}  // namespace pons::apps
