// SPDX-License-Identifier: BSD-3-Clause
// The drivers of many robots, and the stopwatch: publishes joint positions, tool frames and forces
// of N robots, and measures each message's delay to joint_states, /tf and marker_array.
//
// Every message carries its number: in the first joint's angle and in the force. So the output
// identifies its input message without stamps. Robot i runs a little faster than robot
// i - 1, so that within seconds all phases between the robots occur.
//
// Parameters: ~robots, ~joint_rate, ~force_rate (Hz), ~warm_up, ~seconds. Prints one line of JSON.

#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Float32MultiArray.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/common/time_slice.hpp"

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kNumbers = 30000;  // a number is repeated after four minutes
constexpr double kRadPerNumber = 1e-4;
constexpr double kRateStep = 3e-4;  // between neighboring robots

double secondsNow() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

// Sending time of each message of a topic, by its number.
class SendTimes {
 public:
  int next() {
    number_ = (number_ + 1) % kNumbers;
    times_[number_] = secondsNow();
    return number_;
  }
  double age(int number) const { return secondsNow() - times_.at(number % kNumbers); }

 private:
  int number_ = 0;
  std::array<std::atomic<double>, kNumbers> times_{};
};

// Delays of one kind of output [s].
class Delays {
 public:
  void add(double delay_s) { delays_.push_back(delay_s); }
  void clear() { delays_.clear(); }

  std::string json(double seconds) {
    std::sort(delays_.begin(), delays_.end());
    char text[200];
    std::snprintf(text, sizeof text,
                  "{\"rate\": %.1f, \"median_ms\": %.3f, \"p99_ms\": %.3f, \"max_ms\": %.3f}",
                  delays_.size() / seconds, quantile(0.5), quantile(0.99), quantile(1.0));
    return text;
  }

 private:
  double quantile(double share) const {
    if (delays_.empty()) return NAN;
    const auto index = static_cast<std::size_t>(share * (delays_.size() - 1));
    return 1e3 * delays_[index];
  }

  std::vector<double> delays_;
};

struct Stopwatch {
  Delays joint_states, transforms, markers;
};

// One robot's driver, and the output of its processor.
class Robot {
 public:
  Robot(ros::NodeHandle& node, const std::string& name, Stopwatch& stopwatch)
      : link_(name + "/link1"), stopwatch_(stopwatch) {
    using std_msgs::Float32MultiArray;
    joints_ = node.advertise<Float32MultiArray>("/" + name + "/q_act", 10);
    tool_frame_ = node.advertise<Float32MultiArray>("/" + name + "/tcf", 10);
    force_ = node.advertise<Float32MultiArray>("/" + name + "/ft", 10);
    const auto no_delay = ros::TransportHints().tcpNoDelay();
    states_ = node.subscribe("/" + name + "/joint_states", 50, &Robot::onStates, this, no_delay);
    markers_ = node.subscribe("/" + name + "/marker_array", 50, &Robot::onMarkers, this, no_delay);
  }

  bool connected() const {
    return joints_.getNumSubscribers() && tool_frame_.getNumSubscribers() &&
           force_.getNumSubscribers() && states_.getNumPublishers() && markers_.getNumPublishers();
  }

  void publishMotion(double time_s) {
    const float angle = static_cast<float>(kRadPerNumber * joint_times_.next());
    const float y = static_cast<float>(0.1 * std::sin(time_s));
    publish(joints_, {angle, -1.0F, 1.5F, -2.1F, -1.57F, 0.0F});
    publish(tool_frame_, {-0.6F, y, 0.2F, 3.14159F, 0.0F, 0.0F});
  }

  void publishForce() {
    publish(force_, {static_cast<float>(force_times_.next()), 0.0F, 0.0F, 0.0F, 0.0F, 0.0F});
  }

  void onTransform(const geometry_msgs::TransformStamped& transform) {
    if (transform.child_frame_id == link_) {
      const auto& turn = transform.transform.rotation;
      stopwatch_.transforms.add(jointAge(2.0 * std::atan2(turn.z, turn.w)));
    }
  }

 private:
  static void publish(ros::Publisher& publisher, std::initializer_list<float> values) {
    std_msgs::Float32MultiArray message;
    message.data = values;
    publisher.publish(message);
  }

  void onStates(const sensor_msgs::JointState::ConstPtr& state) {
    stopwatch_.joint_states.add(jointAge(state->position.at(0)));
  }

