// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/topic_board.hpp"

namespace process_visualizer::recorder {

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

}  // namespace process_visualizer::recorder
