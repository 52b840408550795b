// SPDX-License-Identifier: BSD-3-Clause
// What is done with messages, by sequences of them and of commands.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/recorder/intake.hpp"
#include "process_visualizer/recorder/turns.hpp"
#include "recorder_folder.hpp"
#include "recorder_messages.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();
constexpr double kMemoryS = 10;
constexpr std::size_t kBytes = 100;
constexpr char kMarks[] = "/process_visualizer/marks";
constexpr char kFrames[] = "/process_visualizer/calibration";
constexpr char kAccount[] = "/process_visualizer/recording";

ConnectionPtr connectionOf(const std::string& topic, const std::string& node = "/n") {
  return std::make_shared<Connection>(Connection{topic,
                                                 {{"topic", topic},
                                                  {"type", "a/A"},
                                                  {"md5sum", "0"},
                                                  {"message_definition", "float32 x"},
                                                  {"callerid", node}}});
}

TopicChoice chosen() { return TopicChoice({"/a", "/b"}, {}, {}); }

class Intakes : public Folder {
 protected:
  RecordingOptions options() {
    RecordingOptions options;
    options.path = path(std::to_string(count_++) + ".bag");
    options.minimum_free_bytes = 0;
    return options;
  }
  static RecentMessages memory(double duration_s = kMemoryS) { return {duration_s, 1 << 30}; }
  static std::map<std::string, std::uint64_t> end(Intake& intake) {
    intake.close();
    EXPECT_EQ(intake.finish(ros::Time::now()), "");
    return intake.status().messages;
  }

 private:
  int count_ = 0;
};

/// What the recorder should do, in the simplest words: a list of what is in memory, and counts of
/// what has to be in the bag.
class Sequence : public Intakes {
 protected:
  Sequence() { intake_.choose(chosen()); }

  void doOne(std::mt19937& random) {
    const std::vector<std::function<void()>> all = {
        [this] { receive(a_, {"/a"}); },
        [this] { receive(b_, {"/b"}); },
        [this] { receive(other_, {}); },
        [this] { receive(frames_, {kFrames}); },
        [this] { receive(other_frames_, {}); },
        [this] { mark(); },
        [&] { beginOrSave(random); },
        [this] { finish(); },
        [&] { copy(random); },
    };
    all[random() % all.size()]();
  }

  void check() const {
    const RecorderState state = intake_.state();
    EXPECT_EQ(intake_.isOpen(), is_open_);
    EXPECT_EQ(state.dropped, 0u);
    EXPECT_EQ(state.files.empty(), !has_recorded_);
    ASSERT_EQ(state.topics.size(), 2u);
    for (const TopicRecord& topic : state.topics)
      EXPECT_EQ(topic.bytes, kBytes * in_bag_.at(topic.name)) << topic.name;
    EXPECT_EQ(state.recent, memory_.empty() ? 0 : memory_.back().second - memory_.front().second);
    if (!is_open_) {
      EXPECT_EQ(state.duration, duration_);
    }
  }

  void finish() {
    if (!is_open_) return;
    const auto written = end(intake_);
    duration_ = intake_.state().duration;
    is_open_ = false;
    for (const auto& [topic, count] : in_bag_) {
      const auto found = written.find(topic);
      EXPECT_EQ(found == written.end() ? 0 : found->second, count) << topic;
    }
    EXPECT_EQ(written.at(kAccount), 1u);
  }

 private:
  void receive(const ConnectionPtr& connection, const std::vector<std::string>& taken_as) {
    now_ += 0.25;
    intake_.receive(messageAt(now_, connection, kBytes));
    for (const std::string& topic : taken_as) expect(topic);
  }

  void mark() {
    now_ += 0.25;
    EXPECT_TRUE(intake_.mark(ros::Time(now_), "here"));
    expect(kMarks);
  }

