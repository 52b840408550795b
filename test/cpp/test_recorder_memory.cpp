// SPDX-License-Identifier: BSD-3-Clause
// The recorder's memory: the last seconds, latched messages, and answers about them.
#include <gtest/gtest.h>

#include <cstring>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/recorder/intake.hpp"
#include "process_visualizer/recorder/recent_messages.hpp"
#include "recorder_messages.hpp"

namespace process_visualizer::recorder {
namespace {

TEST(Recent, IsBoundedInTimeAndBytes) {
  RecentMessages recent(10, 1000);
  const auto connection = connectionWith("");
  for (int i = 1; i <= 30; ++i) recent.add(messageAt(i, connection, 50));
  EXPECT_DOUBLE_EQ(recent.ageOfOldestUnrecorded(ros::Time(30)), 10);
  EXPECT_EQ(recent.bytes(), 11u * 50);
  EXPECT_EQ(recent.last(ros::Time(30), 3).messages.size(), 4u);
  EXPECT_TRUE(recent.last(ros::Time(30), 0).messages.empty());
  recent.add(messageAt(31, connection, 900));
  EXPECT_LE(recent.bytes(), 1000u);
  recent.add(messageAt(32, connection, 2000));
  EXPECT_EQ(recent.bytes(), 0u);
}

TEST(Recent, ReachesBackFromNow) {
  RecentMessages recent(10, 1000);
  const auto connection = connectionWith("");
  EXPECT_EQ(recent.ageOfOldestUnrecorded(ros::Time(1)), 0);
  recent.add(messageAt(1, connection, 50));
  recent.setRecorded();
  for (int i = 2; i <= 4; ++i) recent.add(messageAt(i, connection, 50));
  EXPECT_DOUBLE_EQ(recent.ageOfOldestUnrecorded(ros::Time(4)), 2);
  EXPECT_DOUBLE_EQ(recent.ageOfOldestUnrecorded(ros::Time(9)),
                   7);  // nothing has come since, or nobody took it
  EXPECT_EQ(recent.last(ros::Time(9), 7).messages.size(), 3u);
  EXPECT_DOUBLE_EQ(recent.ageOfOldestUnrecorded(ros::Time(13)), 10);
  EXPECT_EQ(recent.last(ros::Time(13), 10).messages.size(), 2u);
  EXPECT_EQ(recent.ageOfOldestUnrecorded(ros::Time(15)), 0);
  EXPECT_EQ(recent.ageOfOldestUnrecorded(ros::Time(1)), 0);  // the clock was set back
}

TEST(Recent, BeginsWithWhatWasLatchedThen) {
  RecentMessages recent(10, 1000);
  const auto connection = connectionWith("", "1");
  const auto sizeOfLatched = [&recent](double duration_s) {
    const auto latched = recent.last(ros::Time(20), duration_s).latched.at(ros::Time(20));
    return latched.empty() ? 0u : latched.at(0).size();
  };
  recent.add(messageAt(1, connection, 11));
  recent.add(messageAt(12, connection, 12));
  recent.add(messageAt(18, connection, 18));
  EXPECT_EQ(sizeOfLatched(10), 11u);
  EXPECT_EQ(sizeOfLatched(5), 12u);
  EXPECT_EQ(sizeOfLatched(0), 18u);
  recent.addIfLatched(messageAt(19, connection, 19));
  EXPECT_EQ(sizeOfLatched(10), 19u);
  recent.clear();
  EXPECT_EQ(sizeOfLatched(10), 18u);
  recent.forget();
  EXPECT_EQ(sizeOfLatched(10), 0u);
}

TEST(Recent, GivesAllOfItWhateverARecordingHas) {
  RecentMessages recent(10, 1 << 20);
  const auto latching = connectionWith("", "1"), other = connectionWith("");
  const auto sizes = [&recent](double duration_s) {
    const Past past = recent.all(ros::Time(20), duration_s);
    std::vector<std::size_t> all;
    for (const Message& message : past.latched.at(ros::Time(20))) all.push_back(message.size());
    for (const Message& message : past.messages) all.push_back(message.size());
    return all;
  };
  using Sizes = std::vector<std::size_t>;
  recent.add(messageAt(1, latching, 11));
  EXPECT_EQ(sizes(100), Sizes({11}));
  recent.add(messageAt(12, other, 12));  // the one before is latched only from here on
  recent.setRecorded();
  recent.add(messageAt(18, latching, 18));
  recent.add(messageAt(19, other, 19));
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(sizes(100), Sizes({11, 12, 18, 19}));
    EXPECT_EQ(sizes(5), Sizes({11, 18, 19}));
    EXPECT_EQ(sizes(1), Sizes({18, 19}));
    EXPECT_EQ(sizes(0), Sizes({18}));
    EXPECT_EQ(recent.last(ros::Time(20), 100).messages.size(), i == 0 ? 2u : 0u);
    recent.setRecorded();
  }
  EXPECT_EQ(recent.matching({0, {"/a"}}).messages.front().size(), 11u);
  recent.add(messageAt(29, other, 29));  // 12 and 18 leave the memory
  EXPECT_EQ(sizes(100), Sizes({18, 19, 29}));
  recent.add(messageAt(40, other, 40));
  EXPECT_EQ(sizes(100), Sizes({18, 40}));
  recent.clear();
  EXPECT_EQ(sizes(100), Sizes({18}));
  recent.forget();
  EXPECT_EQ(sizes(100), Sizes());
}

TEST(Recent, IsReadPartByPart) {
  RecentMessages recent(10, 1 << 20);
  const std::set<std::string> wanted = {"/a"};
  const auto latched = latchedBy("/n"), other = latchedBy("/n", "/b");
  recent.add(messageAt(1, latched, 11));
  EXPECT_EQ(recent.matching({0, wanted}).messages.size(), 1u);
  for (int i = 2; i <= 30; ++i) recent.add(messageAt(i, connectionWith(""), 100));
  recent.add(messageAt(30, other, 100));
  const NumberedMessages all = recent.matching({0, wanted});
  ASSERT_EQ(all.messages.size(), 12u);  // the latched one, and eleven of ten seconds
  EXPECT_EQ(all.messages[0].size(), 11u);
  EXPECT_LT(all.messages[0].time, all.messages[1].time);
  EXPECT_EQ(all.next, 32u);
  EXPECT_FALSE(all.is_cut);
  recent.add(messageAt(31, connectionWith(""), 100));
  const NumberedMessages new_ones = recent.matching({all.next, wanted});
  ASSERT_EQ(new_ones.messages.size(), 1u);
  EXPECT_EQ(new_ones.messages[0].time, ros::Time(31));
  EXPECT_TRUE(recent.matching({new_ones.next, wanted}).messages.empty());
  EXPECT_EQ(recent.matching({1, wanted}).messages.size(), 11u);  // the others are forgotten
  const NumberedMessages some = recent.matching({1, wanted, 0, 250});
  EXPECT_EQ(some.messages.size(), 3u);
  EXPECT_TRUE(some.is_cut);
  EXPECT_EQ(recent.matching({some.next, wanted}).messages.size(), 8u);
  EXPECT_TRUE(recent.matching({1, wanted, 99}).messages.empty());  // these are larger
  recent.clear();
  EXPECT_EQ(recent.matching({1, wanted}).next, 33u);
  EXPECT_EQ(recent.matching({99, wanted}).next, 33u);  // of a recorder that ran before
}

TEST(Latched, KeepsTheNewestOfEachPublisher) {
  LatchedMessages latched;
  const auto connection = connectionWith("", "1");
  latched.add(messageAt(1, connection, 10));
  latched.add(messageAt(2, connection, 20));
  latched.add(messageAt(3, connectionWith(""), 30));
  const auto messages = latched.at(ros::Time(5));
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].size(), 20u);
  EXPECT_EQ(messages[0].time, ros::Time(4, 999999999));
}

