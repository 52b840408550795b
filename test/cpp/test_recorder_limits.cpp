// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <limits>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/recording_request.hpp"
#include "recorder_folder.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Limits, ARecordingIsNotSplitIntoAFileForEveryMessage) {
  EXPECT_NO_THROW(checkSplit(0, 0));
  EXPECT_NO_THROW(checkSplit(1 << 20, 1));
  for (const double duration_s : {1e-9, 0.99, -1.0, kNan, kInfinity, -kInfinity, 1e308, -1e308})
    EXPECT_THROW(checkSplit(0, duration_s), RecordingError) << duration_s;
  for (const std::uint64_t bytes : {1UL, (1UL << 20) - 1})
    EXPECT_THROW(checkSplit(bytes, 0), RecordingError) << bytes;
}

TEST(Limits, TheMemoryIsAskedForATime) {
  for (const double recent_s : {0.0, 0.5, 3600.0}) EXPECT_NO_THROW(checkRecent(recent_s));
  for (const double recent_s : {-1.0, kNan, kInfinity, 1e308})
    EXPECT_THROW(checkRecent(recent_s), RecordingError) << recent_s;
}

TEST(Limits, AMaskIsOctal) {
  EXPECT_EQ(fileModeMask("0027"), 0027U);
  EXPECT_EQ(fileModeMask("77"), 077U);
  for (const char* text : {"", "8", "-1", "0x1", "00027"})
    EXPECT_THROW(fileModeMask(text), RecordingError) << text;
}

class Folders : public Folder {};

TEST_F(Folders, AreThoseThatTheRecorderWasStartedWith) {
  std::filesystem::create_directory(path("bags"));
  std::filesystem::create_directory(path("bags_of_others"));
  std::filesystem::create_directory_symlink(path("bags_of_others"), path("bags/link"));
  const AllowedFolders allowed({path("bags/")});
  for (const char* name : {"bags", "bags/", "bags/new/er", "bags/a/../b"})
    EXPECT_NO_THROW(allowed.check(path(name))) << name;
  for (const char* name : {"", "bags_of_others", "bags/../etc", "bags/link", "bags/link/new"})
    EXPECT_THROW(allowed.check(path(name)), RecordingError) << name;
  EXPECT_THROW(allowed.check("/etc"), RecordingError);
  EXPECT_NO_THROW(AllowedFolders({"/"}).check("/etc"));
}

TEST_F(Folders, AndBagsHaveThePermissionsOfTheMask) {
  const auto mode = [](const std::string& path) {
    struct stat found {};
    stat(path.c_str(), &found);
    return found.st_mode & 0777U;
  };
  for (const mode_t mask : {0022U, 0077U, 0007U}) {
    const mode_t before = umask(mask);
    const std::string folder = path(std::to_string(mask));
    createFolder(folder);
    { BagFile(folder + "/a.bag", Compression::kNone).finish(); }
    umask(before);
    EXPECT_EQ(mode(folder), 0777U & ~mask);
    EXPECT_EQ(mode(folder + "/a.bag"), 0666U & ~mask);
  }
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