  /// Whatever a recording has; and nothing else may notice.
  void copy(std::mt19937& random) {
    const double recent_s = std::vector<double>{2, 5, kAll}[random() % 3];
    std::map<std::string, unsigned> expected;
    for (const auto& [topic, time] : kept_)
      if (now_ - time <= recent_s) ++expected[topic];
    const Beginning beginning{chosen(), ros::Time(now_), recent_s, ""};
    if (expected.empty()) {
      EXPECT_THROW(intake_.copy(beginning), RecordingError);
      return;
    }
    expected[kAccount] = 1;
    std::map<std::string, unsigned> found;
    for (const Message& message : intake_.copy(beginning)) ++found[message.topic()];
    EXPECT_EQ(found, expected);
  }

  void expect(const std::string& topic) {
    kept_.push_back({topic, now_});
    while (now_ - kept_.front().second > kMemoryS) kept_.pop_front();
    if (is_open_ || !has_recorded_) ++in_bag_[topic];  // before the first one all that comes counts
    if (is_open_) return;
    memory_.push_back({topic, now_});
    while (now_ - memory_.front().second > kMemoryS) memory_.pop_front();
  }

  void beginOrSave(std::mt19937& random) {
    if (is_open_) return;
    const double recent_s = std::vector<double>{0, 2, 5, kAll}[random() % 4];
    std::map<std::string, unsigned> past{{"/a", 0}, {"/b", 0}};
    unsigned count = 0;
    for (const auto& [topic, time] : memory_)
      if (recent_s > 0 && now_ - time <= recent_s) ++past[topic], ++count;
    const Beginning beginning{chosen(), ros::Time(now_), recent_s, ""};
    if (random() % 2 == 0) {
      intake_.begin(options(), beginning);
    } else if (count > 0) {
      intake_.save(options(), beginning);
    } else {
      EXPECT_THROW(intake_.save(options(), beginning), RecordingError);
      return;
    }
    is_open_ = has_recorded_ = true;
    in_bag_ = past;
    memory_.clear();
  }

  Intake intake_{"/recorder", memory(), [] { FAIL() << "it has ended by itself"; }};
  const ConnectionPtr a_ = connectionOf("/a"), b_ = connectionOf("/b"), other_ = connectionOf("/c"),
                      frames_ = connectionOf("/tf_static", "/cell_frames"),
                      other_frames_ = connectionOf("/tf_static", "/other");
  bool is_open_ = false, has_recorded_ = false;
  double now_ = 1000, duration_ = 0;
  std::deque<std::pair<std::string, double>> kept_, memory_;  // all, and what no recording has
  std::map<std::string, unsigned> in_bag_{{"/a", 0}, {"/b", 0}};
};

class SequenceOf : public Sequence, public testing::WithParamInterface<int> {};

TEST_P(SequenceOf, MessagesAndCommandsEndsInTheRightBag) {
  std::mt19937 random(GetParam());
  for (int i = 0; i < 150; ++i) {
    doOne(random);
    check();
  }
  finish();
  check();
}

INSTANTIATE_TEST_SUITE_P(Random, SequenceOf, testing::Range(0, 30));

TEST_F(Intakes, LoseNothingBetweenMemoryAndRecordings) {
  constexpr unsigned kMessages = 20000;
  Intake intake("/recorder", memory(kAll), [] {});
  intake.choose(chosen());
  const ConnectionPtr a = connectionOf("/a");
  std::thread sender([&] {
    for (unsigned i = 0; i < kMessages; ++i) intake.receive(messageAt(1 + i, a, kBytes));
  });
  std::uint64_t count = 0;
  const auto record = [&] {
    intake.begin(options(), {chosen(), ros::Time(kMessages), kAll, ""});
    count += end(intake)["/a"];
  };
  for (int i = 0; i < 5; ++i) record();
  sender.join();
  record();
  EXPECT_EQ(count, kMessages);
}

