// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>

#include "process_visualizer/recorder/bag_file.hpp"

namespace process_visualizer::recorder {

/// Returns how large a bag of these messages becomes, about, if it is not compressed.
std::uint64_t bagBytes(const std::deque<Message>& messages);

/// Writes messages and finishes the bag; whoever reads it does not wait for the disk. If it cannot
/// have all of them, the file is removed.
/// \throws RecordingError
void writeWhole(BagFile& file, std::deque<Message> messages);

}  // namespace process_visualizer::recorder
