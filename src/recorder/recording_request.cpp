// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/recording_request.hpp"

#include <algorithm>

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
                           const std::string& folder) {
  RecordingOptions options;
  options.compression = compressionOf(request.compression);
  options.split_bytes = request.split_bytes;
  options.split_duration = request.split_duration;
  options.queue_bytes = megabytes(node, "queue_megabytes", 512);
  options.minimum_free_bytes = megabytes(node, "minimum_free_megabytes", 1024);
  options.path = pathOf(request, folder);
  return options;
}

std::string pathOf(const StartRecording::Request& request, const std::string& folder) {
  const std::string chosen = request.folder.empty() ? folder : request.folder;
  createFolder(chosen);
  return newBagPath(chosen, request.prefix, request.name);
}

}  // namespace process_visualizer::recorder