TEST_F(Intakes, AreCopiedWhileMessagesArriveAndAreRecorded) {
  constexpr unsigned kMessages = 20000;
  Intake intake("/recorder", memory(kAll), [] {});
  intake.choose(chosen());
  const ConnectionPtr a = connectionOf("/a");
  const auto receive = [&](unsigned i) { intake.receive(messageAt(1 + i, a, kBytes)); };
  const Beginning all{chosen(), ros::Time(1 + kMessages), kAll, ""};
  receive(0);
  std::atomic<bool> has_ended = false;
  std::thread sender([&] {
    for (unsigned i = 1; i < kMessages; ++i) receive(i);
  });
  std::thread copier([&] {
    for (std::size_t count = 0; !has_ended || count < kMessages;) {
      const std::deque<Message> copy = intake.copy(all);
      ASSERT_GE(copy.size() - 1, count);  // without the account
      count = copy.size() - 1;
      for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(copy[i].time, ros::Time(1 + i));
    }
  });
  std::uint64_t count = 0;
  const auto record = [&] {
    intake.begin(options(), all);
    count += end(intake)["/a"];
  };
  for (int i = 0; i < 5; ++i) record();
  sender.join();
  record();
  EXPECT_EQ(count, kMessages);
  has_ended = true;
  copier.join();
}

TEST_F(Intakes, AreCopiedLikeARecording) {
  Intake intake("/recorder", memory(), [] {});
  intake.choose(TopicChoice({"/a", "/b", "/c"}, {}, {}));
  Beginning all{TopicChoice({}, {"/.*"}, {"/c"}), ros::Time(40), kAll, "<cell/>"};
  EXPECT_THROW(intake.copy(all), RecordingError);  // a configuration alone is nothing
  const auto topics = [&] {
    std::vector<std::string> names;
    for (const Message& message : intake.copy(all)) names.push_back(message.topic());
    return names;
  };
  using Topics = std::vector<std::string>;
  intake.receive(messageAt(1, latchedBy("/n", "/b"), kBytes));
  intake.receive(messageAt(1, latchedBy("/n", "/c"), kBytes));
  intake.receive(messageAt(20, connectionOf("/c"), kBytes));
  EXPECT_EQ(topics(), (Topics{"/b", "/process_visualizer/configuration", kAccount}));
  intake.begin(options(), {chosen(), ros::Time(20), 0, ""});
  intake.receive(messageAt(21, connectionOf("/a"), kBytes));
  EXPECT_TRUE(intake.mark(ros::Time(22), "here"));
  const Topics expected = {"/b", "/process_visualizer/configuration", "/a", kMarks, kAccount};
  EXPECT_EQ(topics(), expected);
  EXPECT_EQ(intake.state().state, RecorderState::IDLE);
  EXPECT_EQ(end(intake)["/a"], 1u);
  EXPECT_EQ(topics(), expected);
  const std::deque<Message> copy = intake.copy(all);
  for (std::size_t i = 1; i < copy.size(); ++i) EXPECT_LT(copy[i - 1].time, copy[i].time);
  EXPECT_EQ(copy.back().time, all.now);
  const auto& text = copy.back().content->bytes;
  EXPECT_NE(std::string(text.begin(), text.end()).find(R"("/a": {"received": 1, "dropped": 0})"),
            std::string::npos);
}

TEST_F(Intakes, WithoutMemoryTakeNoMarksBetweenRecordings) {
  Intake intake("/recorder", memory(0), [] {});
  EXPECT_FALSE(intake.mark(ros::Time(1), "lost"));
  intake.begin(options(), {chosen(), ros::Time(2), 0, ""});
  EXPECT_TRUE(intake.mark(ros::Time(3), "here"));
  EXPECT_EQ(end(intake)[kMarks], 1u);
  EXPECT_FALSE(intake.mark(ros::Time(4), "lost"));
}

TEST_F(Intakes, ThatCannotBeginStayAsTheyWere) {
  Intake intake("/recorder", memory(), [] {});
  intake.choose(chosen());
  intake.receive(messageAt(1, connectionOf("/a"), kBytes));
  RecordingOptions impossible = options();
  impossible.minimum_free_bytes = std::numeric_limits<std::uint64_t>::max();
  EXPECT_THROW(intake.begin(impossible, {chosen(), ros::Time(2), kAll, ""}), RecordingError);
  EXPECT_FALSE(intake.isOpen());
  EXPECT_FALSE(intake.isWriting());
  intake.begin(options(), {chosen(), ros::Time(2), kAll, ""});
  EXPECT_EQ(end(intake)["/a"], 1u);
}