TEST(Latched, ComeInTheOrderInWhichTheyCame) {
  LatchedMessages latched;
  for (const auto& [node, size] : {std::pair{"/z", 1}, {"/b", 2}, {"/a", 3}, {"/z", 4}})
    latched.add(messageAt(1, latchedBy(node), size));
  std::vector<std::size_t> sizes;
  ros::Time last;
  for (const Message& message : latched.at(ros::Time(5))) {
    sizes.push_back(message.size());
    EXPECT_LT(last, message.time);
    last = message.time;
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{2, 3, 4}));
  EXPECT_LT(last, ros::Time(5));
}

TEST(Latched, OfPublishersThatAreGoneAreForgottenWhenTheyAreReplaced) {
  LatchedMessages latched;
  const auto isGone = [](const Message& message) { return message.size() != 2; };
  latched.add(messageAt(1, latchedBy("/old"), 1));
  latched.forgetReplaced(isGone);
  EXPECT_EQ(latched.at(ros::Time(5)).size(), 1u);
  latched.add(messageAt(1, latchedBy("/new"), 2));
  latched.add(messageAt(1, latchedBy("/old", "/tf_static"), 3));
  latched.add(messageAt(1, latchedBy("/new", "/tf_static"), 2));
  latched.add(messageAt(1, latchedBy("/old", FixedFrames::kOthers), 4));
  latched.add(messageAt(1, latchedBy("/new", FixedFrames::kOthers), 2));
  latched.forgetReplaced(isGone);
  std::vector<std::size_t> sizes;
  for (const Message& message : latched.at(ros::Time(5))) sizes.push_back(message.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{2, 3, 2, 4, 2}));
}

