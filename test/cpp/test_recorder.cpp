// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <deque>
#include <filesystem>
#include <fstream>
#include <future>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/bag_name.hpp"
#include "process_visualizer/recorder/recent_messages.hpp"
#include "process_visualizer/recorder/recording.hpp"
#include "process_visualizer/recorder/whole_bag.hpp"
#include "recorder_folder.hpp"
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
              "/tmp: less than 4398046511105 MB are free; make room or choose another folder");
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

/// There is room for the index wherever a file may not grow any more.
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
  for (unsigned i = 2; i < 10; ++i) recording.push(messageAt(i, connectionWith("")));
  recording.stop();
  EXPECT_EQ(recording.status().files.size(), 2u);
  EXPECT_EQ(recording.status().messages,
            (std::map<std::string, std::uint64_t>{{"/a", 9}, {"/account", 2}, {"/latched", 2}}));
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
  ended_.get_future().wait();
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
  ended_.get_future().wait();
  recording.stop();
  limitFileSize(RLIM_INFINITY);
  EXPECT_NE(recording.status().problem, "");
  EXPECT_GT(recording.unwritten().at("/a"), 0u);
  EXPECT_LT(recording.unwritten().at("/a"), pushed);
  EXPECT_GT(indexPosition(path("a.bag")), 1u << 20);
}

TEST(Recent, IsBoundedInTimeAndBytes) {
  RecentMessages recent(10, 1000);
  const auto connection = connectionWith("");
  for (int i = 1; i <= 30; ++i) recent.add(messageAt(i, connection, 50));
  EXPECT_DOUBLE_EQ(recent.duration(), 10);
  EXPECT_EQ(recent.bytes(), 11u * 50);
  EXPECT_EQ(recent.last(ros::Time(30), 3).messages.size(), 4u);
  EXPECT_TRUE(recent.last(ros::Time(30), 0).messages.empty());
  recent.add(messageAt(31, connection, 900));
  EXPECT_LE(recent.bytes(), 1000u);
  recent.add(messageAt(32, connection, 2000));
  EXPECT_EQ(recent.bytes(), 0u);
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
  recent.pass(messageAt(19, connection, 19));
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
  EXPECT_EQ(recent.wished({0, {"/a"}}).messages.front().size(), 11u);
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
  EXPECT_EQ(recent.wished({0, wanted}).messages.size(), 1u);
  for (int i = 2; i <= 30; ++i) recent.add(messageAt(i, connectionWith(""), 100));
  recent.add(messageAt(30, other, 100));
  const NumberedMessages all = recent.wished({0, wanted});
  ASSERT_EQ(all.messages.size(), 12u);  // the latched one, and eleven of ten seconds
  EXPECT_EQ(all.messages[0].size(), 11u);
  EXPECT_LT(all.messages[0].time, all.messages[1].time);
  EXPECT_EQ(all.next, 32u);
  EXPECT_FALSE(all.is_cut);
  recent.add(messageAt(31, connectionWith(""), 100));
  const NumberedMessages new_ones = recent.wished({all.next, wanted});
  ASSERT_EQ(new_ones.messages.size(), 1u);
  EXPECT_EQ(new_ones.messages[0].time, ros::Time(31));
  EXPECT_TRUE(recent.wished({new_ones.next, wanted}).messages.empty());
  EXPECT_EQ(recent.wished({1, wanted}).messages.size(), 11u);  // the others are forgotten
  const NumberedMessages some = recent.wished({1, wanted, 0, 250});
  EXPECT_EQ(some.messages.size(), 3u);
  EXPECT_TRUE(some.is_cut);
  EXPECT_EQ(recent.wished({some.next, wanted}).messages.size(), 8u);
  EXPECT_TRUE(recent.wished({1, wanted, 99}).messages.empty());  // these are larger
  recent.clear();
  EXPECT_EQ(recent.wished({1, wanted}).next, 33u);
  EXPECT_EQ(recent.wished({99, wanted}).next, 33u);  // of a recorder that ran before
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
  latched.forgetReplaced(isGone);
  std::vector<std::size_t> sizes;
  for (const Message& message : latched.at(ros::Time(5))) sizes.push_back(message.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{2, 3, 2}));
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
