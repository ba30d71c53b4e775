// Who holds what, and who waits for it, as the arbiter tells others.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pons/bridge/schedule/arbiter.hpp"

namespace pons::bridge {
namespace {

using Ids = std::vector<std::string>;

Claim claim(std::string id, Ids resources) {
  return {.id = std::move(id), .deadline = {}, .accepted = {}, .resources = std::move(resources)};
}

TEST(Arbiter, TellsWhetherAResourceIsHeldAndWaitedFor) {
  Arbiter arbiter({"arm", "dock"}, {});
  EXPECT_FALSE(arbiter.has_holder("arm"));
  EXPECT_FALSE(arbiter.is_waited_for("arm"));
  arbiter.add(claim("first", {"arm"}));
  EXPECT_TRUE(arbiter.is_waited_for("arm"));
  EXPECT_EQ(arbiter.grant({}), Ids{"first"});
  EXPECT_TRUE(arbiter.has_holder("arm"));
  EXPECT_FALSE(arbiter.is_waited_for("arm"));
  arbiter.add(claim("second", {"arm", "dock"}));
  EXPECT_TRUE(arbiter.is_waited_for("arm"));
  EXPECT_TRUE(arbiter.is_waited_for("dock"));
  EXPECT_FALSE(arbiter.has_holder("dock"));
  EXPECT_TRUE(arbiter.remove("second"));
  EXPECT_FALSE(arbiter.is_waited_for("dock"));
  arbiter.release("first");
  EXPECT_FALSE(arbiter.has_holder("arm"));
  EXPECT_FALSE(arbiter.is_waited_for("voice")) << "there is none";
}

}  // namespace
}  // namespace pons::bridge