  // The processor draws the force as an arrow of one meter per newton.
  void onMarkers(const visualization_msgs::MarkerArray::ConstPtr& array) {
    for (const auto& marker : array->markers) {
      if (marker.ns != "force" || marker.type != visualization_msgs::Marker::ARROW) continue;
      const int number = static_cast<int>(std::lround(marker.scale.x));
      if (number == last_drawn_) continue;
      last_drawn_ = number;
      stopwatch_.markers.add(force_times_.age(number));
    }
  }

  double jointAge(double angle) const {
    return joint_times_.age(static_cast<int>(std::lround(angle / kRadPerNumber)));
  }

  std::string link_;
  Stopwatch& stopwatch_;
  SendTimes joint_times_, force_times_;
  int last_drawn_ = -1;
  ros::Publisher joints_, tool_frame_, force_;
  ros::Subscriber states_, markers_;
};

// An action with a rate of its own.
struct Task {
  Robot* robot;
  bool motion;
  double period_s;
  double next_s;
};

std::vector<Task> makeTasks(const std::vector<std::unique_ptr<Robot>>& robots, double joint_rate,
                            double force_rate) {
  std::vector<Task> tasks;
  double faster = 1.0;
  for (const auto& robot : robots) {
    tasks.push_back({robot.get(), true, 1.0 / (joint_rate * faster), secondsNow()});
    tasks.push_back({robot.get(), false, 1.0 / (force_rate * faster), secondsNow()});
    faster += kRateStep;
  }
  return tasks;
}

void drive(std::vector<Task>& tasks, double until_s) {
  for (;;) {
    auto task = std::min_element(tasks.begin(), tasks.end(),
                                 [](const Task& a, const Task& b) { return a.next_s < b.next_s; });
    if (task->next_s >= until_s || !ros::ok()) return;
    std::this_thread::sleep_until(Clock::time_point(
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(task->next_s))));
    task->motion ? task->robot->publishMotion(task->next_s) : task->robot->publishForce();
    task->next_s += task->period_s;
  }
}

bool waitForAll(const std::vector<std::unique_ptr<Robot>>& robots, double timeout_s) {
  const double end_s = secondsNow() + timeout_s;
  ros::WallRate rate(10);
  while (!std::all_of(robots.begin(), robots.end(), [](const auto& r) { return r->connected(); })) {
    if (secondsNow() > end_s || !ros::ok()) return false;
    ros::spinOnce();
    rate.sleep();
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "robots_driver");
  // The system under test must not block drivers or the stopwatch.
  if (!process_visualizer::takeRealTimePriority())
    process_visualizer::setTimeSlice(process_visualizer::kShortSlice);
  ros::NodeHandle node, parameters("~");
  const int count = parameters.param("robots", 1);
  const double warm_up_s = parameters.param("warm_up", 5.0);
  const double seconds = parameters.param("seconds", 20.0);

  Stopwatch stopwatch;
  std::vector<std::unique_ptr<Robot>> robots;
  for (int i = 0; i < count; ++i) {
    robots.push_back(std::make_unique<Robot>(node, "robot_" + std::to_string(i), stopwatch));
  }
  const boost::function<void(const tf2_msgs::TFMessage::ConstPtr&)> on_transforms =
      [&robots](const tf2_msgs::TFMessage::ConstPtr& message) {
        for (const auto& transform : message->transforms) {
          for (const auto& robot : robots) robot->onTransform(transform);
        }
      };
  const auto transforms = node.subscribe<tf2_msgs::TFMessage>(
      "/tf", 200, on_transforms, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  if (!waitForAll(robots, 60.0)) {
    std::fprintf(stderr, "robots_driver: not all robot processors were connected in 60 s\n");
    return 1;
  }

  auto tasks = makeTasks(robots, parameters.param("joint_rate", 125.0),
                         parameters.param("force_rate", 94.0));
  ros::AsyncSpinner spinner(1);
  spinner.start();
  drive(tasks, secondsNow() + warm_up_s);
  spinner.stop();
  std::fprintf(stderr, "measuring\n");
  stopwatch = Stopwatch();
  spinner.start();
  drive(tasks, secondsNow() + seconds);
  spinner.stop();
  std::printf("{\"joint_states\": %s, \"transforms\": %s, \"markers\": %s}\n",
              stopwatch.joint_states.json(seconds).c_str(),
              stopwatch.transforms.json(seconds).c_str(), stopwatch.markers.json(seconds).c_str());
  return 0;
}
