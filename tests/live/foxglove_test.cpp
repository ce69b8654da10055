// Foxglove's protocol, without a network: github.com/foxglove/ws-protocol, docs/spec.md.
#include "live/foxglove.h"

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace foxglove_test {

using live::FoxgloveStream;
using live::WebSocket;
using nlohmann::json;

struct Recorder final : WebSocket {
  struct Message {
    std::string bytes;
    Format format;
    Need need;
  };
  void send(std::string message, Format format, Need need) override {
    heard.push_back({std::move(message), format, need});
  }
  const std::string& client() const override { return name; }
  json take_json() {
    EXPECT_FALSE(heard.empty());
    if (heard.empty()) return nullptr;
    EXPECT_EQ(heard.front().format, Format::kText);
    const json message = json::parse(heard.front().bytes);
    heard.erase(heard.begin());
    return message;
  }
  std::string name = "127.0.0.1:1";
  std::vector<Message> heard;
};

struct FoxgloveTest : testing::Test {
  FoxgloveTest() {
    stream.add({"/fast", "cdr", "std_msgs/msg/String", "string data\n", "ros2msg"});
    stream.add({"/latched", "json", "status", R"({"type": "object"})", "jsonschema", true});
  }
  /// After serverInfo and advertise.
  void begin() {
    conversation->begin();
    socket.heard.clear();
  }
  void hear(const json& message) { conversation->hear(message.dump()); }
  void subscribe(std::uint32_t id, std::size_t channel) {
    hear({{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}});
  }

  FoxgloveStream stream{"a \"robot\""};
  Recorder socket;
  std::unique_ptr<live::Conversation> conversation = stream.converse(socket);
};

TEST_F(FoxgloveTest, KnowsBothNamesOfTheProtocolAndPrefersTheNewOne) {
  EXPECT_EQ(FoxgloveStream::protocol({"foxglove.websocket.v1"}), "foxglove.websocket.v1");
  EXPECT_EQ(FoxgloveStream::protocol({"foxglove.sdk.v1"}), "foxglove.sdk.v1");
  EXPECT_EQ(FoxgloveStream::protocol({"foxglove.websocket.v1", "foxglove.sdk.v1"}), "foxglove.sdk.v1");
  EXPECT_EQ(FoxgloveStream::protocol({"foxglove.sdk.v2", "mqtt", ""}), std::nullopt);
  EXPECT_EQ(FoxgloveStream::protocol({}), std::nullopt);
}

TEST_F(FoxgloveTest, BeginsWithServerInfoAndItsChannels) {
  conversation->begin();
  const json info = socket.take_json();
  EXPECT_EQ(info["op"], "serverInfo");
  EXPECT_EQ(info["name"], "a \"robot\"");
  EXPECT_EQ(info["capabilities"], json::array()) << "for reading only";
  EXPECT_TRUE(info["sessionId"].is_string());
  const json advertise = socket.take_json();
  EXPECT_EQ(advertise, json::parse(R"({"op": "advertise", "channels": [
      {"id": 1, "topic": "/fast", "encoding": "cdr", "schemaName": "std_msgs/msg/String",
       "schema": "string data\n", "schemaEncoding": "ros2msg"},
      {"id": 2, "topic": "/latched", "encoding": "json", "schemaName": "status",
       "schema": "{\"type\": \"object\"}", "schemaEncoding": "jsonschema"}]})"));
  EXPECT_TRUE(socket.heard.empty());
}

TEST_F(FoxgloveTest, MessageDataIsOpcodeSubscriptionTimeAndPayload) {
  begin();
  subscribe(0x04030201, 1);
  stream.publish(0, 0x1122334455667788, "payload");
  ASSERT_EQ(socket.heard.size(), 1U);
  EXPECT_EQ(socket.heard[0].bytes, std::string("\x01"
                                               "\x01\x02\x03\x04"
                                               "\x88\x77\x66\x55\x44\x33\x22\x11"
                                               "payload"))
      << "little-endian";
  EXPECT_EQ(socket.heard[0].format, WebSocket::Format::kBinary);
  EXPECT_EQ(socket.heard[0].need, WebSocket::Need::kMay);
}

TEST_F(FoxgloveTest, ChannelsReachTheirSubscribersUntilTheyUnsubscribe) {
  begin();
  EXPECT_FALSE(stream.wanted(0));
  stream.publish(0, 1, "before");
  EXPECT_TRUE(socket.heard.empty());
  subscribe(7, 1);
  EXPECT_TRUE(stream.wanted(0));
  stream.publish(0, 2, "between");
  EXPECT_EQ(socket.heard.size(), 1U) << "and not what came before";
  hear({{"op", "unsubscribe"}, {"subscriptionIds", {8, 7}}});
  EXPECT_FALSE(stream.wanted(0));
  stream.publish(0, 3, "after");
  EXPECT_EQ(socket.heard.size(), 1U);
}