TEST_F(Intakes, CountNothingMoreWhenARecordingHasEndedByItself) {
  std::promise<void> ended;
  Intake intake("/recorder", memory(), [&ended] { ended.set_value(); });
  intake.choose(chosen());
  intake.addProblem("of the recording before");
  intake.begin(options(), {chosen(), ros::Time(1), 0, "<cell/>"});
  EXPECT_TRUE(intake.state().problems.empty());
  const ConnectionPtr a = connectionOf("/a");
  intake.receive(messageAt(2, a, kBytes));
  ASSERT_TRUE(std::filesystem::remove(intake.status().files.front() + ".active"));
  ASSERT_EQ(ended.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  EXPECT_FALSE(intake.isWriting());
  EXPECT_TRUE(intake.isOpen());
  intake.receive(messageAt(3, a, kBytes));
  EXPECT_FALSE(intake.mark(ros::Time(4), "too late"));
  intake.close();
  EXPECT_NE(intake.finish(ros::Time(5)), "");
  const RecorderState state = intake.state();
  EXPECT_EQ(state.topics.front().bytes, kBytes);
  EXPECT_EQ(state.topics.front().messages, 1u);
  EXPECT_EQ(state.dropped, 0u);
  EXPECT_EQ(state.messages, 3u);  // with the configuration and the account
}

TEST_F(Intakes, FollowPatternsButNotTheRecordersOwnTopics) {
  Intake intake("/recorder", memory(), [] {});
  EXPECT_TRUE(intake.sources().empty());
  intake.choose(TopicChoice({}, {"/.*"}, {}));
  const Publishers publishers{{"/a", {"/n"}}, {"/recorder/state", {"/recorder"}}};
  EXPECT_TRUE(intake.follow(publishers, {"/recorder/"}));
  EXPECT_FALSE(intake.follow(publishers, {"/recorder/"}));
  EXPECT_EQ(intake.sources(), (std::set<std::string>{"/a", "/tf_static"}));
}

TEST(Frames, OfTheCellHaveOneConnectionForEachOfTheSource) {
  Calibration calibration;
  const Message message = messageAt(1, connectionOf("/tf_static", "/cell_frames"));
  const auto first = calibration.copyOf(message), second = calibration.copyOf(message);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->connection, second->connection);
  EXPECT_EQ(first->topic(), kFrames);
  EXPECT_EQ(first->connection->field("topic"), kFrames);
  EXPECT_EQ(first->content, message.content);
  EXPECT_FALSE(calibration.copyOf(messageAt(1, connectionOf("/tf_static", "/other"))));
  EXPECT_FALSE(calibration.copyOf(messageAt(1, connectionOf("/tf", "/cell_frames"))));
}

TEST(ProblemList, KeepsTheNewestAndCountsAll) {
  Problems problems;
  for (unsigned i = 0; i < Problems::kMost + 2; ++i) problems.add(std::to_string(i));
  EXPECT_EQ(problems.texts().size(), Problems::kMost);
  EXPECT_EQ(problems.texts().front(), "2");
  problems.clear();
  EXPECT_TRUE(problems.texts().empty());
  EXPECT_EQ(problems.count(), Problems::kMost + 2);
}

TEST(Turn, GoesOnUntilTheEnd) {
  Turns turns;
  EXPECT_TRUE(turns.waitFor(std::chrono::milliseconds(1)));
  auto waiting =
      std::async(std::launch::async, [&turns] { return turns.waitFor(std::chrono::hours(1)); });
  turns.end();
  EXPECT_FALSE(waiting.get());
  EXPECT_FALSE(turns.waitFor(std::chrono::hours(1)));
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
