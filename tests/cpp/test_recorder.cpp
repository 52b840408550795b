#include <gtest/gtest.h>
#include <sys/resource.h>

#include <boost/make_shared.hpp>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>

#include "process_visualizer/recorder/account.hpp"
#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/bag_name.hpp"
#include "process_visualizer/recorder/recent_messages.hpp"
#include "process_visualizer/recorder/recording.hpp"
#include "process_visualizer/recorder/topic_statistics.hpp"

namespace process_visualizer {
namespace {

namespace fs = std::filesystem;

ConnectionPtr connectionWith(const std::string& definition, const std::string& latching = "0") {
  return std::make_shared<Connection>(Connection{"/a",
                                                 {{"type", "a/A"},
                                                  {"md5sum", "0"},
                                                  {"message_definition", definition},
                                                  {"callerid", "/n"},
                                                  {"latching", latching}}});
}

Message messageAt(double time, const ConnectionPtr& connection, std::size_t size = 100,
                  std::uint32_t sequence = 0) {
  const auto content = boost::make_shared<RawMessage>();
  content->bytes.resize(size);
  std::memcpy(content->bytes.data(), &sequence, sizeof sequence);
  return {connection, ros::Time(time), content};
}

class Folder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "recorder-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }

  /// A limit on the size of files fails like a full disk, in the same calls, for any user.
  static void limitFileSize(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit limit{};
    getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = bytes;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  }

  /// The field index_pos of a bag: zero until the bag is finished.
  static std::uint64_t indexPosition(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string head(200, '\0');
    file.read(head.data(), head.size());
    const std::size_t at = head.find("index_pos=") + 10;
    std::uint64_t position = 0;
    std::memcpy(&position, head.data() + at, sizeof position);
    return position;
  }

  std::string folder_;
};

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

class Recordings : public Folder {
 protected:
  RecordingContents contents() {
    RecordingContents contents;
    contents.account = [](const auto&, const auto&) {
      return textMessage(textConnection("/account", "/n"), ros::Time(9), "");
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

TEST(Clock, JumpsAreNotedAndDriftIsNot) {
  double offset = 5;
  ClockWatch watch([&offset] { return offset; });
  for (const double step : {0.0, 0.05, -0.05, -3600.0, 0.0, 0.2}) {
    offset += step;
    watch.look();
  }
  ASSERT_EQ(watch.jumps().size(), 2u);
  EXPECT_DOUBLE_EQ(watch.jumps()[0].seconds, -3600.0);
  EXPECT_NEAR(watch.jumps()[1].seconds, 0.2, 1e-9);
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

TEST(Latched, KeepsTheNewestOfEachPublisher) {
  LatchedMessages latched;
  const auto connection = connectionWith("", "1");
  latched.add(messageAt(1, connection, 10));
  latched.add(messageAt(2, connection, 20));
  latched.add(messageAt(3, connectionWith(""), 30));
  const auto messages = latched.at(ros::Time(5));
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].size(), 20u);
  EXPECT_EQ(messages[0].time, ros::Time(5));
}

TEST(Statistics, CountSequenceNumbersLeftOut) {
  TopicStatistics statistics;
  const auto connection = connectionWith("# comment\nuint8 A=1\n\nHeader header\n");
  for (const std::uint32_t sequence : {7u, 8u, 11u, 12u, 3u, 4u})
    statistics.add(messageAt(1, connection, 10, sequence));
  EXPECT_EQ(statistics.lost(), 2u);
  EXPECT_EQ(statistics.gaps(), 1u);
}

TEST(Statistics, FindLongIntervalsWhereThereAreNoNumbers) {
  TopicStatistics statistics;
  const auto connection = connectionWith("float32 data");
  for (int i = 0; i < 20; ++i) statistics.add(messageAt(1 + 0.01 * i, connection));
  EXPECT_EQ(statistics.gaps(), 0u);
  statistics.add(messageAt(1.25, connection));
  EXPECT_EQ(statistics.gaps(), 1u);
  EXPECT_EQ(statistics.lost(), 0u);
  EXPECT_NEAR(statistics.largestGap(), 0.06, 1e-6);
  EXPECT_NEAR(statistics.largestGapTime().toSec(), 1.19, 1e-6);
}

TEST(Statistics, TellASilenceOnce) {
  TopicStatistics statistics;
  const auto connection = connectionWith("float32 data");
  EXPECT_FALSE(statistics.fellSilent(ros::Time(100)));
  for (int i = 0; i <= 10; ++i) statistics.add(messageAt(1 + 0.2 * i, connection));
  EXPECT_FALSE(statistics.fellSilent(ros::Time(4.9)));
  EXPECT_TRUE(statistics.fellSilent(ros::Time(5.1)));
  EXPECT_FALSE(statistics.fellSilent(ros::Time(6)));
  statistics.add(messageAt(7, connection));
  EXPECT_TRUE(statistics.fellSilent(ros::Time(10)));
}

TEST(Account, NamesTopicsOfWhichNothingCame) {
  TopicStatistics one;
  one.add(messageAt(1, connectionWith("")));
  EXPECT_EQ(accountText({{"/a", one}, {"/b", {}}}, {{ros::WallTime(2), 0.5}}, {{"/a", 1}}),
            R"({"topics": {"/a": {"received": 1, "dropped": 1}, )"
            R"("/b": {"received": 0, "dropped": 0}}, )"
            R"("clock_jumps": [{"time": 2, "seconds": 0.5}]})");
}

TEST(Statistics, KnowTypesThatBeginWithAHeader) {
  EXPECT_TRUE(beginsWithHeader("std_msgs/Header header\nfloat32 x"));
  EXPECT_FALSE(beginsWithHeader("float32 x\nHeader header"));
  EXPECT_FALSE(beginsWithHeader(""));
}

}  // namespace
}  // namespace process_visualizer

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