TEST_F(FoxgloveTest, ASubscriptionWithAUsedNumberReplacesTheOther) {
  begin();
  subscribe(7, 1);
  subscribe(7, 2);
  EXPECT_FALSE(stream.wanted(0));
  stream.publish(1, 1, "x");
  EXPECT_EQ(socket.heard.size(), 1U);
}

TEST_F(FoxgloveTest, ALatchedChannelBeginsWithItsLastMessage) {
  begin();
  EXPECT_TRUE(stream.wanted(1)) << "for later subscribers";
  stream.publish(1, 1, "first");
  stream.publish(1, 2, "last");
  EXPECT_TRUE(socket.heard.empty());
  subscribe(5, 2);
  ASSERT_EQ(socket.heard.size(), 1U);
  EXPECT_EQ(socket.heard[0].bytes, std::string("\x01\x05\0\0\0\x02\0\0\0\0\0\0\0last", 17));
  EXPECT_EQ(socket.heard[0].need, WebSocket::Need::kMust);
}

TEST_F(FoxgloveTest, AClientThatIsGoneGetsNothing) {
  begin();
  subscribe(7, 1);
  conversation.reset();
  EXPECT_FALSE(stream.wanted(0));
  stream.publish(0, 1, "x");
  EXPECT_TRUE(socket.heard.empty());
}

TEST_F(FoxgloveTest, OneSubscriptionTooManyIsRefused) {
  begin();
  for (std::uint32_t id = 0; id < live::kMaxSubscriptions; ++id) subscribe(id, 1);
  EXPECT_TRUE(socket.heard.empty());
  subscribe(live::kMaxSubscriptions, 1);
  const json status = socket.take_json();
  EXPECT_EQ(status["op"], "status");
  EXPECT_EQ(status["level"], 1) << "a warning";
  stream.publish(0, 1, "x");
  EXPECT_EQ(socket.heard.size(), live::kMaxSubscriptions);
  socket.heard.clear();
  subscribe(0, 2);  // instead of another one
  stream.publish(1, 1, "x");
  EXPECT_EQ(socket.heard.size(), 1U) << "a full list still lets a number be used again";
}

TEST_F(FoxgloveTest, WhatItDoesNotUnderstandGetsAWarningAndHarmsNothing) {
  begin();
  const std::string nothing;
  for (const std::string& message :
       {nothing,
        std::string("{"),
        std::string("null"),
        std::string("[]"),
        std::string("\"subscribe\""),
        std::string("{\"op\":1}"),
        std::string("{\"op\":null}"),
        std::string("{}"),
        std::string("\x01\0\0", 3),
        std::string("{\"op\":\"subscribe\"}"),
        std::string("{\"op\":\"subscribe\",\"subscriptions\":{}}"),
        std::string("{\"op\":\"subscribe\",\"subscriptions\":[1]}"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":1}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":0}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":3}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":"1","channelId":"1"}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})"),
        std::string(R"({"op":"subscribe","subscriptions":[{"id":1e400,"channelId":1}]})"),
        std::string(R"({"op":"unsubscribe"})"),
        std::string(R"({"op":"unsubscribe","subscriptionIds":7})"),
        std::string(R"({"op":"advertise","channels":[]})"),
        std::string(R"({"op":"getParameters"})"),
        std::string("{\"op\":\"\xff\xfe\"}"),
        std::string(R"({"op":"\ud83d\ude00)") + std::string(39, 'x') + "\"}"}) {
    conversation->hear(message);
    EXPECT_EQ(socket.take_json()["level"], 1) << message;
    EXPECT_TRUE(socket.heard.empty()) << message;
  }
  EXPECT_FALSE(stream.wanted(0));
  subscribe(7, 1);
  EXPECT_TRUE(stream.wanted(0));
}

TEST_F(FoxgloveTest, AMessageOfNestedListsNeedsNoDeepStack) {
  begin();
  const std::size_t depth = live::kMaxMessage_bytes / 2 - 64;
  const std::string nested = std::string(depth, '[') + std::string(depth, ']');
  for (const std::string& message :
       {nested, R"({"op":)" + nested + "}", R"({"op":"subscribe","subscriptions":)" + nested + "}",
        R"({"op":"subscribe","subscriptions":[{"id":)" + nested + R"(,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":)" + nested + "}"})
    conversation->hear(message);
  EXPECT_FALSE(stream.wanted(0));
}

}  // namespace foxglove_test
