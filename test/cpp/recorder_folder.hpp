// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

namespace process_visualizer::recorder {

/// A folder for bags, which exists during a test.
class Folder : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "recorder-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }

  /// Limits the size of files. Writing then fails as on a full disk, in the same calls, for any
  /// user.
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

}  // namespace process_visualizer::recorder
