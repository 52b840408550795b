// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "process_visualizer/recorder/clock_watch.hpp"
#include "process_visualizer/recorder/topic_statistics.hpp"

namespace process_visualizer::recorder {

/// Returns what a recorder knows of a recording at its end, as JSON: by topic what it received and
/// what it dropped, and the jumps of the clock.
/// \param unwritten messages that were received and could not be written, by topic
std::string accountText(const std::map<std::string, TopicStatistics>& statistics,
                        const std::vector<ClockJump>& jumps,
                        const std::map<std::string, std::uint64_t>& unwritten);

}  // namespace process_visualizer::recorder
