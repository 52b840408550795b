// SPDX-License-Identifier: BSD-3-Clause
// Handling of messages by the intake, in sequences of messages and commands.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/recorder/intake.hpp"
#include "process_visualizer/recorder/turns.hpp"
#include "recorder_bags.hpp"
#include "recorder_folder.hpp"
#include "recorder_machine.hpp"
#include "recorder_messages.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();
constexpr double kMemoryS = 10;
constexpr std::size_t kBytes = 100;
constexpr char kMarks[] = "/process_visualizer/marks";
constexpr char kFrames[] = "/process_visualizer/calibration";
constexpr char kOtherFrames[] = "/process_visualizer/static_frames";
constexpr char kAccount[] = "/process_visualizer/recording";
constexpr char kConfiguration[] = "/process_visualizer/configuration";

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
    EXPECT_EQ(intake.finish(), "");
    return intake.status().messages;
  }

 private:
  int count_ = 0;
};

/// An intake of /a and /b whose time is advanced by the tests.
class SimulatedIntake : public Intakes {
 protected:
  SimulatedIntake() { intake_.choose(chosen()); }

  double now() const { return machine_.now().toSec(); }
  void receive(const ConnectionPtr& connection, std::uint32_t number = 0,
               std::size_t size = kBytes) {
    intake_.receive(messageAt(now(), connection, size, number));
  }
  /// Receives numbered messages, with a tenth of a second after each.
  void receiveMany(const ConnectionPtr& connection, std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t number = first; number < end; ++number) {
      receive(connection, number);
      machine_.goOn(0.1);
    }
  }
  void begin(double recent_s = 0, const TopicChoice& choice = chosen()) {
    intake_.begin(options(), {choice, recent_s, ""});
  }
  std::string save(double recent_s, const TopicChoice& choice = chosen()) {
    intake_.save(options(), {choice, recent_s, ""});
    EXPECT_EQ(intake_.finish(), "");
    return bag();
  }
  std::string bag() const { return intake_.status().files.back(); }
  TopicRecord figures(const std::string& topic) const {
    for (const TopicRecord& record : intake_.state().topics)
      if (record.name == topic) return record;
    throw std::runtime_error("there is no " + topic);
  }

  SimulatedMachine machine_;
  std::promise<void> ended_;
  Intake intake_{"/recorder", memory(), [this] { ended_.set_value(); }, machine_.machine()};
  const ConnectionPtr a_ = connectionOf("/a"), b_ = connectionOf("/b");
};

using Numbers = std::vector<std::uint32_t>;

