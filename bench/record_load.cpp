// SPDX-License-Identifier: BSD-3-Clause
// Publishes messages of the simulated cell's shape and counts them: two robots (joint states and
// tool frames at 125 Hz, forces at 94 Hz) and cameras of 46 MB/s (640 x 480 at 30 Hz).
//
// usage: record_load SECONDS CAMERAS
// It waits until every topic has a subscriber, publishes for this time, and prints "TOPIC COUNT"
// lines.

#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/Float32MultiArray.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

// One topic: the function that publishes its next message, its due time, and the number sent.
struct Source {
  ros::Publisher publisher;
  std::function<void(const ros::Publisher&, unsigned)> publish;
  Clock::duration period;
  Clock::time_point due;
  unsigned count = 0;
};

Clock::duration periodOf(double rate) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / rate));
}

Source numbers(ros::NodeHandle& node, const std::string& topic, double rate, unsigned size) {
  auto publish = [size](const ros::Publisher& publisher, unsigned count) {
    std_msgs::Float32MultiArray message;
    message.data.assign(size, static_cast<float>(count));
    publisher.publish(message);
  };
  return {node.advertise<std_msgs::Float32MultiArray>(topic, 1000), publish, periodOf(rate), {}};
}

Source image(ros::NodeHandle& node, const std::string& topic, const std::string& encoding,
             unsigned pixel_bytes) {
  sensor_msgs::Image message;
  message.width = 640;
  message.height = 480;
  message.encoding = encoding;
  message.step = message.width * pixel_bytes;
  message.data.resize(message.step * message.height);
  for (std::size_t i = 0; i < message.data.size(); ++i) message.data[i] = (i * 2654435761u) >> 24;
  auto publish = [message](const ros::Publisher& publisher, unsigned) mutable {
    message.header.stamp = ros::Time::now();
    publisher.publish(message);
  };
  return {node.advertise<sensor_msgs::Image>(topic, 30), publish, periodOf(30.0), {}};
}

Source info(ros::NodeHandle& node, const std::string& topic) {
  auto publish = [](const ros::Publisher& publisher, unsigned) {
    sensor_msgs::CameraInfo message;
    message.header.stamp = ros::Time::now();
    publisher.publish(message);
  };
  return {node.advertise<sensor_msgs::CameraInfo>(topic, 100), publish, periodOf(30.0), {}};
}

std::vector<Source> sources(ros::NodeHandle& node, int cameras) {
  std::vector<Source> all;
  for (const std::string robot : {"upper", "lower"}) {
    all.push_back(numbers(node, "/ur_rt_" + robot + "/q_act", 125.0, 6));
    all.push_back(numbers(node, "/ur_rt_" + robot + "/tcf", 125.0, 12));
    all.push_back(numbers(node, "/ft_" + robot + "/ft", 94.0, 6));
  }
  for (int i = 0; i < cameras; ++i) {
    const std::string camera = i == 0 ? "/camera" : "/camera" + std::to_string(i + 1);
    all.push_back(image(node, camera + "/rgb/image_color", "rgb8", 3));
    all.push_back(info(node, camera + "/rgb/camera_info"));
    all.push_back(image(node, camera + "/depth_registered/image_raw", "16UC1", 2));
    all.push_back(info(node, camera + "/depth_registered/camera_info"));
  }
  return all;
}

void waitForSubscribers(const std::vector<Source>& all) {
  for (const Source& source : all)
    while (ros::ok() && source.publisher.getNumSubscribers() == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

void publishUntil(std::vector<Source>& all, Clock::time_point end) {
  const auto begin = Clock::now();
  for (Source& source : all) source.due = begin;
  while (ros::ok()) {
    auto next = std::min_element(all.begin(), all.end(),
                                 [](const Source& a, const Source& b) { return a.due < b.due; });
    if (next->due >= end) return;
    std::this_thread::sleep_until(next->due);
    next->publish(next->publisher, next->count++);
    next->due += next->period;
  }
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "record_load");
  if (argc != 3) {
    std::fprintf(stderr, "usage: record_load SECONDS CAMERAS\n");
    return 2;
  }
  ros::NodeHandle node;
  std::vector<Source> all = sources(node, std::stoi(argv[2]));
  ros::AsyncSpinner spinner(1);
  spinner.start();
  waitForSubscribers(all);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  publishUntil(all, Clock::now() + std::chrono::seconds(std::stoi(argv[1])));
  for (const Source& source : all)
    std::printf("%s %u\n", source.publisher.getTopic().c_str(), source.count);
  std::fflush(stdout);
  std::this_thread::sleep_for(std::chrono::seconds(3));  // queued messages are still sent
  return 0;
}
