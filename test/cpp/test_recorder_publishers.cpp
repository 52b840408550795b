// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <ros/time.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/publishers.hpp"
#include "process_visualizer/recorder/topic_choice.hpp"

namespace process_visualizer::recorder {
namespace {

using Names = std::set<std::string>;
using XmlRpc::XmlRpcValue;

XmlRpcValue list(const std::vector<XmlRpcValue>& values) {
  XmlRpcValue result;
  result.setSize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) result[i] = values[i];
  return result;
}

XmlRpcValue connection(const std::string& peer, const std::string& direction,
                       const std::string& topic) {
  return list({1, peer, direction, "TCPROS", topic, true});
}

/// One value of every type that XML-RPC has.
std::vector<XmlRpcValue> valuesOfAllTypes() {
  XmlRpcValue structure;
  structure["faultCode"] = 1;
  XmlRpcValue empty_list;
  empty_list.setSize(0);
  return {{}, 1, true, 0.5, "text", structure, empty_list, list({"text"}), list({list({})})};
}

TEST(Connections, AreReadInBothDirections) {
  XmlRpcValue answer = list({1, "",
                             list({connection("/me", "o", "/a"), connection("/you", "o", "/b"),
                                   connection("http://x:1/", "i", "/c")})});
  EXPECT_EQ(linksTo("/me", answer), (Links{{"/a", 1}}));
  EXPECT_EQ(linksFrom("http://x:1/", answer), (Links{{"/c", 1}}));
}

TEST(Connections, OfOddAnswersAreNotKnown) {
  for (XmlRpcValue odd : valuesOfAllTypes()) {
    EXPECT_EQ(linksTo("/me", odd), std::nullopt);
    XmlRpcValue odd_code = list({odd, "", list({})});
    EXPECT_EQ(linksTo("/me", odd_code).has_value(), odd.getType() == XmlRpcValue::TypeInt);
    XmlRpcValue odd_connection = list({1, "", list({odd})});
    EXPECT_EQ(linksTo("/me", odd_connection), std::nullopt);
    EXPECT_EQ(linksFrom("/me", odd_connection), Links{});
    if (odd.getType() == XmlRpcValue::TypeArray) continue;
    XmlRpcValue odd_list = list({1, "", odd});
    EXPECT_EQ(linksTo("/me", odd_list), std::nullopt);
    XmlRpcValue odd_field = list({1, "", list({list({1, odd, odd, odd, odd})})});
    EXPECT_EQ(linksTo("/me", odd_field).has_value(), odd.getType() == XmlRpcValue::TypeString);
  }
  XmlRpcValue error = list({0, "no", list({connection("/me", "o", "/a")})});
  EXPECT_EQ(linksTo("/me", error), std::nullopt);
}

TEST(SystemState, IsReadWhateverItIs) {
  XmlRpcValue state = list({list({list({"/a", list({"/n", "/m"})})}), list({}), list({})});
  EXPECT_EQ(publishersIn(state), (Publishers{{"/a", {"/m", "/n"}}}));
  for (XmlRpcValue odd : valuesOfAllTypes()) {
    XmlRpcValue odd_topics = list({odd}), odd_nodes = list({list({list({"/a", odd})})});
    publishersIn(odd);
    publishersIn(odd_topics);
    publishersIn(odd_nodes);
  }
}

TEST(Text, KeepsWhatIsUtf8) {
  for (const std::string good : {"", "a\n", "\xC3\xBC", "\xE2\x82\xAC", "\xF0\x9F\x99\x82",
                                 "\xEF\xBF\xBF", "\xF4\x8F\xBF\xBF", "\xED\x9F\xBF"})
    EXPECT_EQ(validUtf8(good), good);
}

TEST(Text, ReplacesEveryOtherByte) {
  const std::string odd = "\xEF\xBF\xBD";
  EXPECT_EQ(validUtf8("20 \xB0"
                      "C"),
            "20 " + odd + "C");
  EXPECT_EQ(validUtf8("a\xC3"), "a" + odd);
  EXPECT_EQ(validUtf8("\xC0\x80"), odd + odd);            // longer than necessary
  EXPECT_EQ(validUtf8("\xED\xA0\x80"), odd + odd + odd);  // a surrogate
  EXPECT_EQ(validUtf8("\xF4\x90\x80\x80").size(), 12u);   // beyond the last code point
  EXPECT_EQ(validUtf8("\xF5"
                      "abc"),
            odd + "abc");
}

TEST(Header, HasWhatHasToBeThere) {
  const Connection odd = connectionWith("/a", {{"type", "a/A"}, {"callerid", "/n\xFF"}});
  EXPECT_EQ(odd.field("callerid"), "/n\xEF\xBF\xBD");
  EXPECT_EQ(odd.field("topic"), "/a");
  EXPECT_EQ(odd.header.count("message_definition"), 1u);
}

TEST(Choice, TakesNamesAndWhatMatches) {
  TopicChoice choice({"a"}, {"/b.*", "/c"}, {"/.*x"});
  EXPECT_EQ(choice.names(), Names{"/a"});
  const Publishers publishers = {
      {"/b1", {}}, {"/bx", {}}, {"/b/own/1", {}}, {"/cc", {}}, {"/d", {}}};
  EXPECT_TRUE(choice.follow(publishers, {"/b/own/"}));
  EXPECT_EQ(choice.names(), (Names{"/a", "/b1"}));
  EXPECT_FALSE(choice.follow(publishers, {"/b/own/"}));
  EXPECT_TRUE(choice.follow({{"/c", {}}}, {}));
  EXPECT_TRUE(choice.contains("/b1"));  // though nobody publishes it any more
}

TEST(Choice, OfWhatIsNoExpressionOrNameIsRefused) {
  EXPECT_THROW(TopicChoice({}, {"("}, {}), RecordingError);
  EXPECT_THROW(TopicChoice({}, {}, {"*"}), RecordingError);
  EXPECT_THROW(TopicChoice({"a b"}, {}, {}), RecordingError);
  EXPECT_TRUE(TopicChoice({}, {}, {"a"}).isEmpty());
  EXPECT_THROW(TopicChoice({std::string(1'000'000, 'x')}, {}, {}), RecordingError);
  EXPECT_THROW(TopicChoice({}, std::vector<std::string>(1000, "a"), {}), RecordingError);
}

TEST(Choice, HasNoMoreTopicsThanCanBeConnected) {
  std::vector<std::string> names;
  Publishers publishers;
  for (int i = 0; i < 20'000; ++i) {
    names.push_back("/t" + std::to_string(i));
    publishers[names.back()];
  }
  try {
    const TopicChoice all(names, {}, {});
    ADD_FAILURE() << "it is taken";
  } catch (const RecordingError& error) {
    EXPECT_STREQ(error.what(), "20000 topics are named; at most 2000 are recorded at once");
  }
  TopicChoice matching({}, {"/t.*"}, {});
  EXPECT_TRUE(matching.follow(publishers, {}));
  EXPECT_TRUE(matching.isFull());
  EXPECT_EQ(matching.names().size(), kMaxTopics);
  EXPECT_FALSE(matching.follow(publishers, {}));
}

int receiveBytes(int descriptor) {
  int bytes = 0;
  socklen_t length = sizeof bytes;
  getsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &bytes, &length);
  return bytes;
}

