// SPDX-License-Identifier: BSD-3-Clause
// What a subscriber receives, and when: socket pairs stand for the connections of subscribers.

#include <fcntl.h>
#include <gtest/gtest.h>

#include <cstring>
#include <future>
#include <random>

#include "process_visualizer/common/time_slice.hpp"
#include "sender_testing.hpp"

namespace process_visualizer::sender {

namespace {

/// A sender with one subscriber of one topic.
class OneSubscriber : public testing::Test {
 protected:
  TimedSender sender;
  Subscriber subscriber;
  const int topic = sender.addTopic(false, kMuch);
  const int link = sender.addLink(topic, subscriber.peer);
};

TEST(TimedSender, SendsToAllSubscribersOfATopicInOrder) {
  TimedSender sender;
  Subscriber one, other, elsewhere;
  const int topic = sender.addTopic(false, kMuch);
  sender.addLink(topic, one.peer);
  sender.addLink(topic, other.peer);
  sender.addLink(sender.addTopic(false, kMuch), elsewhere.peer);
  for (const char* message : {"a", "", "ccc"}) sender.send(topic, 0, 0, packet(message));
  for (Subscriber* it : {&one, &other}) {
    EXPECT_EQ(it->receive(), "a");
    EXPECT_EQ(it->receive(), "");
    EXPECT_EQ(it->receive(), "ccc");
  }
  EXPECT_FALSE(elsewhere.hasSomething());
}

TEST_F(OneSubscriber, SendsNothingBeforeItIsDue) {
  const std::int64_t begin_ns = monotonicNow();
  for (int number = 1; number <= 20; ++number)
    sender.send(topic, 0, begin_ns + number * 5 * kMs, packet(std::to_string(number)));
  for (int number = 1; number <= 20; ++number) {
    EXPECT_EQ(subscriber.receive(), std::to_string(number));
    EXPECT_GE(monotonicNow(), begin_ns + number * 5 * kMs);
  }
}

TEST_F(OneSubscriber, KeepsTheOrderInWhichMessagesWereGiven) {
  sender.send(topic, 0, monotonicNow() + 20 * kMs, packet("first"));
  sender.send(topic, 0, 0, packet("second"));
  EXPECT_EQ(subscriber.receive(), "first");
  EXPECT_EQ(subscriber.receive(), "second");
}

TEST_F(OneSubscriber, ASmallMessageBeforeALargeOneArrivesFirst) {
  const std::int64_t due_ns = monotonicNow() + 30 * kMs;
  sender.send(topic, 0, due_ns, packet("remove all"));
  sender.send(topic, 0, due_ns + kMs / 3, packet(std::string(60'000, ' ')));
  EXPECT_EQ(subscriber.receive(), "remove all");
  EXPECT_EQ(subscriber.receive().size(), 60'000U);
}

TEST_F(OneSubscriber, WhatIsDueTogetherArrivesInTheOrderInWhichItWasGiven) {
  const std::int64_t due_ns = monotonicNow() + 30 * kMs;
  sender.send(topic, 0, due_ns, numbered(0, 10));
  sender.send(topic, 0, due_ns, numbered(1, 60'000));
  sender.send(topic, 0, due_ns, numbered(2, 10));
  sender.send(topic, 0, due_ns, numbered(3, 900'000));
  EXPECT_EQ(subscriber.receiveNumbers(4), counted(4));
}

TEST_F(OneSubscriber, MessagesThatGoTogetherArriveWholeThoughTheSocketTakesOnlyParts) {
  const int bytes = 4096;
  setsockopt(subscriber.peer, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
  std::mt19937 random(1);
  const std::int64_t due_ns = monotonicNow() + 5 * kMs;
  std::vector<std::size_t> sizes;
  for (int number = 0; number < 900; ++number) {
    sizes.push_back(number % 50 == 0 ? 40'000 : 10 + random() % 300);
    sender.send(topic, 0, due_ns, numbered(number, sizes.back()));
  }
  for (int number = 0; number < 900; ++number) {
    const std::string message = subscriber.receive();
    ASSERT_EQ(std::atoi(message.c_str()), number);
    ASSERT_EQ(message.size(), sizes[number]);
  }
  EXPECT_TRUE(sender.waitUntilSent(5.0));
  EXPECT_EQ(sender.dropped(), 0U);
}

TEST(TimedSender, KeepsTheOrderOfEachTopicWhateverTheSizes) {
  constexpr int kCount = 1000, kTopics = 3;
  TimedSender sender;
  Subscriber subscribers[kTopics];
  std::vector<std::future<std::vector<int>>> received;
  for (Subscriber& it : subscribers) {
    sender.addLink(sender.addTopic(false, {kCount, std::size_t{1} << 32}), it.peer);
    received.push_back(std::async(std::launch::async, [&it] { return it.receiveNumbers(kCount); }));
  }
  std::mt19937 random;
  const std::int64_t begin_ns = monotonicNow() + 100 * kMs;
  for (int number = 0; number < kCount; ++number)
    for (int topic = 0; topic < kTopics; ++topic) {
      const std::size_t size = random() % 4 ? 10 + random() % 100 : 20'000 + random() % 880'000;
      sender.send(topic, 0, begin_ns + number * kMs / 2, numbered(number, size));
    }
  for (auto& numbers : received) EXPECT_EQ(numbers.get(), counted(kCount));
}

TEST(TimedSender, SendsAHundredThousandSmallMessagesOfManyTopicsInASecond) {
  constexpr int kCount = 5'000, kTopics = 20;
  TimedSender sender;
  Subscriber subscribers[kTopics];
  std::vector<std::future<std::vector<int>>> received;
  for (Subscriber& it : subscribers) {
    sender.addLink(sender.addTopic(false, {kCount, 1 << 30}), it.peer);
    received.push_back(std::async(std::launch::async, [&it] { return it.receiveNumbers(kCount); }));
  }
  const std::int64_t begin_ns = monotonicNow() + 500 * kMs;
  for (int number = 0; number < kCount; ++number)
    for (int topic = 0; topic < kTopics; ++topic)
      sender.send(topic, 0, begin_ns + number * kMs / 5 + topic * kMs / 100, numbered(number, 40));
  for (auto& numbers : received) EXPECT_EQ(numbers.get(), counted(kCount));
  EXPECT_GE(monotonicNow(), begin_ns + 999 * kMs);
  EXPECT_LT(monotonicNow(), begin_ns + 4000 * kMs);  // a busy machine may be late
}

TEST_F(OneSubscriber, TakesBackWhatIsNotDue) {
  const std::int64_t later_ns = monotonicNow() + 60'000 * kMs;
  sender.send(topic, 0, later_ns - 1, packet("kept"));
  sender.send(topic, 0, later_ns, packet("a"));
  sender.send(topic, 0, later_ns + 1, packet("b"));
  EXPECT_EQ(sender.revoke(later_ns - 1), 2U);
  EXPECT_EQ(sender.revoke(0), 1U);
  EXPECT_EQ(sender.revoke(0), 0U);
  sender.send(topic, 0, 0, packet("now"));
  EXPECT_EQ(subscriber.receive(), "now");
}

TEST_F(OneSubscriber, CountsWhatIsSentOfEachTopic) {
  const int silent = sender.addTopic(false, kMuch);  // nobody listens
  sender.send(silent, 0, 0, packet("a"));
  for (const char* text : {"b", "c"}) sender.send(topic, 0, 0, packet(text));
  sender.send(topic, 0, monotonicNow() + 60'000 * kMs, packet("later"));
  for (const char* text : {"b", "c"}) EXPECT_EQ(subscriber.receive(), text);
  EXPECT_EQ(sender.sent(silent), 1U);
  EXPECT_EQ(sender.sent(topic), 2U);
  EXPECT_EQ(sender.revoke(0), 1U);
  EXPECT_EQ(sender.sent(topic), 2U);
}

TEST_F(OneSubscriber, LargeMessagesArriveWhole) {
  std::string large(20'000'000, ' ');
  for (std::size_t index = 0; index < large.size(); ++index)
    large[index] = static_cast<char>(index * 2654435761U >> 24);
  sender.send(topic, 0, 0, packet(large));
  sender.send(topic, 0, 0, packet("after"));
  EXPECT_TRUE(subscriber.receive() == large);
  EXPECT_EQ(subscriber.receive(), "after");
  EXPECT_TRUE(sender.waitUntilSent(5.0));
}

TEST_F(OneSubscriber, ALargeMessageIsSentAheadAndArrivesWhenItIsDue) {
  const std::int64_t due_ns = monotonicNow() + 50 * kMs;
  sender.send(topic, 0, due_ns, packet(std::string(2'000'000, ' ')));
  subscriber.waitForSomething();
  if (monotonicNow() >= due_ns) GTEST_SKIP() << "this machine was too busy";
  EXPECT_EQ(sender.revoke(0), 0U);  // it has been begun
  EXPECT_EQ(subscriber.receive().size(), 2'000'000U);
  EXPECT_GE(monotonicNow(), due_ns);
}

TEST(TimedSender, WhatIsBeforeABegunMessageIsNotTakenBack) {
  TimedSender sender;
  Subscriber small, large;
  const int topic = sender.addTopic(false, kMuch), other = sender.addTopic(false, kMuch);
  sender.addLink(topic, small.peer);
  sender.addLink(other, large.peer);
  const std::int64_t due_ns = monotonicNow() + 50 * kMs;
  sender.send(topic, 0, due_ns - 1, packet("before"));
  sender.send(other, 0, due_ns, packet(std::string(2'000'000, ' ')));
  sender.send(topic, 0, due_ns, packet("with it"));
  sender.send(topic, 0, due_ns + 60'000 * kMs, packet("after"));
  large.waitForSomething();
  EXPECT_EQ(sender.revoke(0), 1U);
  sender.send(topic, 0, 0, packet("instead"));
  EXPECT_EQ(small.receive(), "before");
  EXPECT_EQ(small.receive(), "with it");
  EXPECT_EQ(small.receive(), "instead");
}

TEST(TimedSender, WhatIsSentAtOnceBehindABegunMessageIsNotTakenBack) {
  TimedSender sender;
  Subscriber small, large;
  const int topic = sender.addTopic(false, kMuch), other = sender.addTopic(false, kMuch);
  sender.addLink(topic, small.peer);
  sender.addLink(other, large.peer);
  sender.send(other, 0, monotonicNow() + 50 * kMs, packet(std::string(150'000, ' ')));
  large.waitForSomething();
  sender.send(topic, 0, 0, packet("at once"));
  sender.send(topic, 0, monotonicNow() + 60'000 * kMs, packet("later"));
  EXPECT_EQ(sender.revoke(monotonicNow()), 1U);
  EXPECT_EQ(sender.revoke(monotonicNow()), 0U);
  EXPECT_EQ(small.receive(), "at once");
}

TEST_F(OneSubscriber, WhatIsSentAtOnceKeepsWhatWasGivenBefore) {
  sender.send(topic, 0, monotonicNow() + 30 * kMs, packet("before"));
  sender.send(topic, 0, 0, packet("at once"));
  EXPECT_EQ(sender.revoke(0), 0U);
  EXPECT_EQ(subscriber.receive(), "before");
  EXPECT_EQ(subscriber.receive(), "at once");
}

TEST_F(OneSubscriber, ALargeMessageIsNotBegunBeforeTheOneBeforeItHasGone) {
  const std::int64_t due_ns = monotonicNow() + 60 * kMs;
  sender.send(topic, 0, due_ns, packet(std::string(900'000, ' ')));
  sender.send(topic, 0, due_ns + kMs, packet(std::string(900'000, ' ')));
  subscriber.waitForSomething();
  const std::size_t revoked = sender.revoke(0);
  if (monotonicNow() >= due_ns) GTEST_SKIP() << "this machine was too busy";
  EXPECT_EQ(revoked, 1U);
}

TEST(TimedSender, ASmallMessageDoesNotWaitForALargeOneOfAnotherTopic) {
  TimedSender sender;
  Subscriber slow, quick;
  const int large = sender.addTopic(false, kMuch), small = sender.addTopic(false, kMuch);
  sender.addLink(large, slow.peer);
  sender.addLink(small, quick.peer);
  sender.send(large, 0, 0, packet(std::string(20'000'000, ' ')));
  sender.send(small, 0, 0, packet("small"));
  EXPECT_EQ(quick.receive(), "small");  // while nobody takes the large one
}

TEST(TimedSender, ASlowSubscriberLosesTheOldestAndTheyAreCounted) {
  TimedSender sender;
  Subscriber slow;
  const int topic = sender.addTopic(false, {3, 1 << 30});
  sender.addLink(topic, slow.peer);
  sender.send(topic, 0, 0, packet(std::string(20'000'000, ' ')));  // more than the socket takes
  ASSERT_FALSE(sender.waitUntilSent(0.05));
  for (int number = 0; number < 10; ++number)
    sender.send(topic, 0, 0, packet(std::to_string(number)));
  ASSERT_FALSE(sender.waitUntilSent(0.05));
  EXPECT_EQ(sender.dropped(), 8U);
  EXPECT_EQ(slow.receive().size(), 20'000'000U);
  EXPECT_EQ(slow.receive(), "8");
  EXPECT_EQ(slow.receive(), "9");
}

TEST(TimedSender, TheQueueIsBoundedInBytes) {
  TimedSender sender;
  Subscriber slow;
  const int topic = sender.addTopic(false, {1000, 3'000'000});
  const int link = sender.addLink(topic, slow.peer);
  for (int number = 0; number < 10; ++number)
    sender.send(topic, 0, 0, packet(std::string(1'000'000, ' ')));
  ASSERT_FALSE(sender.waitUntilSent(0.05));
  EXPECT_EQ(sender.dropped(), 8U);
  sender.removeLink(link);
  EXPECT_EQ(sender.dropped(), 8U);
}

TEST(TimedSender, NewSubscribersGetWhatWasLatchedOfEachSource) {
  TimedSender sender;
  Subscriber early, late;
  const int topic = sender.addTopic(true, kMuch);
  sender.addLink(topic, early.peer);
  sender.send(topic, 1, 0, packet("old"));
  sender.send(topic, 1, 0, packet("one"));
  sender.send(topic, 2, 0, packet("two"));
  sender.send(topic, 2, monotonicNow() + 60'000 * kMs, packet("not yet"));
  for (const char* expected : {"old", "one", "two"}) EXPECT_EQ(early.receive(), expected);
  sender.addLink(topic, late.peer);
  EXPECT_EQ(late.receive(), "one");
  EXPECT_EQ(late.receive(), "two");
}

TEST(TimedSender, NewSubscribersGetWhatWasLatchedInTheOrderOfSending) {
  TimedSender sender;
  Subscriber early, late;
  const int topic = sender.addTopic(true, kMuch);
  sender.addLink(topic, early.peer);
  sender.send(topic, 1, 0, packet("one"));
  sender.send(topic, 2, 0, packet("two"));
  sender.send(topic, 1, 0, packet("one again"));
  for (const char* expected : {"one", "two", "one again"}) EXPECT_EQ(early.receive(), expected);
  sender.addLink(topic, late.peer);
  EXPECT_EQ(late.receive(), "two");
  EXPECT_EQ(late.receive(), "one again");
}

TEST(TimedSender, WhatIsWithdrawnIsNotLatchedAnyMore) {
  TimedSender sender;
  Subscriber early, late;
  const int topic = sender.addTopic(true, kMuch);
  sender.addLink(topic, early.peer);
  sender.send(topic, 1, 0, packet("one"));
  sender.send(topic, 2, 0, packet("two"));
  sender.send(topic, 1, monotonicNow(), std::make_shared<const Packet>());
  sender.send(topic, 2, monotonicNow() + 60'000 * kMs, std::make_shared<const Packet>());
  EXPECT_EQ(sender.revoke(monotonicNow() + 1'000 * kMs), 1U);
  for (const char* expected : {"one", "two"}) EXPECT_EQ(early.receive(), expected);
  EXPECT_TRUE(sender.waitUntilSent(5.0));
  sender.addLink(topic, late.peer);
  sender.send(topic, 1, 0, packet("three"));
  for (const char* expected : {"two", "three"}) EXPECT_EQ(late.receive(), expected);
  EXPECT_EQ(early.receive(), "three");
  EXPECT_EQ(sender.sent(topic), 3U);
}

TEST(TimedSender, ANewSubscriberGetsALatchedMessageNotBeforeItIsDue) {
  TimedSender sender;
  Subscriber early, late;
  const int topic = sender.addTopic(true, kMuch);
  sender.addLink(topic, early.peer);
  const std::int64_t due_ns = monotonicNow() + 100 * kMs;
  sender.send(topic, 0, due_ns, packet(std::string(900'000, ' ')));
  early.waitForSomething();
  sender.addLink(topic, late.peer);
  EXPECT_EQ(late.receive().size(), 900'000U);
  EXPECT_GE(monotonicNow(), due_ns);
}

TEST(TimedSender, TellsOfASubscriberThatGoesAway) {
  TimedSender sender;
  Subscriber going, staying;
  const int topic = sender.addTopic(false, kMuch);
  const int link = sender.addLink(topic, going.peer);
  sender.addLink(topic, staying.peer);
  going.leave();
  EXPECT_EQ(sender.waitForBroken(), link);
  sender.send(topic, 0, 0, packet("on"));
  EXPECT_EQ(staying.receive(), "on");
  EXPECT_TRUE(sender.waitUntilSent(5.0));
  sender.removeLink(link);
  sender.send(topic, 0, 0, packet("and on"));
  EXPECT_EQ(staying.receive(), "and on");
}

TEST(TimedSender, ASubscriberThatGoesAwayInTheMiddleOfAMessageHoldsUpNothing) {
  TimedSender sender;
  Subscriber going;
  const int topic = sender.addTopic(false, kMuch);
  const int link = sender.addLink(topic, going.peer);
  sender.send(topic, 0, 0, packet(std::string(20'000'000, ' ')));
  ASSERT_FALSE(sender.waitUntilSent(0.05));
  going.leave();
  EXPECT_EQ(sender.waitForBroken(), link);
  EXPECT_TRUE(sender.waitUntilSent(5.0));
}

TEST(TimedSender, ClosingEndsTheWaits) {
  TimedSender sender;
  Subscriber slow;
  sender.addLink(sender.addTopic(false, kMuch), slow.peer);
  sender.send(0, 0, 0, packet(std::string(20'000'000, ' ')));
  auto broken = std::async(std::launch::async, [&] { return sender.waitForBroken(); });
  auto sent = std::async(std::launch::async, [&] { return sender.waitUntilSent(60.0); });
  sender.close();
  EXPECT_EQ(broken.get(), -1);
  EXPECT_FALSE(sent.get());
}

TEST(TimedSender, RefusesWhatIsNoSocket) {
  TimedSender sender;
  EXPECT_THROW(sender.addLink(sender.addTopic(false, kMuch), -1), std::system_error);
}

}  // namespace

}  // namespace process_visualizer::sender

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  process_visualizer::takeRealTimePriority();  // where it is allowed, times hold beside other work
  return RUN_ALL_TESTS();
}
