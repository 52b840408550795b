// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <string>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/recording.hpp"
#include "recorder_bags.hpp"
#include "recorder_folder.hpp"
#include "recorder_machine.hpp"
#include "recorder_messages.hpp"

namespace process_visualizer::recorder {
namespace {

namespace fs = std::filesystem;

class Names : public Folder {};

TEST_F(Names, AreThoseOfTheThesis) {
  EXPECT_EQ(newBagPath(folder_, "", "seam"), path("seam.bag"));
  EXPECT_EQ(newBagPath(folder_, "", "seam.bag"), path("seam.bag"));
  const std::string dated = newBagPath(folder_, "left", "");
  EXPECT_EQ(dated.find(path("left_2")), 0u) << dated;
  EXPECT_EQ(dated.size(), path("left_2026-01-02-03-04-05.bag").size());
}

TEST_F(Names, ThatExistAreRefused) {
  for (const std::string taken : {"a.bag", "b.bag.active", "c_0.bag"}) std::ofstream(path(taken));
  for (const std::string name : {"a", "b", "c"})
    EXPECT_THROW(newBagPath(folder_, "", name), RecordingError) << name;
}

TEST_F(Names, ThatCannotBeAFilesAreRefused) {
  for (const std::string name : {"a/b", "/a", "..", ".bag", ".hidden", "a\nb"})
    EXPECT_THROW(newBagPath(folder_, "", name), RecordingError) << name;
  EXPECT_THROW(newBagPath(folder_, "a/b", ""), RecordingError);
}

TEST_F(Names, OfOneSecondAreNumbered) {
  const std::string first = newBagPath(folder_, "", "");
  std::ofstream{first};
  EXPECT_NE(newBagPath(folder_, "", ""), first);
}

TEST(Folders, ThatCannotBeCreatedAreNamed) {
  try {
    createFolder("/proc/nothing/here");
    FAIL();
  } catch (const RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("/proc/nothing/here"), std::string::npos);
  }
  EXPECT_THROW(createFolder("~/bags"), RecordingError);
  EXPECT_THROW(createFolder("/tmp/a\nb"), RecordingError);
}

TEST(Folders, WithoutRoomAreNamed) {
  EXPECT_GT(requireRoom("/tmp", 1), 1u);
  try {
    requireRoom("/tmp", (std::uint64_t{1} << 62) + 1);
    FAIL();
  } catch (const RecordingError& error) {
    EXPECT_EQ(std::string(error.what()),
              "/tmp: less than 4398046511105 MiB are free; make room or choose another folder");
  }
}

class Bags : public Folder {};

TEST_F(Bags, AreActiveUntilTheyAreFinished) {
  BagFile bag(path("a.bag"), Compression::kNone);
  bag.write(messageAt(1, connectionWith("")));
  EXPECT_TRUE(fs::exists(path("a.bag.active")));
  EXPECT_EQ(bag.finish(), "");
  EXPECT_FALSE(fs::exists(path("a.bag.active")));
  EXPECT_GT(indexPosition(path("a.bag")), 4096u);
}

TEST_F(Bags, AreThoseOfRosbag) {
  const ConnectionPtr plain = connectionOf("/a"), latching = latchedBy("/m", "/b");
  BagFile bag(path("a.bag"), Compression::kNone);
  bag.write(messageAt(3, latching, 7, 1));
  bag.write(messageAt(4, plain, 2'000'000, 2));
  bag.write(messageAt(5, plain, 8, 3));  // begins another chunk
  EXPECT_EQ(bag.finish(), "");
  const std::vector<Recorded> found = messagesIn(path("a.bag"));
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(topicsIn(path("a.bag")), (std::vector<std::string>{"/b", "/a", "/a"}));
  EXPECT_EQ(found[1].bytes.size(), 2'000'000u);
  for (unsigned i = 0; i < 3; ++i) {
    EXPECT_EQ(found[i].sequence(), i + 1);
    EXPECT_EQ(found[i].time, ros::Time(3 + i));
    EXPECT_EQ(found[i].type, "a/A");
    EXPECT_EQ(found[i].definition, "float32 x");
    EXPECT_EQ(found[i].publisher, i == 0 ? "/m" : "/n");
    EXPECT_EQ(found[i].is_latching, i == 0);
  }
}

/// The repair of a bag without an index depends on it.
TEST_F(Bags, HaveTheTimeInEachMessageToo) {
  BagFile bag(path("a.bag"), Compression::kNone);
  for (const double time : {3, 4, 5}) bag.write(messageAt(time, connectionOf("/a")));
  bag.flush();
  std::ifstream file(path("a.bag.active"), std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  const std::string four = {4, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_NE(bytes.find("time=" + four), std::string::npos);
}

TEST_F(Bags, CanBeCompressed) {
  const ConnectionPtr connection = connectionOf("/a");
  BagFile bag(path("a.bag"), Compression::kLz4);
  for (unsigned i = 0; i < 100; ++i) bag.write(messageAt(1 + i, connection, 100'000, i));
  EXPECT_EQ(bag.finish(), "");
  EXPECT_LT(fs::file_size(path("a.bag")), 1'000'000u);
  const std::vector<Recorded> found = messagesIn(path("a.bag"));
  ASSERT_EQ(found.size(), 100u);
  for (unsigned i = 0; i < 100; ++i) {
    EXPECT_EQ(found[i].sequence(), i);
    EXPECT_EQ(found[i].bytes.size(), 100'000u);
  }
}

TEST_F(Bags, ThatCannotBeCreatedAreNamed) {
  try {
    BagFile("/proc/a.bag", Compression::kNone);
    FAIL();
  } catch (const RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("/proc/a.bag cannot be created"), std::string::npos)
        << error.what();
  }
}

TEST_F(Bags, NeverReplaceAnother) {
  BagFile bag(path("a.bag"), Compression::kNone);
  std::ofstream(path("a.bag")) << "other";
  EXPECT_EQ(bag.finish(), "");
  EXPECT_EQ(bag.path(), path("a-2.bag"));
  EXPECT_EQ(fs::file_size(path("a.bag")), 5u);
  EXPECT_THROW(
      [&] {
        std::ofstream(path("b.bag.active"));
        BagFile(path("b.bag"), Compression::kNone);
      }(),
      RecordingError);
}

TEST_F(Bags, AreWrittenAgainWhenTheirFolderIsGone) {
  fs::create_directory(path("f"));
  BagFile bag(path("f/a.bag"), Compression::kNone);
  bag.write(messageAt(1, connectionWith("")));
  bag.flush();
  const std::uint64_t size = bag.size();
  fs::remove_all(path("f"));
  EXPECT_TRUE(bag.isRemoved());
  EXPECT_EQ(bag.finish(), "");
  EXPECT_GT(fs::file_size(path("f/a.bag")), size);
  EXPECT_EQ(indexPosition(path("f/a.bag")), size);
}

TEST_F(Bags, AreWrittenAgainBesideWhatHasTakenTheirPlace) {
  BagFile bag(path("a.bag"), Compression::kNone);
  bag.write(messageAt(1, connectionWith("")));
  bag.flush();
  const std::uint64_t size = bag.size();
  fs::rename(path("a.bag.active"), path("away"));
  std::ofstream(path("a.bag.active")) << "another's";
  EXPECT_TRUE(bag.isRemoved());
  EXPECT_EQ(bag.finish(), "");
  EXPECT_EQ(bag.path(), path("a-2.bag"));
  EXPECT_EQ(indexPosition(path("a-2.bag")), size);
  EXPECT_EQ(fs::file_size(path("a.bag.active")), 9u);
}

TEST_F(Bags, AreWholeOnAFullDisk) {
  const auto connection = connectionWith("");
  limitFileSize(5 << 20);
  BagFile bag(path("a.bag"), Compression::kNone);
  unsigned written = 0;
  try {
    for (;; ++written) bag.write(messageAt(1 + written, connection, 100'000));
  } catch (const RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("make room"), std::string::npos) << error.what();
  }
  EXPECT_GT(written, 30u);
  EXPECT_GT(bag.discarded().at("/a"), 0u);
  EXPECT_LT(bag.discarded().at("/a"), 12u);  // one chunk
  EXPECT_EQ(bag.finish(), "");
  limitFileSize(RLIM_INFINITY);
  EXPECT_GT(indexPosition(path("a.bag")), 3u << 20);
}

/// Room for the index is left at any file size limit.
TEST_F(Bags, AreWholeWhereverALimitIs) {
  const auto connection = connectionWith("");
  for (unsigned kilobytes = 300; kilobytes < 320; ++kilobytes) {
    const std::string name = path(std::to_string(kilobytes) + ".bag");
    limitFileSize(kilobytes << 10);
    BagFile bag(name, Compression::kNone);
    const auto write = [&bag, &connection] {
      for (unsigned written = 0;; ++written) {
        bag.write(messageAt(1 + written, connection));
        bag.flush();
      }
    };
    EXPECT_THROW(write(), RecordingError);
    EXPECT_EQ(bag.finish(), "") << kilobytes;
    limitFileSize(RLIM_INFINITY);
    EXPECT_GT(indexPosition(name), 0u) << kilobytes;
  }
}

TEST_F(Bags, OfWhatIsHereAreWholeOrNotThere) {
  const auto connection = connectionWith("");
  std::deque<Message> messages;
  for (unsigned i = 1; i <= 30; ++i) messages.push_back(messageAt(i, connection, 100'000));
  EXPECT_GT(bagBytes(messages), 3'000'000u);
  BagFile whole(path("a.bag"), Compression::kNone);
  writeWhole(whole, messages);
  EXPECT_EQ(whole.counts().at("/a"), 30u);
  EXPECT_LT(fs::file_size(path("a.bag")), bagBytes(messages) + 10'000);
  EXPECT_GT(indexPosition(path("a.bag")), 3'000'000u);
  for (const rlim_t limit : {rlim_t{1} << 20, fs::file_size(path("a.bag")) - 1}) {
    limitFileSize(limit);
    BagFile bag(path("b.bag"), Compression::kNone);
    EXPECT_THROW(writeWhole(bag, messages), RecordingError);
    limitFileSize(RLIM_INFINITY);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << limit;
  }
}

TEST_F(Bags, OfWhatIsHereLeaveRoomForARecording) {
  RecordingOptions options;
  options.path = path("a.bag");
  options.minimum_free_bytes = 0;
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 61;
  EXPECT_THROW(createWhole(options, kHuge), RecordingError);
  options.minimum_free_bytes = kHuge;
  EXPECT_THROW(createWhole(options, 0), RecordingError);
  EXPECT_TRUE(fs::is_empty(folder_));
  options.minimum_free_bytes = 0;
  createWhole(options, 1).remove();
}

class Recordings : public Folder {
 protected:
  RecordingContents contents() {
    RecordingContents contents;
    contents.account = [](const auto& time, const auto&, const auto&) {
      return textMessage(textConnection("/account", "/n"), time, "");
    };
    contents.on_end = [this] { ended_.set_value(); };
    return contents;
  }
  RecordingOptions options(const std::string& name) const {
    RecordingOptions options;
    options.path = path(name);
    options.minimum_free_bytes = 0;
    return options;
  }
  void waitUntilEnded() { waitFor(ended_.get_future()); }
  static void waitForCount(const Recording& recording, std::uint64_t count) {
    waitUntil([&] { return recording.status().messages["/a"] == count; });
  }
  SimulatedMachine machine_;
  std::promise<void> ended_;
};

TEST_F(Recordings, RefuseWhatTheirQueueCannotTake) {
  RecordingOptions small = options("a.bag");
  small.queue_bytes = 1000;
  Recording recording(small, contents());
  EXPECT_FALSE(recording.push(messageAt(1, connectionWith(""), 1001)));
  EXPECT_TRUE(recording.push(messageAt(1, connectionWith(""), 999)));
  recording.stop();
  EXPECT_FALSE(recording.push(messageAt(2, connectionWith(""))));
}

TEST_F(Recordings, KeepWhatHasRoomInTheirQueueWhileTheDiskStalls) {
  std::promise<void> stalled, goes_on;
  RecordingContents begin = contents();
  begin.account = [&](const auto& time, const auto&, const auto&) {  // while a part is finished
    if (time == ros::Time(1)) {
      stalled.set_value();
      goes_on.get_future().wait();
    }
    return textMessage(textConnection("/account", "/n"), time, "");
  };
  RecordingOptions parts = options("a.bag");
  parts.split_duration = 5;
  parts.queue_bytes = 1'000'000;
  const ConnectionPtr connection = connectionOf("/a");
  begin.recent = {messageAt(1, connection, 100, 0)};
  Recording recording(parts, std::move(begin));
  EXPECT_TRUE(recording.push(messageAt(10, connection, 100, 1)));
  waitFor(stalled.get_future());
  unsigned large = 0;
  while (recording.push(messageAt(11, connection, 100'000, 2 + large))) ++large;
  EXPECT_EQ(large, 9u);  // a tenth of the queue is kept for small ones
  EXPECT_TRUE(recording.push(messageAt(12, connection, 50'000, 11)));
  EXPECT_TRUE(recording.push(messageAt(12, connection, 50'000, 12)));
  EXPECT_FALSE(recording.push(messageAt(12, connection, 50'000, 13)));
  goes_on.set_value();
  recording.stop();
  EXPECT_EQ(sequencesIn(path("a_0.bag"), "/a"), std::vector<std::uint32_t>{0});
  EXPECT_EQ(sequencesIn(path("a_1.bag"), "/a"),
            (std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  EXPECT_TRUE(recording.unwritten().empty());
}

/// A kill costs no more than that, because the messages in the file are repaired.
TEST_F(Recordings, WriteWhatHasComeEveryHalfSecond) {
  Recording recording(options("a.bag"), contents(), machine_.machine());
  const ConnectionPtr connection = connectionOf("/a");
  const auto size = [this] { return fs::file_size(path("a.bag.active")); };
  recording.push(messageAt(1, connection, 1000));
  waitForCount(recording, 1);
  machine_.goOn(0.5);
  recording.push(messageAt(2, connection, 1000));
  waitUntil([&] { return size() > 4096 + 2000; });
  const auto written = size();
  recording.push(messageAt(3, connection, 1000));
  waitForCount(recording, 3);
  machine_.goOn(0.4);
  recording.push(messageAt(4, connection, 1000));
  waitForCount(recording, 4);
  EXPECT_EQ(size(), written);  // no chunk for each message
}

TEST_F(Recordings, TellJumpsOfTheClock) {
  std::vector<ClockJump> told;
  RecordingContents begin = contents();
  begin.account = [&told](const auto& time, const auto& jumps, const auto&) {
    told = jumps;
    return textMessage(textConnection("/account", "/n"), time, "");
  };
  Recording recording(options("a.bag"), std::move(begin), machine_.machine());
  machine_.jump(-900);
  machine_.goOn(0.5);
  recording.push(messageAt(1, connectionOf("/a")));
  waitUntil([&recording] { return !recording.status().clock_jumps.empty(); });
  recording.stop();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NEAR(told.front().seconds, -900, 1e-6);
}

TEST_F(Recordings, EndWhereRoomBecomesScarceAndHaveAllUntilThen) {
  RecordingOptions some = options("a.bag");
  some.minimum_free_bytes = 1 << 20;
  Recording recording(some, contents(), machine_.machine());
  const ConnectionPtr connection = connectionOf("/a");
  recording.push(messageAt(1, connection, 100, 1));
  waitForCount(recording, 1);
  machine_.setFreeBytes((1 << 20) - 1);
  machine_.goOn(0.5);
  recording.push(messageAt(2, connection, 100, 2));
  waitUntilEnded();
  EXPECT_FALSE(recording.push(messageAt(3, connection, 100, 3)));
  recording.stop();
  EXPECT_EQ(recording.status().problem,
            "the recording was stopped, because less than 1 MiB are free in " + folder_ +
                "; the bag is complete until then");
  EXPECT_EQ(recording.status().free_bytes, (1u << 20) - 1);
  EXPECT_TRUE(recording.unwritten().empty());
  EXPECT_EQ(sequencesIn(path("a.bag"), "/a"), (std::vector<std::uint32_t>{1, 2}));
}

TEST_F(Recordings, DoNotBeginWithoutRoom) {
  RecordingOptions many = options("a.bag");
  many.minimum_free_bytes = std::uint64_t{1} << 62;
  EXPECT_THROW(Recording(many, contents()), RecordingError);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Recordings, AreSplitBySize) {
  RecordingOptions parts = options("a.bag");
  parts.split_bytes = 1 << 20;
  RecordingContents begin = contents();
  begin.latched.add(messageAt(1, connectionWith("", "1")));
  Recording recording(parts, std::move(begin));
  const auto connection = connectionWith("");
  for (unsigned i = 0; i < 25; ++i) EXPECT_TRUE(recording.push(messageAt(i, connection, 100'000)));
  recording.stop();
  EXPECT_EQ(recording.status().files,
            (std::vector<std::string>{path("a_0.bag"), path("a_1.bag"), path("a_2.bag")}));
  for (const std::string& file : recording.status().files) EXPECT_GT(indexPosition(file), 4096u);
}

TEST_F(Recordings, CountWhatTheirBagsHold) {
  RecordingOptions parts = options("a.bag");
  parts.split_duration = 5;
  RecordingContents begin = contents();
  begin.latched.add(messageAt(1, latchedBy("/n", "/latched")));
  begin.recent = {messageAt(1, connectionWith(""))};
  Recording recording(parts, std::move(begin));
  for (unsigned i = 2; i < 10; ++i) recording.push(messageAt(i, connectionWith(""), 100, i));
  recording.stop();
  EXPECT_EQ(recording.status().messages,
            (std::map<std::string, std::uint64_t>{{"/a", 9}, {"/account", 2}, {"/latched", 2}}));
  const std::vector<std::string> files = recording.status().files;
  ASSERT_EQ(files.size(), 2u);
  for (const std::string& file : files) EXPECT_EQ(topicsIn(file).front(), "/latched");
  EXPECT_EQ(sequencesIn(files[0], "/a"), (std::vector<std::uint32_t>{0, 2, 3, 4, 5}));
  EXPECT_EQ(sequencesIn(files[1], "/a"), (std::vector<std::uint32_t>{6, 7, 8, 9}));
}

TEST_F(Recordings, CountLatchedMessagesThatNothingHasRoomFor) {
  limitFileSize(100'000);
  RecordingContents begin = contents();
  for (const char* node : {"/a", "/b", "/c"}) {
    const auto content = boost::make_shared<RawMessage>();
    content->bytes.resize(1'500'000);
    begin.latched.add({latchedBy(node), ros::Time(1), content});
  }
  Recording recording(options("a.bag"), std::move(begin));
  waitUntilEnded();
  recording.stop();
  limitFileSize(RLIM_INFINITY);
  EXPECT_EQ(recording.unwritten().at("/a"), 3u);
  EXPECT_EQ(recording.status().messages.count("/account"), 1u);
  EXPECT_GT(indexPosition(path("a.bag")), 4096u);
}

TEST_F(Recordings, EndWhenTheyWereEndedHoweverLongTheyAreWritten) {
  for (const double end : {0.0, 3.5, 20.0}) {
    ros::Time account_time;
    RecordingContents begin = contents();
    begin.account = [&](const auto& time, const auto&, const auto&) {
      account_time = time;
      return textMessage(textConnection("/account", "/n"), time, "");
    };
    begin.recent = {messageAt(1, connectionWith("")), messageAt(7, connectionWith(""))};
    Recording recording(options(std::to_string(end) + ".bag"), std::move(begin));
    recording.stop(ros::Time(end));
    EXPECT_EQ(account_time, ros::Time(std::max(end, 7.0)));
  }
}

TEST_F(Recordings, EndByThemselvesOnAFullDiskAndCountWhatIsMissing) {
  limitFileSize(3 << 20);
  Recording recording(options("a.bag"), contents());
  const auto connection = connectionWith("");
  unsigned pushed = 0;
  while (recording.push(messageAt(1 + pushed, connection, 100'000)) && pushed < 100'000) ++pushed;
  waitUntilEnded();
  recording.stop();
  limitFileSize(RLIM_INFINITY);
  EXPECT_NE(recording.status().problem, "");
  EXPECT_GT(recording.unwritten().at("/a"), 0u);
  EXPECT_LT(recording.unwritten().at("/a"), pushed);
  EXPECT_GT(indexPosition(path("a.bag")), 1u << 20);
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
