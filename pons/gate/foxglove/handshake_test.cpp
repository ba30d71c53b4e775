#include "pons/gate/foxglove/handshake.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace pons::gate::foxglove {
namespace {

using ::testing::HasSubstr;

std::string address(std::string_view text) {
  const auto address = address_of(text);
  return address ? text_of(*address) : address.error().line();
}

TEST(FoxgloveAddress, IsLoopbackUnlessOneIsNamed) {
  EXPECT_EQ(address("8765"), "127.0.0.1:8765");
  EXPECT_EQ(address("0"), "127.0.0.1:0");
  EXPECT_EQ(address("localhost:80"), "127.0.0.1:80");
  EXPECT_EQ(address("0.0.0.0:8765"), "0.0.0.0:8765");
  EXPECT_EQ(address("[::1]:65535"), "[::1]:65535");
}

TEST(FoxgloveAddress, WhatIsNoneIsRefused) {
  for (const char* const text : {"", "x", "65536", "-1", "127.0.0.1", "127.0.0.1:", "8765 ", "+1"})
    EXPECT_THAT(address(text), HasSubstr("names no port")) << text;
  EXPECT_THAT(address("::1:8765"), HasSubstr("without brackets"));
  for (const char* const text : {"robot:8765", "256.0.0.1:1", "[]:1", "[robot]:1", ":1"})
    EXPECT_THAT(address(text), HasSubstr("names no address")) << text;
}

TEST(FoxgloveOrigin, ProgramsAndPagesOfThisComputerMayLook) {
  for (const char* const origin :
       {"", "file://", "https://app.foxglove.dev", "http://localhost", "http://localhost:8080", "https://127.0.0.1:1",
        "http://127.9.9.9", "http://[::1]:8080"})
    EXPECT_TRUE(may_look(origin, {})) << origin;
}

TEST(FoxgloveOrigin, OtherPagesMayNotUnlessTheyAreNamed) {
  const std::vector<std::string> named{"https://viewer.example"}, all{"*"};
  for (const char* const origin :
       {"null", "https://evil.example", "http://app.foxglove.dev", "https://app.foxglove.dev.evil.example",
        "http://localhost.evil.example", "http://localhost@evil.example", "http://127.0.0.1.evil.example",
        "http://localhost:x", "ftp://localhost", "http://128.0.0.1", "http://[::1", "file://evil", "localhost"}) {
    EXPECT_FALSE(may_look(origin, {})) << origin;
    EXPECT_FALSE(may_look(origin, named)) << origin;
    EXPECT_TRUE(may_look(origin, all)) << origin;
  }
  EXPECT_TRUE(may_look("https://viewer.example", named));
  EXPECT_FALSE(may_look("https://viewer.example:8080", named));
}

TEST(FoxgloveOrigin, WhatIsNoOriginCannotBeNamed) {
  for (const char* const origin : {"*", "null", "https://viewer.example", "http://robot:8080", "http://[::1]:1"})
    EXPECT_TRUE(origin_of(origin)) << origin;
  for (const char* const origin : {"", "viewer.example", "https://", "https://viewer.example/path", "https://a b",
                                   "https://viewer.example:port"}) {
    const auto refused = origin_of(origin);
    ASSERT_FALSE(refused) << origin;
    EXPECT_THAT(refused.error().line(), HasSubstr("is no origin of a page"));
  }
}

TEST(FoxgloveWelcome, NamesWhatDoesNotFit) {
  const auto welcomed = welcome({"websocket", "foo, foxglove.websocket.v1", ""}, {});
  ASSERT_TRUE(welcomed) << welcomed.error().why;
  EXPECT_EQ(*welcomed, "foxglove.websocket.v1");

  const auto page = welcome({"", "", ""}, {});
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().status, 426U);
  const auto other = welcome({"websocket", "rosbridge", ""}, {});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().status, 400U);
  EXPECT_THAT(other.error().why, HasSubstr("'rosbridge'"));
  const auto evil = welcome({"websocket", "foxglove.sdk.v1", "https://evil.example"}, {});
  ASSERT_FALSE(evil);
  EXPECT_EQ(evil.error().status, 403U);
  EXPECT_THAT(evil.error().why, HasSubstr("--foxglove-origin https://evil.example"));
}

}  // namespace
}  // namespace pons::gate::foxglove
