// SPDX-License-Identifier: BSD-3-Clause
/// Prints the time to write half a minute of a cell from the recorder's memory (75,000 messages of
/// 20 topics, 300 bytes each) as a bag on /dev/shm, compared with rosbag's own library, which is
/// given the same messages. Fails if it takes longer.
#include <rosbag/bag.h>
#include <std_msgs/String.h>

#include <cstdio>
#include <deque>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "beside_peer.hpp"
#include "process_visualizer/recorder/intake.hpp"
#include "process_visualizer/recorder/recording.hpp"

namespace recorder = process_visualizer::recorder;

namespace {

constexpr unsigned kTopics = 20, kMessages = 75'000, kBytes = 300;
constexpr double kRate = 2500, kLimit = 1.0;
const char* const kPath = "/dev/shm/process_visualizer_copy_recent.bag";

std::vector<recorder::Message> halfAMinute() {
  std::vector<recorder::ConnectionPtr> connections;
  for (unsigned i = 0; i < kTopics; ++i)
    connections.push_back(recorder::textConnection("/topic_" + std::to_string(i), "/n", false));
  std::vector<recorder::Message> messages;
  for (unsigned i = 0; i < kMessages; ++i)
    messages.push_back(recorder::textMessage(connections[i % kTopics], ros::Time(1 + i / kRate),
                                             std::string(kBytes - 4, 'x')));
  return messages;
}

void copy(const recorder::Intake& intake, const recorder::Preamble& all) {
  recorder::RecordingOptions options;
  options.path = kPath;
  options.minimum_free_bytes = 0;
  std::deque<recorder::Message> messages = intake.copy(all);
  recorder::BagFile file = recorder::createWhole(options, recorder::bagBytes(messages));
  recorder::writeWhole(file, std::move(messages));
  file.remove();
}

void writeWithRosbag(const std::vector<recorder::Message>& messages) {
  {
    rosbag::Bag bag(kPath, rosbag::bagmode::Write);
    std_msgs::String text;
    text.data = std::string(kBytes - 4, 'x');
    for (const recorder::Message& message : messages)
      bag.write(message.topic(), message.time, text);
  }
  std::filesystem::remove(kPath);
}

}  // namespace

int main() {
  ros::Time::init();
  const std::vector<recorder::Message> messages = halfAMinute();
  recorder::Intake intake("/recorder", {1e9, 1 << 30}, [] {});
  const recorder::TopicChoice choice({}, {"/topic_.*"}, {});
  intake.choose(choice);
  recorder::Publishers publishers;
  for (const recorder::Message& message : messages) publishers[message.topic()] = {"/n"};
  intake.follow(publishers, {});
  for (const recorder::Message& message : messages) intake.receive(message);
  const recorder::Preamble all{intake.choice(), 1e12, ""};
  constexpr int kTurns = 3, kTimes = 3;
  const bool is_kept = isWithin(
      kLimit, "copy of 75,000 messages", [&] { copy(intake, all); }, "rosbag::Bag",
      [&] { writeWithRosbag(messages); }, kTurns, kTimes);
  return is_kept ? 0 : 1;
}
