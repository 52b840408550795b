// SPDX-License-Identifier: BSD-3-Clause
// Thresholds for gaps and silence of topics; the account of a recording as JSON.

#include "process_visualizer/recorder/topic_statistics.hpp"

#include <algorithm>
#include <cstring>
#include <sstream>

namespace process_visualizer::recorder {
namespace {

constexpr double kGapFactor = 3.0;
constexpr double kSilenceFactor = 10.0, kMinSilence = 1.0;  // usual intervals; s
constexpr double kPauseFactor = 2.0;                        // longest of the last intervals
// A log is silent if there are no problems, and contains the recorder's own warnings.
constexpr char kLogType[] = "rosgraph_msgs/Log";
constexpr std::chrono::seconds kLate(2);  ///< between two measurements of rates, usually 1 s
constexpr std::size_t kMinIntervals = 8;  ///< before the usual one is known

}  // namespace

void TopicStatistics::add(const Message& message) {
  ++received_;
  bytes_ += message.size();
  is_on_change_ = message.connection->isLatching() || message.connection->field("type") == kLogType;
  const bool is_numbered = takeSequence(message);
  if (!last_time_.isZero()) takeInterval((message.time - last_time_).toSec(), !is_numbered);
  last_time_ = message.time;
  is_silent_ = false;
}

bool TopicStatistics::fellSilent(const ros::Time& now) {
  const double usual = usualInterval();
  if (is_silent_ || is_on_change_ || usual == 0) return false;
  // Messages sent on change come in bursts, with pauses between them.
  const double pause = *std::max_element(intervals_.begin(), intervals_.end());
  is_silent_ = (now - last_time_).toSec() >
               std::max({kSilenceFactor * usual, kPauseFactor * pause, kMinSilence});
  return is_silent_;
}

/// Returns whether the sequence number is usable: greater than in the publisher's last message.
bool TopicStatistics::takeSequence(const Message& message) {
  const auto [place, is_new] = publishers_.try_emplace(message.connection);
  Publisher& publisher = place->second;
  if (is_new)
    publisher.has_header = beginsWithHeader(message.connection->field("message_definition"));
  if (!publisher.has_header || message.size() < sizeof(std::uint32_t)) return false;
  std::uint32_t sequence;
  std::memcpy(&sequence, message.content->bytes.data(), sizeof sequence);
  const bool grew = publisher.sequence && sequence > *publisher.sequence;
  if (grew && sequence - *publisher.sequence > 1) {
    lost_ += sequence - *publisher.sequence - 1;
    ++gaps_;
  }
  publisher.sequence = sequence;
  return grew;
}

void TopicStatistics::takeInterval(double interval, bool may_be_gap) {
  if (interval > largest_gap_) {
    largest_gap_ = interval;
    largest_gap_time_ = last_time_;
  }
  const double usual = may_be_gap ? usualInterval() : 0;
  if (usual > 0 && interval > kGapFactor * usual) ++gaps_;
  intervals_[interval_count_++ % kIntervals] = interval;
}

double TopicStatistics::usualInterval() const {
  if (interval_count_ < kMinIntervals) return 0;
  auto sorted = intervals_;
  const auto end = sorted.begin() + std::min(interval_count_, kIntervals);
  const auto middle = sorted.begin() + (end - sorted.begin()) / 2;
  std::nth_element(sorted.begin(), middle, end);
  return *middle;
}

bool beginsWithHeader(const std::string& definition) {
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string type;
    if (!(words >> type)) continue;
    const bool is_constant = line.find('=') < line.find('#');
    if (!is_constant) return type == "Header" || type == "std_msgs/Header";
  }
  return false;
}

void TopicBoard::begin(const std::vector<std::string>& topics) {
  is_counting_ = true;
  statistics_.clear();
  for (const std::string& topic : topics) statistics_[topic];
}

void TopicBoard::add(const Message& message, bool is_recorded) {
  Arrival& arrival = arrivals_[message.topic()];
  ++arrival.count;
  arrival.type = message.connection->field("type");
  arrival.is_latching = message.connection->isLatching();
  arrival.last = message.time;
  bytes_ += message.size();
  if (!is_counting_) return;
  TopicStatistics& statistics = statistics_[message.topic()];
  statistics.add(message);
  if (!is_recorded) statistics.addDropped(1);
}

void TopicBoard::addDropped(const std::map<std::string, std::uint64_t>& counts) {
  for (const auto& [topic, count] : counts) statistics_[topic].addDropped(count);
}

void TopicBoard::measureRates(SteadyTime now) {
  const bool was_late = is_late_;
  is_late_ = now - looked_ > kLate;
  looked_ = now;
  if (is_late_ && !was_late) return;
  const double period = std::chrono::duration<double>(now - measured_).count();
  measured_ = now;
  byte_rate_ = bytes_ / period;
  bytes_ = 0;
  for (auto& [topic, arrival] : arrivals_) {
    arrival.rate = (arrival.count - arrival.counted) / period;
    arrival.counted = arrival.count;
  }
}

std::vector<std::string> TopicBoard::fallenSilent(const ros::Time& now) {
  std::vector<std::string> topics;
  if (!is_counting_) return topics;
  for (auto& [topic, statistics] : statistics_)
    if (statistics.fellSilent(now)) topics.push_back(topic);
  return topics;
}

bool TopicBoard::hasSilent() const {
  return std::any_of(statistics_.begin(), statistics_.end(),
                     [](const auto& entry) { return entry.second.isSilent(); });
}

std::vector<TopicRecord> TopicBoard::records(const std::set<std::string>& topics,
                                             const ros::Time& now) const {
  std::vector<TopicRecord> records;
  for (const std::string& topic : topics) {
    TopicRecord record;
    record.name = topic;
    record.silence = -1;
    const auto arrival = arrivals_.find(topic);
    if (arrival != arrivals_.end()) {
      record.type = arrival->second.type;
      record.latching = arrival->second.is_latching;
      record.rate = arrival->second.rate;
      record.silence = (now - arrival->second.last).toSec();
    }
    const auto found = statistics_.find(topic);
    if (found != statistics_.end()) {
      const TopicStatistics& statistics = found->second;
      record.messages = statistics.received();
      record.bytes = statistics.bytes();
      record.dropped = statistics.dropped();
      record.lost = statistics.lost();
      record.gaps = statistics.gaps();
      record.largest_gap = statistics.largestGap();
      record.largest_gap_time = statistics.largestGapTime();
    }
    records.push_back(record);
  }
  return records;
}

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