Numbers numbersFrom(std::uint32_t first, std::uint32_t end) {
  Numbers numbers(end - first);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

/// A simple model of the recorder: a list of the messages in memory, and counts of those that must
/// be in the bag.
class Sequence : public SimulatedIntake {
 protected:
  void doOne(std::mt19937& random) {
    const std::vector<std::function<void()>> all = {
        [this] { receive(a_, {"/a"}); },
        [this] { receive(b_, {"/b"}); },
        [this] { receive(other_, {}); },
        [this] { receive(frames_, {kFrames}); },
        [this] { receive(other_frames_, {kOtherFrames}); },
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
    EXPECT_EQ(state.recent, memory_.empty() ? 0 : now() - memory_.front().second);
    EXPECT_EQ(state.duration, (is_open_ ? now() : end_) - begin_);
  }

  void finish() {
    if (!is_open_) return;
    intake_.close();
    end_ = now();
    waitUntilWritten();
  }

 private:
  void waitUntilWritten() {
    EXPECT_EQ(intake_.finish(), "");
    is_open_ = false;
    const auto written = intake_.status().messages;
    for (const auto& [topic, count] : in_bag_) {
      const auto found = written.find(topic);
      EXPECT_EQ(found == written.end() ? 0 : found->second, count) << topic;
    }
    EXPECT_EQ(written.at(kAccount), 1u);
  }

  void receive(const ConnectionPtr& connection, const std::vector<std::string>& taken_as) {
    machine_.goOn(0.25);
    SimulatedIntake::receive(connection);
    for (const std::string& topic : taken_as) expect(topic);
  }

  void mark() {
    machine_.goOn(0.25);
    EXPECT_TRUE(intake_.mark(machine_.now(), "here"));
    expect(kMarks);
  }

  /// Copies what a recording would contain; this must have no other effect.
  void copy(std::mt19937& random) {
    const double recent_s = std::vector<double>{2, 5, kAll}[random() % 3];
    std::map<std::string, unsigned> expected;
    for (const auto& [topic, time] : kept_)
      if (now() - time <= recent_s) ++expected[topic];
    const Preamble preamble{chosen(), recent_s, ""};
    if (expected.empty()) {
      EXPECT_THROW(intake_.copy(preamble), RecordingError);
      return;
    }
    expected[kAccount] = 1;
    std::map<std::string, unsigned> found;
    for (const Message& message : intake_.copy(preamble)) ++found[message.topic()];
    EXPECT_EQ(found, expected);
  }

  void expect(const std::string& topic) {
    kept_.push_back({topic, now()});
    while (now() - kept_.front().second > kMemoryS) kept_.pop_front();
    if (is_open_ || !has_recorded_) ++in_bag_[topic];  // before the first one all that comes counts
    if (is_open_) return;
    memory_.push_back({topic, now()});
    while (now() - memory_.front().second > kMemoryS) memory_.pop_front();
  }

  void beginOrSave(std::mt19937& random) {
    if (is_open_) return;
    const double recent_s = std::vector<double>{0, 2, 5, kAll}[random() % 4];
    std::map<std::string, unsigned> past{{"/a", 0}, {"/b", 0}};
    unsigned count = 0;
    double oldest = now();
    for (const auto& [topic, time] : memory_)
      if (recent_s > 0 && now() - time <= recent_s)
        ++past[topic], ++count, oldest = std::min(oldest, time);
    const Preamble preamble{chosen(), recent_s, ""};
    const bool is_begun = random() % 2 == 0;
    if (!is_begun && count == 0) {
      EXPECT_THROW(save(recent_s), RecordingError);
      return;
    }
    has_recorded_ = true;
    in_bag_ = past;
    memory_.clear();
    begin_ = end_ = now();
    if (is_begun) {
      intake_.begin(options(), preamble);
      is_open_ = true;
    } else {
      intake_.save(options(), preamble);
      begin_ = oldest;
      waitUntilWritten();
    }
  }

  const ConnectionPtr other_ = connectionOf("/c"),
                      frames_ = connectionOf("/tf_static", "/cell_frames"),
                      other_frames_ = connectionOf("/tf_static", "/other");
  bool is_open_ = false, has_recorded_ = false;
  double begin_ = 0, end_ = 0;
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

TEST_F(SimulatedIntake, SavesWhatHasComeUntilThisMoment) {
  receiveMany(a_, 0, 30);
  const ros::Time moment = machine_.now();
  intake_.save(options(), {chosen(), 1.5, ""});
  receiveMany(a_, 30, 33);  // while it is written
  EXPECT_EQ(intake_.finish(), "");
  EXPECT_EQ(sequencesIn(bag(), "/a"), numbersFrom(15, 30));
  const std::vector<Recorded> saved = messagesIn(bag());
  EXPECT_EQ(saved.front().time, moment - ros::Duration(1.5));
  EXPECT_NEAR(intake_.state().duration, 1.5, 1e-9);
  EXPECT_EQ(saved.back().time, moment);
  EXPECT_NEAR(intake_.state().recent, 0.3, 1e-9);
  EXPECT_EQ(sequencesIn(save(kAll), "/a"), numbersFrom(30, 33));
}

TEST_F(SimulatedIntake, GivesNoMoreThanIsAskedForWhileMessagesCome) {
  std::atomic<bool> has_ended = false;
  receive(a_);
  std::thread sender([&] {
    while (!has_ended) {
      machine_.goOn(0.001);
      receive(a_);
    }
  });
  double longest_s = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::deque<Message> copy = intake_.copy({chosen(), 0.1, ""});
    longest_s = std::max(longest_s, (copy.back().time - copy.front().time).toSec());
  }
  has_ended = true;
  sender.join();
  EXPECT_LE(longest_s, 0.1);
}

TEST_F(SimulatedIntake, GoesOnFromThePastIntoARecording) {
  receive(latchedBy("/n", "/b"), 7);
  receiveMany(a_, 0, 150);  // more than the memory has
  EXPECT_TRUE(intake_.mark(machine_.now(), "before"));
  begin(2);
  receiveMany(a_, 150, 160);
  end(intake_);
  EXPECT_EQ(sequencesIn(bag(), "/a"), numbersFrom(130, 160));
  EXPECT_EQ(sequencesIn(bag(), "/b"), Numbers{7});
  EXPECT_EQ(topicsIn(bag()).front(), "/b");
  const std::vector<std::string> topics = topicsIn(bag());
  EXPECT_EQ(std::count(topics.begin(), topics.end(), kMarks), 1);
}

TEST_F(SimulatedIntake, BeginsThePastWithWhatWasLatchedThen) {
  receive(latchedBy("/n", "/b"), 1);
  receiveMany(a_, 0, 150);
  receive(latchedBy("/n", "/b"), 2);
  EXPECT_EQ(sequencesIn(save(kAll), "/b"), (Numbers{1, 2}));
}

TEST_F(SimulatedIntake, TakesOfThePastOnlyWhatIsChosen) {
  const TopicChoice only_b({"/b"}, {}, {});
  receiveMany(a_, 0, 5);
  EXPECT_THROW(save(kAll, only_b), RecordingError);
  receive(b_);
  const auto topics = [this] {
    const std::vector<std::string> all = topicsIn(bag());
    return std::set<std::string>(all.begin(), all.end());
  };
  save(kAll, only_b);
  EXPECT_EQ(topics(), (std::set<std::string>{"/b", kAccount}));
  receive(a_);
  EXPECT_TRUE(intake_.mark(machine_.now(), "before"));
  intake_.choose(only_b);
  begin(kAll, only_b);
  receive(a_);
  receive(b_);
  end(intake_);
  EXPECT_EQ(topics(), (std::set<std::string>{"/b", kMarks, kAccount}));
}

TEST_F(SimulatedIntake, HasNothingOfBeforeASimulatedTimeBegan) {
  for (const ConnectionPtr& connection : {a_, latchedBy("/n", "/b")})
    intake_.receive(messageAt(0, connection, kBytes, 5));
  EXPECT_THROW(save(kAll), RecordingError);
  begin(kAll);
  receive(a_, 6);
  end(intake_);
  EXPECT_EQ(sequencesIn(bag(), "/a"), Numbers{6});
  EXPECT_EQ(sequencesIn(bag(), "/b"), Numbers{5});
}

TEST_F(SimulatedIntake, TellsWhatArrives) {
  machine_.setFreeBytes(1'000'000);
  begin();
  receive(latchedBy("/m", "/b"));
  receiveMany(a_, 0, 19);
  intake_.measureRates();
  receive(a_, 19);
  waitUntil([this] { return intake_.state().messages == 21; });
  const RecorderState state = intake_.state();
  EXPECT_DOUBLE_EQ(figures("/a").rate, 10);
  EXPECT_EQ(figures("/a").type, "a/A");
  EXPECT_EQ(figures("/a").silence, 0);
  EXPECT_FALSE(figures("/a").latching);
  EXPECT_TRUE(figures("/b").latching);
  EXPECT_NEAR(figures("/b").silence, 1.9, 1e-9);
  EXPECT_EQ(state.stamp, machine_.now());
  EXPECT_NEAR(state.duration, 1.9, 1e-9);
  EXPECT_DOUBLE_EQ(state.rate, 20 * kBytes / 1.9);
  EXPECT_EQ(state.free_bytes, 1'000'000u);
  EXPECT_DOUBLE_EQ(state.time_left, 1'000'000 / state.rate);
  EXPECT_EQ(state.dropped + state.lost + state.gaps, 0u);
  machine_.goOn(2);
  EXPECT_NEAR(figures("/a").silence, 2, 1e-9);
  EXPECT_NEAR(intake_.state().duration, 3.9, 1e-9);
  end(intake_);
  EXPECT_EQ(intake_.state().time_left, -1);
}

TEST_F(SimulatedIntake, TellsNoHigherRateWhenWhatCameWhileItWasHeldUpIsTakenAtOnce) {
  begin();
  receiveMany(a_, 0, 10);
  intake_.measureRates();
  machine_.goOn(29);
  intake_.measureRates();
  EXPECT_DOUBLE_EQ(figures("/a").rate, 10);
  for (std::uint32_t number = 10; number < 300; ++number) receive(a_, number);
  receiveMany(a_, 300, 310);
  intake_.measureRates();
  EXPECT_DOUBLE_EQ(figures("/a").rate, 10);
  EXPECT_DOUBLE_EQ(intake_.state().rate, 10 * kBytes);
  for (int second = 0; second < 2; ++second) {
    machine_.goOn(4);
    intake_.measureRates();
  }
  EXPECT_EQ(figures("/a").rate, 0);
  end(intake_);
}

TEST_F(SimulatedIntake, TellsThatATopicIsSilentAndTakesWhatComesAgain) {
  const std::vector<std::string> none, only_a = {"/a"};
  begin();
  receiveMany(a_, 0, 10);
  EXPECT_EQ(intake_.fallenSilent(), none);
  machine_.goOn(0.8);
  EXPECT_EQ(intake_.fallenSilent(), none);
  machine_.goOn(0.2);
  EXPECT_EQ(intake_.fallenSilent(), only_a);
  EXPECT_EQ(intake_.fallenSilent(), none);
  receiveMany(a_, 10, 12);
  EXPECT_EQ(intake_.fallenSilent(), none);
  end(intake_);
  machine_.goOn(10);
  EXPECT_EQ(intake_.fallenSilent(), none);
  EXPECT_EQ(sequencesIn(bag(), "/a"), numbersFrom(0, 12));
}

TEST_F(SimulatedIntake, SaysNothingOfThePresentWhenASilenceIsOver) {
  using Texts = std::vector<std::string>;
  const Texts during = {"/a fell silent; look"}, after = {"/a fell silent"};
  begin();
  receiveMany(a_, 0, 10);
  machine_.goOn(1);
  ASSERT_EQ(intake_.fallenSilent().size(), 1u);
  intake_.addProblem("/a fell silent", "; look");
  EXPECT_EQ(intake_.fallenSilent(), Texts());
  EXPECT_EQ(intake_.state().problems, during);
  receiveMany(a_, 10, 12);
  EXPECT_EQ(intake_.fallenSilent(), Texts());
  EXPECT_EQ(intake_.state().problems, after);
}

TEST_F(SimulatedIntake, SaysNothingOfThePresentWhenTheRecordingIsOver) {
  using Texts = std::vector<std::string>;
  begin();
  receiveMany(a_, 0, 10);
  machine_.goOn(1);
  ASSERT_EQ(intake_.fallenSilent().size(), 1u);
  intake_.addProblem("/a fell silent", "; look");
  end(intake_);
  EXPECT_EQ(intake_.state().problems, Texts{"/a fell silent"});
  intake_.addProblem("too late", "; look");
  EXPECT_EQ(intake_.state().problems.back(), "too late");
}

std::string accountIn(const std::string& path) {
  for (const Recorded& message : messagesIn(path))
    if (message.topic == kAccount) return message.bytes;
  throw std::runtime_error("there is no account");
}

TEST_F(SimulatedIntake, CountsWhatItsQueueHasNoRoomFor) {
  RecordingOptions small = options();
  small.queue_bytes = 1'000'000;
  intake_.begin(small, {chosen(), 0, ""});
  receive(a_);
  for (unsigned i = 0; i < 3; ++i) receive(a_, i, 2'000'000);
  EXPECT_EQ(figures("/a").dropped, 3u);
  end(intake_);
  EXPECT_EQ(figures("/a").dropped, 3u);
  EXPECT_EQ(figures("/a").messages, 1u);
  EXPECT_NE(accountIn(bag()).find(R"("/a": {"received": 4, "dropped": 3})"), std::string::npos);
}

TEST_F(SimulatedIntake, CountsWhatNeverArrived) {
  Connection numbered = *a_;
  numbered.header["message_definition"] = "Header header";
  const auto connection = std::make_shared<Connection>(numbered);
  begin();
  for (const std::uint32_t number : {7u, 8u, 12u}) receive(connection, number);
  EXPECT_EQ(intake_.state().lost, 3u);
  EXPECT_EQ(intake_.state().gaps, 1u);
  end(intake_);
}

TEST_F(SimulatedIntake, CountsNothingBelowZeroWhereNothingCanBeWritten) {
  receive(latchedBy("/n"), 0, 100'000);
  limitFileSize(20'000);
  begin();
  waitFor(ended_.get_future());
  limitFileSize(RLIM_INFINITY);
  intake_.close();
  EXPECT_NE(intake_.finish().find("make room"), std::string::npos);
  EXPECT_EQ(figures("/a").messages, 0u);
  EXPECT_EQ(figures("/a").dropped, 1u);
  EXPECT_EQ(topicsIn(bag()), std::vector<std::string>{kAccount});
  EXPECT_EQ(intake_.state().messages, 1u);
}

TEST_F(SimulatedIntake, CountsWhatTheBagsHold) {
  receive(latchedBy("/n", "/b"));
  RecordingOptions parts = options();
  parts.split_duration = 5;
  intake_.begin(parts, {chosen(), 0, "<cell/>"});
  receiveMany(a_, 0, 120);
  const ros::Time moment = machine_.now();
  EXPECT_TRUE(intake_.mark(moment, "here"));
  end(intake_);
  const RecorderState state = intake_.state();
  ASSERT_EQ(state.files.size(), 3u);
  std::map<std::string, std::uint64_t> counts;
  std::uint64_t all = 0, bytes = 0;
  Numbers numbers;
  for (const std::string& file : state.files) {
    for (const Recorded& message : messagesIn(file)) {
      ++counts[message.topic], ++all;
      if (message.topic == kMarks) {
        EXPECT_EQ(message.time, moment);
      }
    }
    for (const std::uint32_t number : sequencesIn(file, "/a")) numbers.push_back(number);
    const std::vector<std::string> topics = topicsIn(file);
    EXPECT_EQ((std::vector<std::string>{topics[0], topics[1]}),
              (std::vector<std::string>{"/b", kConfiguration}));
    bytes += std::filesystem::file_size(file);
  }
  EXPECT_EQ(state.messages, all);
  EXPECT_EQ(counts[kMarks], 1u);
  EXPECT_EQ(numbers, numbersFrom(0, 120));
  for (const TopicRecord& topic : state.topics) EXPECT_EQ(topic.messages, counts[topic.name]);
  EXPECT_LE(state.bytes, bytes);
}

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
    intake.begin(options(), {chosen(), kAll, ""});
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
  const Preamble all{chosen(), kAll, ""};
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
  SimulatedMachine machine;  // the time is 1000 s
  Intake intake(
      "/recorder", memory(), [] {}, machine.machine());
  intake.choose(TopicChoice({"/a", "/b", "/c"}, {}, {}));
  const Preamble all{TopicChoice({}, {"/.*"}, {"/c"}), kAll, "<cell/>"};
  try {
    intake.copy(all);
    FAIL() << "a configuration alone is something";
  } catch (const RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("nothing is latched"), std::string::npos);
  }
  const auto topics = [&] {
    std::vector<std::string> names;
    for (const Message& message : intake.copy(all)) names.push_back(message.topic());
    return names;
  };
  using Topics = std::vector<std::string>;
  intake.receive(messageAt(961, latchedBy("/n", "/b"), kBytes));
  intake.receive(messageAt(961, latchedBy("/n", "/c"), kBytes));
  intake.receive(messageAt(980, connectionOf("/c"), kBytes));
  EXPECT_EQ(topics(), (Topics{"/b", kConfiguration, kAccount}));
  intake.begin(options(), {chosen(), 0, ""});
  intake.receive(messageAt(981, connectionOf("/a"), kBytes));
  EXPECT_TRUE(intake.mark(ros::Time(982), "here"));
  const Topics expected = {"/b", kConfiguration, "/a", kMarks, kAccount};
  EXPECT_EQ(topics(), expected);
  EXPECT_EQ(intake.state().state, RecorderState::IDLE);
  EXPECT_EQ(end(intake)["/a"], 1u);
  EXPECT_EQ(topics(), expected);
  const std::deque<Message> copy = intake.copy(all);
  for (std::size_t i = 1; i < copy.size(); ++i) EXPECT_LT(copy[i - 1].time, copy[i].time);
  EXPECT_EQ(copy.back().time, machine.now());
  const auto& text = copy.back().content->bytes;
  EXPECT_NE(std::string(text.begin(), text.end()).find(R"("/a": {"received": 1, "dropped": 0})"),
            std::string::npos);
}

TEST_F(SimulatedIntake, WritesAMarkOnceAtItsTime) {
  begin();
  receiveMany(a_, 0, 5);
  const ros::Time moment = machine_.now();
  receiveMany(a_, 5, 10);  // nobody answered meanwhile, so it is sent twice
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(intake_.mark(moment, "here"));
  EXPECT_EQ(end(intake_)[kMarks], 1u);
  std::vector<ros::Time> times;
  for (const Recorded& message : messagesIn(bag()))
    if (message.topic == kMarks) times.push_back(message.time);
  EXPECT_EQ(times, std::vector<ros::Time>{moment});
  begin();
  EXPECT_TRUE(intake_.mark(moment, "here"));
  EXPECT_EQ(end(intake_)[kMarks], 1u);
}

TEST_F(Intakes, WithoutMemoryTakeNoMarksBetweenRecordings) {
  Intake intake("/recorder", memory(0), [] {});
  EXPECT_FALSE(intake.mark(ros::Time(1), "lost"));
  intake.begin(options(), {chosen(), 0, ""});
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
  EXPECT_THROW(intake.begin(impossible, {chosen(), kAll, ""}), RecordingError);
  EXPECT_FALSE(intake.isOpen());
  EXPECT_FALSE(intake.isWriting());
  intake.begin(options(), {chosen(), kAll, ""});
  EXPECT_EQ(end(intake)["/a"], 1u);
}

TEST_F(Intakes, CountNothingMoreWhenARecordingHasEndedByItself) {
  std::promise<void> ended;
  Intake intake("/recorder", memory(), [&ended] { ended.set_value(); });
  intake.choose(chosen());
  intake.addProblem("of the recording before");
  intake.begin(options(), {chosen(), 0, "<cell/>"});
  EXPECT_TRUE(intake.state().problems.empty());
  const ConnectionPtr a = connectionOf("/a");
  intake.receive(messageAt(2, a, kBytes));
  ASSERT_TRUE(std::filesystem::remove(intake.status().files.front() + ".active"));
  waitFor(ended.get_future());
  EXPECT_FALSE(intake.isWriting());
  EXPECT_TRUE(intake.isOpen());
  intake.receive(messageAt(3, a, kBytes));
  EXPECT_FALSE(intake.mark(ros::Time(4), "too late"));
  intake.close();
  const std::string problem = intake.finish();
  EXPECT_NE(problem.find("was removed or moved"), std::string::npos) << problem;
  const RecorderState state = intake.state();
  EXPECT_EQ(state.topics.front().bytes, kBytes);
  EXPECT_EQ(state.topics.front().messages, 1u);
  EXPECT_EQ(state.dropped, 0u);
  EXPECT_EQ(state.messages, 3u);  // with the configuration and the account
}

TEST_F(SimulatedIntake, ForgetsWhatIsLatchedByADeadNodeWhenAnotherTookItsPlace) {
  const auto recorded = [this] {
    begin();
    end(intake_);
    return sequencesIn(bag(), "/b");
  };
  receive(latchedBy("/old", "/b"), 1);
  EXPECT_EQ(recorded(), Numbers{1});
  intake_.follow({}, {});
  EXPECT_EQ(recorded(), Numbers{1});  // everybody still shows it
  receive(latchedBy("/new", "/b"), 2);
  EXPECT_EQ(recorded(), (Numbers{1, 2}));
  intake_.follow({{"/b", {"/old", "/new"}}}, {});
  EXPECT_EQ(recorded(), (Numbers{1, 2}));
  intake_.follow({{"/b", {"/new"}}}, {});
  EXPECT_EQ(recorded(), Numbers{2});
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

TEST(Frames, HaveOneConnectionForEachOfTheSource) {
  FixedFrames frames;
  for (const auto& [node, topic] :
       std::map<std::string, std::string>{{"/cell_frames", kFrames}, {"/camera", kOtherFrames}}) {
    const Message message = messageAt(1, connectionOf("/tf_static", node));
    const auto first = frames.copyOf(message), second = frames.copyOf(message);
    ASSERT_TRUE(first && second);
    EXPECT_EQ(first->connection, second->connection);
    EXPECT_EQ(first->topic(), topic);
    EXPECT_EQ(first->connection->field("topic"), topic);
    EXPECT_EQ(first->connection->field("callerid"), node);
    EXPECT_EQ(first->content, message.content);
  }
  EXPECT_FALSE(frames.copyOf(messageAt(1, connectionOf("/tf", "/cell_frames"))));
}

TEST(ProblemList, KeepsTheNewestAndCountsAll) {
  Problems problems;
  for (unsigned i = 0; i < Problems::kMax + 2; ++i) problems.add(std::to_string(i));
  EXPECT_EQ(problems.texts().size(), Problems::kMax);
  EXPECT_EQ(problems.texts().front(), "2");
  problems.clear();
  EXPECT_TRUE(problems.texts().empty());
  EXPECT_EQ(problems.count(), Problems::kMax + 2);
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
