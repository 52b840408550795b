// SPDX-License-Identifier: BSD-3-Clause
// Messages that subscribers receive, and their times: the clock is simulated, and socket pairs
// stand for the connections of subscribers.

#include <gtest/gtest.h>

#include <future>
#include <random>

#include "sender_testing.hpp"

namespace process_visualizer::sender {

namespace {

constexpr std::size_t kLength = sizeof(std::uint32_t);  // of the number before each message

/// A sender with one subscriber of one topic.
class OneSubscriber : public testing::Test {
 protected:
  SimulatedSender sender;
  SimulatedTime& time = sender.time;
  Subscriber subscriber{sender};
  const int topic = sender.addTopic(false, kMuch);
  const int link = sender.addLink(topic, subscriber.peer());
};

/// A sender with a topic for small messages and one for large ones, with a subscriber each.
class SmallAndLarge : public testing::Test {
 protected:
  SimulatedSender sender;
  SimulatedTime& time = sender.time;
  Subscriber small{sender}, large{sender};
  const int topic = sender.addTopic(false, kMuch), other = sender.addTopic(false, kMuch);
  const int link = sender.addLink(topic, small.peer()),
            other_link = sender.addLink(other, large.peer());
};

/// A sender with a latched topic, a subscriber, and one that will come later.
class EarlyAndLate : public testing::Test {
 protected:
  SimulatedSender sender;
  SimulatedTime& time = sender.time;
  Subscriber early{sender}, late{sender};
  const int topic = sender.addTopic(true, kMuch);
  const int link = sender.addLink(topic, early.peer());
};

TEST(TimedSender, SendsByTheClockOfTheComputer) {
  const Connection connection;
  TimedSender sender;
  const int topic = sender.addTopic(false, kMuch);
  sender.addLink(topic, connection.ends[1]);
  const std::int64_t due_ns = monotonicNow() + 20 * kMs;
  sender.send(topic, 0, due_ns, packet("message"));
  std::array<char, 11> received;
  ASSERT_EQ(recv(connection.ends[0], received.data(), received.size(), MSG_WAITALL), 11);
  EXPECT_EQ(std::string(received.data() + kLength, 7), "message");
  EXPECT_GE(monotonicNow(), due_ns);
}

TEST(TimedSender, SendsToAllSubscribersOfATopicInOrder) {
  SimulatedSender sender;
  Subscriber one(sender), other(sender), elsewhere(sender);
  const int topic = sender.addTopic(false, kMuch);
  sender.addLink(topic, one.peer());
  sender.addLink(topic, other.peer());
  sender.addLink(sender.addTopic(false, kMuch), elsewhere.peer());
  for (const char* message : {"a", "", "ccc"}) sender.send(topic, 0, 0, packet(message));
  for (Subscriber* it : {&one, &other})
    for (const char* message : {"a", "", "ccc", "nothing"}) EXPECT_EQ(it->receive(), message);
  EXPECT_EQ(elsewhere.byteCount(), 0U);
}

TEST_F(OneSubscriber, SendsEachMessageWhenItIsDueAndNotBefore) {
  for (int number = 1; number <= 20; ++number)
    sender.send(topic, 0, kBeginNs + number * 5 * kMs, packet(std::to_string(number)));
  for (int number = 1; number <= 20; ++number) {
    time.advanceTo(kBeginNs + number * 5 * kMs - 1);
    EXPECT_EQ(subscriber.receive(), "nothing");
    time.advanceTo(kBeginNs + number * 5 * kMs);
    EXPECT_EQ(subscriber.receive(), std::to_string(number));
  }
}

TEST_F(OneSubscriber, WhatComesInThePlaceOfSomethingLaterIsSentInTime) {
  sender.send(topic, 0, kBeginNs + kLongNs, packet("later"));
  time.settle();  // it waits for that
  sender.revoke(kBeginNs);
  sender.send(topic, 0, kBeginNs + 2 * kMs, packet("sooner"));
  time.advanceTo(kBeginNs + 2 * kMs);
  EXPECT_EQ(subscriber.receive(), "sooner");
}

TEST_F(SmallAndLarge, NothingIsSentBeforeWhatWasGivenBeforeOnAnotherTopic) {
  sender.send(other, 0, kBeginNs + 20 * kMs, packet("first"));
  sender.send(topic, 0, 0, packet("second"));
  time.advanceTo(kBeginNs + 20 * kMs - 1);
  EXPECT_EQ(small.receive(), "nothing");
  time.advanceTo(kBeginNs + 20 * kMs);
  EXPECT_EQ(small.receive(), "second");
}

TEST_F(OneSubscriber, KeepsTheOrderInWhichMessagesWereGiven) {
  sender.send(topic, 0, kBeginNs + 20 * kMs, packet("first"));
  sender.send(topic, 0, 0, packet("second"));
  EXPECT_EQ(subscriber.receive(), "nothing");
  time.advanceTo(kBeginNs + 20 * kMs);
  EXPECT_EQ(subscriber.receive(), "first");
  EXPECT_EQ(subscriber.receive(), "second");
}

TEST_F(OneSubscriber, ASmallMessageBeforeALargeOneArrivesFirst) {
  const std::int64_t due_ns = kBeginNs + 30 * kMs;
  sender.send(topic, 0, due_ns, packet("remove all"));
  sender.send(topic, 0, due_ns + kMs / 3, packet(std::string(60'000, ' ')));
  time.advanceTo(due_ns + kMs / 3 - 1);
  EXPECT_EQ(subscriber.receive(), "remove all");
  EXPECT_EQ(subscriber.receive(), "nothing");
  time.advanceTo(due_ns + kMs / 3);
  EXPECT_EQ(subscriber.receive().size(), 60'000U);
}

TEST_F(OneSubscriber, WhatIsDueTogetherArrivesInTheOrderInWhichItWasGiven) {
  const std::int64_t due_ns = kBeginNs + 30 * kMs;
  sender.send(topic, 0, due_ns, numbered(0, 10));
  sender.send(topic, 0, due_ns, numbered(1, 60'000));
  sender.send(topic, 0, due_ns, numbered(2, 10));
  sender.send(topic, 0, due_ns, numbered(3, 900'000));
  time.advanceTo(due_ns);
  EXPECT_EQ(subscriber.receiveNumbers(), counted(4));
}

TEST_F(OneSubscriber, MessagesThatGoTogetherArriveWholeThoughTheSocketTakesOnlyParts) {
  const int bytes = 4096;
  setsockopt(subscriber.peer(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
  std::mt19937 random(1);
  const std::int64_t due_ns = kBeginNs + 5 * kMs;
  std::vector<std::size_t> sizes;
  for (int number = 0; number < 900; ++number) {
    sizes.push_back(number % 50 == 0 ? 40'000 : 10 + random() % 300);
    sender.send(topic, 0, due_ns, numbered(number, sizes.back()));
  }
  time.advanceTo(due_ns);
  for (int number = 0; number < 900; ++number) {
    const std::string message = subscriber.receive();
    ASSERT_EQ(std::atoi(message.c_str()), number);
    ASSERT_EQ(message.size(), sizes[number]);
  }
  EXPECT_TRUE(sender.waitUntilSent(0.0));
  EXPECT_EQ(sender.dropped(), 0U);
}

TEST(TimedSender, KeepsTheOrderOfEachTopicWhateverTheSizes) {
  constexpr int kCount = 300, kTopics = 3;
  SimulatedSender sender;
  Subscriber subscribers[] = {Subscriber(sender), Subscriber(sender), Subscriber(sender)};
  std::vector<int> received[kTopics];
  for (Subscriber& it : subscribers)
    sender.addLink(sender.addTopic(false, {kCount, std::size_t{1} << 32}), it.peer());
  std::mt19937 random;
  const std::int64_t begin_ns = kBeginNs + 100 * kMs;
  for (int number = 0; number < kCount; ++number)
    for (int topic = 0; topic < kTopics; ++topic) {
      const std::size_t size = random() % 4 ? 10 + random() % 100 : 20'000 + random() % 880'000;
      sender.send(topic, 0, begin_ns + number * kMs / 2, numbered(number, size));
    }
  for (int round = 1; round <= kCount; ++round) {  // each subscriber at its own pace
    sender.time.advanceTo(begin_ns + round * kMs / 2);
    for (int topic = 0; topic < kTopics; ++topic) {
      if (round % (topic + 1) != 0) continue;
      const std::vector<int> numbers = subscribers[topic].receiveNumbers();
      received[topic].insert(received[topic].end(), numbers.begin(), numbers.end());
    }
  }
  for (const std::vector<int>& numbers : received) EXPECT_EQ(numbers, counted(kCount));
}

TEST(TimedSender, OfManySmallMessagesThoseOfAMomentGoTogether) {
  constexpr int kCount = 5'000, kTopics = 20;  // a hundred thousand in a second
  SimulatedSender sender;
  std::vector<std::unique_ptr<Subscriber>> subscribers;
  for (int topic = 0; topic < kTopics; ++topic) {
    subscribers.push_back(std::make_unique<Subscriber>(sender));
    sender.addLink(sender.addTopic(false, {kCount, 1 << 30}), subscribers.back()->peer());
  }
  const std::int64_t begin_ns = kBeginNs + 500 * kMs;
  for (int number = 0; number < kCount; ++number)
    for (int topic = 0; topic < kTopics; ++topic)
      sender.send(topic, 0, begin_ns + number * kMs / 5 + topic * kMs / 100, numbered(number, 40));
  sender.time.advanceTo(begin_ns - 1);
  const int waits = sender.time.waitCount();
  sender.time.advanceTo(begin_ns + 999 * kMs);
  EXPECT_LT(sender.time.waitCount() - waits, 10'100 + 100);  // 10,000/s, more for a moment
  sender.time.advanceTo(begin_ns + 1000 * kMs);
  for (const auto& it : subscribers) EXPECT_EQ(it->receiveNumbers(), counted(kCount));
}

TEST_F(OneSubscriber, TakesBackWhatIsNotDue) {
  const std::int64_t later_ns = kBeginNs + kLongNs;
  sender.send(topic, 0, later_ns - 1, packet("kept"));
  sender.send(topic, 0, later_ns, packet("a"));
  sender.send(topic, 0, later_ns + 1, packet("b"));
  EXPECT_EQ(sender.revoke(later_ns - 1), 2U);
  EXPECT_EQ(sender.revoke(0), 1U);
  EXPECT_EQ(sender.revoke(0), 0U);
  sender.send(topic, 0, 0, packet("now"));
  EXPECT_EQ(subscriber.receive(), "now");
  time.advanceTo(later_ns + 1);
  EXPECT_EQ(subscriber.receive(), "nothing");
}

TEST_F(OneSubscriber, CountsWhatIsSentOfEachTopic) {
  const int silent = sender.addTopic(false, kMuch);  // nobody listens
  sender.send(silent, 0, 0, packet("a"));
  for (const char* text : {"b", "c"}) sender.send(topic, 0, 0, packet(text));
  sender.send(topic, 0, kBeginNs + kLongNs, packet("later"));
  time.settle();
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
  EXPECT_TRUE(sender.waitUntilSent(0.0));
}

TEST_F(OneSubscriber, ALargeMessageIsSentAheadAndArrivesWhenItIsDue) {
  const std::int64_t due_ns = kBeginNs + 50 * kMs;
  sender.send(topic, 0, due_ns, packet(std::string(2'000'000, ' ')));
  time.advanceTo(due_ns - 3 * kMs);
  EXPECT_GT(subscriber.byteCount(), 0U);
  EXPECT_EQ(sender.revoke(0), 0U);  // it has been begun
  time.advanceTo(due_ns - 1);
  EXPECT_EQ(subscriber.byteCount(), kLength + 2'000'000 - 1);
  EXPECT_EQ(subscriber.receive(), "nothing");
  time.advanceTo(due_ns);
  EXPECT_EQ(subscriber.receive().size(), 2'000'000U);
}

TEST_F(SmallAndLarge, WhatIsBeforeABegunMessageIsNotTakenBack) {
  const std::int64_t due_ns = kBeginNs + 50 * kMs;
  sender.send(topic, 0, due_ns - 1, packet("before"));
  sender.send(other, 0, due_ns, packet(std::string(2'000'000, ' ')));
  sender.send(topic, 0, due_ns, packet("with it"));
  sender.send(topic, 0, due_ns + kLongNs, packet("after"));
  time.advanceTo(due_ns - 3 * kMs);
  EXPECT_GT(large.byteCount(), 0U);
  EXPECT_EQ(sender.revoke(0), 1U);
  sender.send(topic, 0, 0, packet("instead"));
  EXPECT_EQ(small.receive(), "nothing");
  time.advanceTo(due_ns);
  for (const char* expected : {"before", "with it", "instead", "nothing"})
    EXPECT_EQ(small.receive(), expected);
}

TEST_F(SmallAndLarge, WhatIsSentAtOnceBehindABegunMessageIsNotTakenBack) {
  const std::int64_t due_ns = kBeginNs + 50 * kMs;
  sender.send(other, 0, due_ns, packet(std::string(150'000, ' ')));
  time.advanceTo(due_ns - kMs / 2);
  EXPECT_GT(large.byteCount(), 0U);
  sender.send(topic, 0, 0, packet("at once"));
  sender.send(topic, 0, due_ns + kLongNs, packet("later"));
  EXPECT_EQ(sender.revoke(time.now()), 1U);
  EXPECT_EQ(sender.revoke(time.now()), 0U);
  time.advanceTo(due_ns);
  EXPECT_EQ(small.receive(), "at once");
}

TEST_F(OneSubscriber, WhatIsSentAtOnceKeepsWhatWasGivenBefore) {
  sender.send(topic, 0, kBeginNs + 30 * kMs, packet("before"));
  sender.send(topic, 0, 0, packet("at once"));
  EXPECT_EQ(sender.revoke(0), 0U);
  time.advanceTo(kBeginNs + 30 * kMs);
  EXPECT_EQ(subscriber.receive(), "before");
  EXPECT_EQ(subscriber.receive(), "at once");
}

TEST_F(OneSubscriber, ALargeMessageIsNotBegunBeforeTheOneBeforeItHasGone) {
  const std::int64_t due_ns = kBeginNs + 60 * kMs;
  sender.send(topic, 0, due_ns, packet(std::string(900'000, ' ')));
  sender.send(topic, 0, due_ns + kMs, packet(std::string(900'000, ' ')));
  time.advanceTo(due_ns - 1);
  EXPECT_EQ(subscriber.byteCount(), kLength + 900'000 - 1);
  EXPECT_EQ(sender.revoke(0), 1U);
}

TEST_F(SmallAndLarge, ASmallMessageDoesNotWaitForALargeOneOfAnotherTopic) {
  sender.send(other, 0, 0, packet(std::string(20'000'000, ' ')));
  sender.send(topic, 0, 0, packet("small"));
  EXPECT_EQ(small.receive(), "small");  // while nobody takes the large one
}

TEST(TimedSender, ASlowSubscriberLosesTheOldestAndTheyAreCounted) {
  SimulatedSender sender;
  Subscriber slow(sender), quick(sender);
  const int topic = sender.addTopic(false, {3, 1 << 30});
  sender.addLink(topic, slow.peer());
  sender.send(topic, 0, 0, packet(std::string(20'000'000, ' ')));  // more than the socket takes
  sender.time.settle();
  EXPECT_FALSE(sender.waitUntilSent(0.0));
  sender.addLink(topic, quick.peer());
  for (int number = 0; number < 10; ++number) {
    sender.send(topic, 0, 0, packet(std::to_string(number)));
    EXPECT_EQ(quick.receive(), std::to_string(number));
  }
  EXPECT_EQ(sender.dropped(), 8U);
  EXPECT_EQ(slow.receive().size(), 20'000'000U);
  for (const char* expected : {"8", "9", "nothing"}) EXPECT_EQ(slow.receive(), expected);
}

TEST(TimedSender, TheQueueIsBoundedInBytes) {
  SimulatedSender sender;
  Subscriber slow(sender);
  const int topic = sender.addTopic(false, {1000, 3'000'000});
  const int link = sender.addLink(topic, slow.peer());
  for (int number = 0; number < 10; ++number)
    sender.send(topic, 0, 0, packet(std::string(1'000'000, ' ')));
  sender.time.settle();
  EXPECT_EQ(sender.dropped(), 8U);
  sender.removeLink(link);
  EXPECT_EQ(sender.dropped(), 8U);
}

TEST_F(EarlyAndLate, NewSubscribersGetWhatWasLatchedOfEachSource) {
  sender.send(topic, 1, 0, packet("old"));
  sender.send(topic, 1, 0, packet("one"));
  sender.send(topic, 2, 0, packet("two"));
  sender.send(topic, 2, kBeginNs + kLongNs, packet("not yet"));
  for (const char* expected : {"old", "one", "two"}) EXPECT_EQ(early.receive(), expected);
  sender.addLink(topic, late.peer());
  for (const char* expected : {"one", "two", "nothing"}) EXPECT_EQ(late.receive(), expected);
}

TEST_F(EarlyAndLate, NewSubscribersGetWhatWasLatchedInTheOrderOfSending) {
  sender.send(topic, 1, 0, packet("one"));
  sender.send(topic, 2, 0, packet("two"));
  sender.send(topic, 1, 0, packet("one again"));
  for (const char* expected : {"one", "two", "one again"}) EXPECT_EQ(early.receive(), expected);
  sender.addLink(topic, late.peer());
  for (const char* expected : {"two", "one again", "nothing"}) EXPECT_EQ(late.receive(), expected);
}

TEST_F(EarlyAndLate, WhatIsWithdrawnIsNotLatchedAnyMore) {
  sender.send(topic, 1, 0, packet("one"));
  sender.send(topic, 2, 0, packet("two"));
  sender.send(topic, 1, kBeginNs, std::make_shared<const Packet>());
  sender.send(topic, 2, kBeginNs + kLongNs, std::make_shared<const Packet>());
  EXPECT_EQ(sender.revoke(kBeginNs), 1U);
  for (const char* expected : {"one", "two"}) EXPECT_EQ(early.receive(), expected);
  EXPECT_TRUE(sender.waitUntilSent(0.0));
  sender.addLink(topic, late.peer());
  sender.send(topic, 1, 0, packet("three"));
  for (const char* expected : {"two", "three", "nothing"}) EXPECT_EQ(late.receive(), expected);
  EXPECT_EQ(early.receive(), "three");
  EXPECT_EQ(sender.sent(topic), 3U);
}

TEST_F(EarlyAndLate, ANewSubscriberGetsALatchedMessageNotBeforeItIsDue) {
  const std::int64_t due_ns = kBeginNs + 100 * kMs;
  sender.send(topic, 0, due_ns, packet(std::string(900'000, ' ')));
  time.advanceTo(due_ns - kMs);
  EXPECT_GT(early.byteCount(), 0U);
  sender.addLink(topic, late.peer());
  EXPECT_EQ(late.receive(), "nothing");
  time.advanceTo(due_ns);
  EXPECT_EQ(late.receive().size(), 900'000U);
}

TEST(TimedSender, TellsOfASubscriberThatGoesAway) {
  SimulatedSender sender;
  Subscriber going(sender), staying(sender);
  const int topic = sender.addTopic(false, kMuch);
  const int link = sender.addLink(topic, going.peer());
  sender.addLink(topic, staying.peer());
  going.leave();
  sender.time.settle();
  EXPECT_EQ(sender.waitForBroken(), link);
  sender.send(topic, 0, 0, packet("on"));
  EXPECT_EQ(staying.receive(), "on");
  EXPECT_TRUE(sender.waitUntilSent(0.0));
  sender.removeLink(link);
  sender.send(topic, 0, 0, packet("and on"));
  EXPECT_EQ(staying.receive(), "and on");
}

TEST_F(OneSubscriber, OneThatGoesAwayInTheMiddleOfAMessageHoldsUpNothing) {
  sender.send(topic, 0, 0, packet(std::string(20'000'000, ' ')));
  time.settle();
  EXPECT_FALSE(sender.waitUntilSent(0.0));
  subscriber.leave();
  time.settle();
  EXPECT_EQ(sender.waitForBroken(), link);
  EXPECT_TRUE(sender.waitUntilSent(0.0));
}

TEST_F(OneSubscriber, ClosingEndsTheWaits) {
  sender.send(topic, 0, 0, packet(std::string(20'000'000, ' ')));
  auto broken = std::async(std::launch::async, [&] { return sender.waitForBroken(); });
  auto sent = std::async(std::launch::async, [&] { return sender.waitUntilSent(60.0); });
  sender.close();
  EXPECT_EQ(broken.get(), -1);
  EXPECT_FALSE(sent.get());
}

TEST(TimedSender, RefusesWhatIsNoSocket) {
  SimulatedSender sender;
  EXPECT_THROW(sender.addLink(sender.addTopic(false, kMuch), -1), std::system_error);
}

}  // namespace

}  // namespace process_visualizer::sender

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
