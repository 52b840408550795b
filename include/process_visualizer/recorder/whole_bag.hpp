// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>

#include "process_visualizer/recorder/recording.hpp"

namespace process_visualizer::recorder {

/// Returns how large a bag of these messages becomes, about, if it is not compressed.
std::uint64_t bagBytes(const std::deque<Message>& messages);

/// Creates the file for a bag of so many bytes where a recording on the same disk can go on after
/// it. \throws RecordingError if there is no room for both
BagFile createWhole(const RecordingOptions& options, std::uint64_t bytes);

/// Writes messages and finishes the bag; whoever reads it does not wait for the disk. If it cannot
/// have all of them, the file is removed.
/// \throws RecordingError
void writeWhole(BagFile& file, std::deque<Message> messages);

}  // namespace process_visualizer::recorder
