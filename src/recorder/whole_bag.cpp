// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/whole_bag.hpp"

#include <filesystem>
#include <numeric>

#include "process_visualizer/recorder/bag_name.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr std::uint64_t kRecordBytes = 64;  // around a message, with its place in the index

}  // namespace

std::uint64_t bagBytes(const std::deque<Message>& messages) {
  return std::accumulate(messages.begin(), messages.end(), std::uint64_t{0},
                         [](std::uint64_t bytes, const Message& message) {
                           return bytes + message.size() + kRecordBytes;
                         });
}

BagFile createWhole(const RecordingOptions& options, std::uint64_t bytes) {
  requireRoom(std::filesystem::path(options.path).parent_path(),
              options.minimum_free_bytes + bytes);
  return {options.path, options.compression};
}

void writeWhole(BagFile& file, std::deque<Message> messages) {
  try {
    // What is written may leave the memory: images are large.
    for (; !messages.empty(); messages.pop_front()) file.write(messages.front());
    const std::string problem = file.finish(PowerCut::kMayCostAll);
    if (!problem.empty()) throw RecordingError(problem);
  } catch (...) {
    file.remove();
    throw;
  }
}

}  // namespace process_visualizer::recorder
