// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <deque>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/bag_name.hpp"
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

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
