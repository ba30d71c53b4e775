#include "pons/runner/thinker.hpp"

#include <gtest/gtest.h>

#include <latch>

namespace pons::runner {
namespace {

// Thinks until it is let go.
class Slow final : public task::Policy {
 public:
  Chunk infer(const task::Observation& seen) override {
    begun.count_down();
    go_on.wait();
    return {.observed = seen.executed};
  }
  std::latch begun{1}, go_on{1};
};

TEST(Thinker, NobodyWaitsForItAndItAnswersInOrder) {
  Thinker thinker;
  const auto slow = std::make_shared<Slow>();
  for (int i = 0; i < 3; ++i) thinker.ask(slow, {.executed = 1.0 * i});
  slow->begun.wait();
  EXPECT_FALSE(thinker.take());
  slow->go_on.count_down();
  for (int i = 0; i < 3;) {
    if (const auto chunk = thinker.take()) {
      EXPECT_EQ(chunk->observed, i++);
    }
  }
  EXPECT_FALSE(thinker.take());
}

TEST(Thinker, EndsWithoutWork) { const Thinker thinker; }

}  // namespace
}  // namespace pons::runner
