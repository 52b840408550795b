// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/recording_request.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "process_visualizer/recorder/bag_name.hpp"

namespace process_visualizer::recorder {
namespace {

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
