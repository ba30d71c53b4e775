#include "pons/gate/foxglove/protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace pons::gate::foxglove {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string refusal(std::string_view text) {
  const auto said = parse_text(text);
  return said ? "nothing" : said.error().line();
}

std::vector<std::byte> bytes(std::string_view text) {
  const auto all = std::as_bytes(std::span(text));
  return {all.begin(), all.end()};
}

TEST(FoxgloveProtocol, ReadsWhatClientsSay) {
  const auto subscribe =
      parse_text(R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":4294967295,"channelId":5}]})");
  ASSERT_TRUE(subscribe) << subscribe.error().line();
  EXPECT_THAT(std::get<Subscribe>(*subscribe).subscriptions,
              ElementsAre(Subscription{0, 3}, Subscription{4294967295, 5}));
  const auto unsubscribe = parse_text(R"({"op":"unsubscribe","subscriptionIds":[0,7],"more":1})");
  ASSERT_TRUE(unsubscribe) << unsubscribe.error().line();
  EXPECT_THAT(std::get<Unsubscribe>(*unsubscribe).ids, ElementsAre(0, 7));
}

TEST(FoxgloveProtocol, NamesWhatIsWrong) {
  EXPECT_THAT(refusal("{"), HasSubstr("JSON"));
  EXPECT_THAT(refusal("[]"), HasSubstr("op: is no object with an operation"));
  EXPECT_THAT(refusal(R"({"op":1})"), HasSubstr("op: is no object with an operation"));
  EXPECT_THAT(refusal(R"({"op":"dance"})"), HasSubstr("'dance' is no operation"));
  EXPECT_THAT(refusal(R"({"op":"advertise","channels":[]})"), HasSubstr("'advertise' is not offered here"));
  EXPECT_THAT(refusal(R"({"op":"fetchAsset"})"), HasSubstr("'fetchAsset' is not offered here"));
  EXPECT_THAT(refusal(R"({"op":"subscribe"})"), HasSubstr("subscribe/subscriptions: is no list"));
  EXPECT_THAT(refusal(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2},7]})"),
              HasSubstr("subscribe/subscriptions/1/id: is no number"));
  EXPECT_THAT(refusal(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":-2}]})"),
              HasSubstr("subscribe/subscriptions/0/channelId: is no number"));
  EXPECT_THAT(refusal(R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":2}]})"),
              HasSubstr("subscribe/subscriptions/0/id: is no number"));
  EXPECT_THAT(refusal(R"({"op":"unsubscribe","subscriptionIds":[1.5]})"),
              HasSubstr("unsubscribe/subscriptionIds/0: is no number"));
  EXPECT_THAT(refusal(std::string(70'000, ' ')), HasSubstr("65536"));
}

TEST(FoxgloveProtocol, ReadsCallsOfServices) {
  const auto call = parse_binary(bytes(std::string_view("\2\1\0\0\0\7\0\0\1\3\0\0\0cdrxyz", 19)));
  ASSERT_TRUE(call) << call.error().line();
  const auto& [service, id, encoding, request] = std::get<Call>(*call);
  EXPECT_EQ(service, 1U);
  EXPECT_EQ(id, 7U + (1U << 24U));
  EXPECT_EQ(encoding, "cdr");
  EXPECT_EQ(request, bytes("xyz"));

  const auto refused = [](std::string_view text) {
    const auto said = parse_binary(bytes(text));
    return said ? "nothing" : said.error().line();
  };
  EXPECT_THAT(refused(""), HasSubstr("is empty"));
  EXPECT_THAT(refused("\1abcd"), HasSubstr("publishing is not offered"));
  EXPECT_THAT(refused("\11"), HasSubstr("9 is no operation"));
  EXPECT_THAT(refused("\2\1"), HasSubstr("ends too soon"));
  EXPECT_THAT(refused(std::string_view("\2\1\0\0\0\7\0\0\0\4\0\0\0cdr", 16)), HasSubstr("ends too soon"));
  EXPECT_THAT(refused(std::string_view("\2\1\0\0\0\7\0\0\0\xff\xff\xff\xff"
                                       "cdr",
                                       16)),
              HasSubstr("ends too soon"));
}

TEST(FoxgloveProtocol, ChoosesTheFirstSubprotocolThatItSpeaks) {
  EXPECT_EQ(chosen_subprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chosen_subprotocol("a,  foxglove.sdk.v1 ,foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chosen_subprotocol(""), std::nullopt);
  EXPECT_EQ(chosen_subprotocol("foxglove.websocket.v2,Foxglove.sdk.v1"), std::nullopt);
}

TEST(FoxgloveProtocol, SaysWhatThereIs) {
  const std::vector<Service> none;
  Json info = Json::parse(server_info({"pons", "run-1", {{"world", "parcel_cell"}}}, none));
  EXPECT_EQ(info, Json::parse(R"({"op":"serverInfo","name":"pons","capabilities":["time"],"sessionId":"run-1",
                                  "metadata":{"world":"parcel_cell"},"supportedEncodings":["cdr"]})"));
  const std::vector<Service> services{
      {"/pons/a", "a/srv/A", {"a/srv/A_Request", "string x"}, {"a/srv/A_Response", ""}}};
  info = Json::parse(server_info({"pons", "run-1", {}}, services));
  EXPECT_EQ(info.at("capabilities"), Json({"time", "services"}));
  EXPECT_EQ(info.at("metadata"), Json::object());
  const std::vector<Channel> channels{{"/a", "std_msgs/msg/String", "string data", Keeps::kLast}};
  EXPECT_EQ(Json::parse(advertise(channels)),
            Json::parse(R"({"op":"advertise","channels":[{"id":0,"topic":"/a","encoding":"cdr",
              "schemaName":"std_msgs/msg/String","schema":"string data","schemaEncoding":"ros2msg"}]})"));
  EXPECT_EQ(Json::parse(advertise_services(services)),
            Json::parse(R"({"op":"advertiseServices","services":[{"id":0,"name":"/pons/a","type":"a/srv/A",
              "request":{"encoding":"cdr","schemaName":"a/srv/A_Request","schemaEncoding":"ros2msg","schema":"string x"},
              "response":{"encoding":"cdr","schemaName":"a/srv/A_Response","schemaEncoding":"ros2msg","schema":""}}]})"));
  EXPECT_EQ(Json::parse(status(Level::kWarning, "\xff", "x")),
            Json::parse(R"({"op":"status","level":1,"message":"\ufffd","id":"x"})"));
  EXPECT_EQ(Json::parse(call_failed({.service = 1, .id = 2}, "no")),
            Json::parse(R"({"op":"serviceCallFailure","serviceId":1,"callId":2,"message":"no"})"));
}

TEST(FoxgloveProtocol, HeadersAreLittleEndian) {
  const Header message = message_header(0x01020304, Time(Duration(0x0102030405060708)));
  EXPECT_EQ(std::vector(message.view().begin(), message.view().end()), bytes("\1\4\3\2\1\x8\x7\x6\x5\x4\x3\x2\x1"));
  const Header time = time_message(Time(Duration(258)));
  EXPECT_EQ(std::vector(time.view().begin(), time.view().end()), bytes(std::string_view("\2\2\1\0\0\0\0\0\0", 9)));
  EXPECT_EQ(call_answered({.service = 1, .id = 2, .encoding = "cdr"}, bytes("ab")),
            bytes(std::string_view("\3\1\0\0\0\2\0\0\0\3\0\0\0cdrab", 18)));
}

}  // namespace
}  // namespace pons::gate::foxglove
