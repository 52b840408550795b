// SPDX-License-Identifier: BSD-3-Clause
// Limits for requests, allowed folders from parameters and environment, and defaults.

#include "process_visualizer/recorder/recording_request.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "process_visualizer/common/required_name.hpp"
#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/problems.hpp"

namespace process_visualizer::recorder {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMinSplitBytes = 1 << 20;
constexpr double kMinSplitS = 1;
constexpr double kMaxTimeS = 1e8;  // three years
constexpr std::size_t kMaskDigits = 4;

bool isBelow(const fs::path& path, const fs::path& folder) {
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return end == folder.end();
}

/// The path with links resolved, as far as it exists, and without a trailing slash.
fs::path wholePath(const std::string& path) {
  std::error_code error;
  const fs::path found = fs::weakly_canonical(path, error);
  const fs::path whole = error ? fs::path(path).lexically_normal() : found;
  return whole.has_filename() ? whole : whole.parent_path();
}

}  // namespace

void AllowedFolders::check(const std::string& folder) const {
  const fs::path wanted = wholePath(folder);
  const auto is_above = [&](const std::string& it) { return isBelow(wanted, wholePath(it)); };
  if (std::none_of(folders_.begin(), folders_.end(), is_above))
    throw RecordingError(
        "the folder \"" + folder + "\" is not one of those allowed at the recorder's start (" +
        joined(folders_, ", ") + "); restart it with this one in ~folders, or in " +
        "PROCESS_VISUALIZER_BAG_FOLDERS");
}

void checkSplit(std::uint64_t bytes, double duration_s) {
  if (bytes != 0 && bytes < kMinSplitBytes)
    throw RecordingError("split_bytes is " + std::to_string(bytes) +
                         "; write 0 (never), or at least 1048576 (1 MB)");
  if (!(duration_s == 0 || (duration_s >= kMinSplitS && duration_s <= kMaxTimeS)))
    throw RecordingError("split_duration is " + std::to_string(duration_s) +
                         " s; write 0 (never), or 1 s to 100000000 s");
}

void checkRecent(double recent_s) {
  if (!(recent_s >= 0 && recent_s <= kMaxTimeS))
    throw RecordingError("recent is " + std::to_string(recent_s) +
                         " s; write how many seconds of the memory are wanted, such as 10");
}

mode_t fileModeMask(const std::string& octal) {
  const auto is_octal = [](char digit) { return digit >= '0' && digit <= '7'; };
  if (octal.empty() || octal.size() > kMaskDigits ||
      !std::all_of(octal.begin(), octal.end(), is_octal))
    throw RecordingError("~umask is \"" + octal + "\"; write an octal number such as \"0027\"");
  return static_cast<mode_t>(std::stoul(octal, nullptr, 8));
}

namespace {

constexpr std::size_t kMaxPathCharacters = 4096;

void checkTexts(const StartRecording::Request& request) {
  try {
    for (const std::string& text : {request.prefix, request.name, request.compression})
      requiredName(text);
  } catch (const std::invalid_argument& error) {
    throw RecordingError(error.what());
  }
  if (request.folder.size() > kMaxPathCharacters)
    throw RecordingError("the folder has " + std::to_string(request.folder.size()) +
                         " characters; at most " + std::to_string(kMaxPathCharacters) +
                         " are allowed");
}

Compression compressionOf(const std::string& name) {
  if (name.empty() || name == "none") return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  throw RecordingError("there is no compression \"" + name + "\"; write none or lz4");
}

}  // namespace

std::uint64_t megabytes(const ros::NodeHandle& node, const std::string& parameter, int value) {
  return static_cast<std::uint64_t>(std::max(node.param(parameter, value), 0)) << 20;
}

RecordingOptions optionsOf(const StartRecording::Request& request, const ros::NodeHandle& node,
                           const std::string& folder, const AllowedFolders& allowed) {
  checkTexts(request);
  checkSplit(request.split_bytes, request.split_duration);
  checkRecent(request.recent);
  RecordingOptions options;
  options.compression = compressionOf(request.compression);
  options.split_bytes = request.split_bytes;
  options.split_duration = request.split_duration;
  options.queue_bytes = megabytes(node, "queue_megabytes", 512);
  options.minimum_free_bytes = megabytes(node, "minimum_free_megabytes", 1024);
  options.path = pathOf(request, folder, allowed);
  return options;
}

std::string pathOf(const StartRecording::Request& request, const std::string& folder,
                   const AllowedFolders& allowed) {
  const std::string chosen = request.folder.empty() ? folder : request.folder;
  if (!chosen.empty() && chosen[0] == '/') allowed.check(chosen);
  createFolder(chosen);
  return newBagPath(chosen, request.prefix, request.name);
}

AllowedFolders allowedFolders(const ros::NodeHandle& node, const std::string& folder) {
  std::vector<std::string> folders;
  if (!node.getParam("folders", folders)) {
    std::error_code ignored;
    folders = {std::filesystem::temp_directory_path(ignored).string(),
               "/tmp",
               "/dev/shm",
               "/media",
               "/run/media",
               "/mnt"};
    if (const char* home = std::getenv("HOME")) folders.emplace_back(home);
  }
  if (const char* given = std::getenv("PROCESS_VISUALIZER_BAG_FOLDERS")) {
    std::istringstream words(given);
    for (std::string word; std::getline(words, word, ':');)
      if (!word.empty()) folders.push_back(word);
  }
  folders.push_back(folder);
  return AllowedFolders(std::move(folders));
}

}  // namespace process_visualizer::recorder