/// Answers about an intake of /a and /b.
class Answers : public testing::Test {
 protected:
  Answers() { intake_.choose(TopicChoice({"/a", "/b"}, {}, {})); }

  ReadRecent::Response ask(std::uint64_t first, std::uint32_t known = 0, std::uint32_t largest = 0,
                           const std::string& topic = "/a") {
    ReadRecent::Request request;
    request.topics = {topic};
    request.first = first;
    request.known = known;
    request.largest = largest;
    ReadRecent::Response response;
    answers_.answer(request, response);
    return response;
  }
  /// The numbers that messages begin with, after the headers of their records.
  static std::vector<std::uint32_t> sequencesIn(const ReadRecent::Response& response) {
    std::vector<std::uint32_t> numbers;
    std::size_t place = 0;
    for (const std::uint32_t size : response.sizes) {
      std::uint32_t number;
      std::memcpy(&number, response.records.data() + place + 16, sizeof number);
      numbers.push_back(number);
      place += size;
    }
    EXPECT_EQ(place, response.records.size());
    return numbers;
  }

  Intake intake_{"/recorder", {60, 1 << 30}, [] {}};
  RecentAnswers answers_{[this](const MessageQuery& query) { return intake_.recent(query); }};
};

using Numbers = std::vector<std::uint32_t>;

TEST_F(Answers, ComeInPartsWhereThereIsMuch) {
  const auto connection = connectionOf("/a");
  for (unsigned i = 0; i < 12; ++i) intake_.receive(messageAt(1 + i, connection, 1'000'000, i));
  const ReadRecent::Response first = ask(0), second = ask(first.next, 1),
                             last = ask(second.next, 1);
  EXPECT_EQ(sequencesIn(first), (Numbers{0, 1, 2, 3, 4}));
  EXPECT_EQ(sequencesIn(second), (Numbers{5, 6, 7, 8, 9}));
  EXPECT_EQ(sequencesIn(last), (Numbers{10, 11}));
  EXPECT_TRUE(first.more && second.more);
  EXPECT_FALSE(last.more);
  EXPECT_EQ(last.times, (std::vector<std::uint64_t>{11'000'000'000, 12'000'000'000}));
  EXPECT_TRUE(sequencesIn(ask(last.next, 1)).empty());
  EXPECT_TRUE(sequencesIn(ask(0, 0, 999'999)).empty());  // these are larger
}

TEST_F(Answers, DescribeEachConnectionOnce) {
  intake_.receive(messageAt(1, connectionOf("/a", "/m"), 100, 1));
  const ReadRecent::Response first = ask(0);
  EXPECT_EQ(first.connections, (std::vector<std::string>{"/a", "a/A", "0", "float32 x", "/m"}));
  EXPECT_EQ(first.numbers, Numbers{0});
  intake_.receive(messageAt(2, connectionOf("/b"), 100, 2));
  intake_.receive(messageAt(3, connectionOf("/a"), 100, 3));
  const ReadRecent::Response second = ask(first.next, first.connection_count);
  EXPECT_EQ(second.connections, (std::vector<std::string>{"/a", "a/A", "0", "float32 x", "/n"}));
  EXPECT_EQ(second.numbers, Numbers{1});
  EXPECT_EQ(second.connection_count, 2u);
  EXPECT_EQ(ask(0, 0, 0, "/b").connections.size(), 15u);  // whoever asks anew is told all
}

TEST_F(Answers, AboutWhatNobodyWatchesAreEmpty) {
  const ReadRecent::Response answer = ask(0, 0, 0, "/c");
  EXPECT_TRUE(answer.numbers.empty() && answer.connections.empty());
  EXPECT_FALSE(answer.more || answer.anew);
}

TEST_F(Answers, BeginAnewForWhoKnowsMoreThanThereIs) {
  intake_.receive(messageAt(1, connectionOf("/a"), 100, 1));
  ask(0);
  for (const auto& [next, known] : {std::pair{99u, 1u}, {2u, 7u}}) {  // of the recorder before
    const ReadRecent::Response answer = ask(next, known);
    EXPECT_TRUE(answer.anew);
    EXPECT_EQ(sequencesIn(answer), Numbers{1});
    EXPECT_EQ(answer.connections.size(), 5u);
  }
  EXPECT_FALSE(ask(2, 1).anew);
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
