// Between two of our nodes; peers of other makes: tests/ros/.
#include "pons/gate/ros/service.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "pons/gate/ros/test_nodes.hpp"
#include "pons/wire/types/std_srvs/srv/set_bool.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;
using wire::std_srvs::srv::SetBool;

class RosService : public ::testing::Test {
 protected:
  void ask(Client<SetBool>& client, bool value, std::chrono::milliseconds patience = 10s) {
    const auto called = client.call({.data = value}, patience, [this](Expected<SetBool::Response> reply) {
      told_.push_back(reply ? reply->message : reply.error().line());
    });
    ASSERT_TRUE(called) << called.error().line();
  }
  [[nodiscard]] bool spun(const std::function<bool()>& done) { return spin_until({here_.get(), there_.get()}, done); }

  std::unique_ptr<Node> here_ = test_node("here"), there_ = test_node("there");
  std::vector<std::string> told_;
};

TEST_F(RosService, AnswersWhoAsked) {
  ASSERT_TRUE(serve<SetBool>(*here_, "switch", [](const SetBool::Request& request, const Answer<SetBool>& answer) {
    answer({.success = request.data, .message = request.data ? "on" : "off"});
  }));
  const auto one = client<SetBool>(*there_, "switch"), other = client<SetBool>(*there_, "switch");
  ASSERT_TRUE(one && other);
  ASSERT_TRUE(spun([&] { return (*one)->available() && (*other)->available(); }));
  ask(**one, true);
  ask(**other, false);
  EXPECT_TRUE(spun([&] { return told_.size() == 2; }));
  EXPECT_THAT(told_, UnorderedElementsAre("on", "off"));
}

TEST_F(RosService, MayAnswerLaterAndInAnotherOrder) {
  std::vector<Answer<SetBool>> open;
  ASSERT_TRUE(serve<SetBool>(*here_, "switch",
                             [&](const SetBool::Request&, const Answer<SetBool>& answer) { open.push_back(answer); }));
  const auto asks = client<SetBool>(*there_, "switch");
  ASSERT_TRUE(spun([&] { return (*asks)->available(); }));
  std::map<int, std::string> replies;
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE((*asks)->call({}, 10s, [&replies, i](const auto& reply) { replies[i] = reply->message; }));
  ASSERT_TRUE(spun([&] { return open.size() == 2; }));
  open[1]({.message = "second"});
  open[0]({.message = "first"});
  EXPECT_TRUE(spun([&] { return replies.size() == 2; }));
  EXPECT_EQ(replies[0], "first");
  EXPECT_EQ(replies[1], "second");
}

TEST_F(RosService, WithoutAServerItSaysSo) {
  const auto asks = client<SetBool>(*there_, "switch");
  ASSERT_TRUE(asks);
  EXPECT_FALSE((*asks)->available());
  const auto called = (*asks)->call({}, 10s, [](const auto&) {});
  ASSERT_FALSE(called);
  EXPECT_THAT(called.error().line(), HasSubstr("no server"));
}

TEST_F(RosService, AServerThatIsSilentOrGoesIsNamed) {
  ASSERT_TRUE(serve<SetBool>(*here_, "switch", [](const auto&, const auto&) {}));
  const auto asks = client<SetBool>(*there_, "switch");
  ASSERT_TRUE(spun([&] { return (*asks)->available(); }));
  ask(**asks, true, 50ms);
  EXPECT_TRUE(spun([&] { return told_.size() == 1; }));
  EXPECT_THAT(told_.at(0), HasSubstr("the server is there"));
  ask(**asks, true, 300ms);
  here_.reset();
  ASSERT_TRUE(spin_until({there_.get()}, [&] { return told_.size() == 2; }));
  EXPECT_THAT(told_.at(1), HasSubstr("no answer in time"));
  ASSERT_TRUE(spin_until({there_.get()}, [&] { return !(*asks)->available(); }));
}

}  // namespace
}  // namespace pons::gate::ros
