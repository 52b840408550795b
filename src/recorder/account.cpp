// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/account.hpp"

#include <sstream>

namespace process_visualizer::recorder {

std::string accountText(const std::map<std::string, TopicStatistics>& statistics,
                        const std::vector<ClockJump>& jumps,
                        const std::map<std::string, std::uint64_t>& unwritten) {
  std::ostringstream text;
  text.precision(15);
  text << R"({"topics": {)";
  const char* separator = "";
  for (const auto& [topic, counts] : statistics) {
    const auto found = unwritten.find(topic);
    const std::uint64_t more = found == unwritten.end() ? 0 : found->second;
    text << separator << '"' << topic << R"(": {"received": )" << counts.received()
         << R"(, "dropped": )" << counts.dropped() + more << '}';
    separator = ", ";
  }
  text << R"(}, "clock_jumps": [)";
  separator = "";
  for (const ClockJump& jump : jumps) {
    text << separator << R"({"time": )" << jump.time << R"(, "seconds": )" << jump.seconds << '}';
    separator = ", ";
  }
  text << "]}";
  return text.str();
}

}  // namespace process_visualizer::recorder