TEST(Connections, KeepLittleUnread) {
  const int server = socket(AF_INET, SOCK_STREAM, 0), client = socket(AF_INET, SOCK_STREAM, 0);
  const int own = 4096;
  for (const int descriptor : {server, client})
    ASSERT_EQ(setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &own, sizeof own), 0);
  sockaddr_in address{};
  socklen_t length = sizeof address;
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* const place = reinterpret_cast<sockaddr*>(&address);
  ASSERT_EQ(bind(server, place, sizeof address), 0);
  ASSERT_EQ(listen(server, 1), 0);
  ASSERT_EQ(getsockname(server, place, &length), 0);
  ASSERT_EQ(connect(client, place, sizeof address), 0);
  const int before = receiveBytes(server);
  limitUnread();
  EXPECT_EQ(receiveBytes(server), before);  // no connection
  EXPECT_GT(receiveBytes(client), before);
  EXPECT_LT(receiveBytes(client), 900000);  // less than a color image
  close(client);
  close(server);
}

TEST(Choice, NoExpressionKeepsTheRecorderBusy) {
  // Anyone who reaches the recorder can send an expression; only those that need little time are
  // accepted.
  EXPECT_THROW(TopicChoice({}, {"(/a)\\1"}, {}), RecordingError);
  const std::string brackets(100000, '(');
  EXPECT_THROW(TopicChoice({}, {brackets + std::string(brackets.size(), ')')}, {}), RecordingError);
  EXPECT_THROW(TopicChoice({}, {".{1,90000}"}, {}), RecordingError);
  const std::string name = "/" + std::string(300, 'a');
  EXPECT_FALSE(TopicChoice({}, {"(.*)*x"}, {}).wouldTake(name));
  EXPECT_TRUE(TopicChoice({}, {"(.*)*"}, {"((a*)*)*x"}).wouldTake(name));
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
