// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/Mark.h>
#include <process_visualizer/ReadRecent.h>
#include <process_visualizer/RecorderState.h>
#include <process_visualizer/StartRecording.h>
#include <process_visualizer/StopRecording.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/intake.hpp"
#include "process_visualizer/recorder/recent_answers.hpp"
#include "process_visualizer/recorder/recording_limits.hpp"
#include "process_visualizer/recorder/subscriptions.hpp"
#include "process_visualizer/recorder/turns.hpp"

namespace process_visualizer::recorder {

/// The node bag_recorder: services `~start ~save_recent ~copy_recent ~stop ~mark ~read_recent`,
/// topic `~state`.
class BagRecorder {
 public:
  BagRecorder();
  ~BagRecorder();

  /// Ends the recording, if there is one, and the services.
  void shutDown();

 private:
  using Start = StartRecording;

  bool start(Start::Request& request, Start::Response& response);
  bool saveRecent(Start::Request& request, Start::Response& response);
  bool copyRecent(Start::Request& request, Start::Response& response);
  bool stop(StopRecording::Request&, StopRecording::Response& response);
  bool mark(Mark::Request& request, Mark::Response& response);

  bool readRecent(ReadRecent::Request& request, ReadRecent::Response& response);

  static bool answer(Start::Response& response, const std::function<std::string()>& command);
  std::string begin(const Start::Request& request);
  std::string save(const Start::Request& request);
  std::string copy(const Start::Request& request);
  BagFile createCopy(const Start::Request& request, std::uint64_t bytes);
  void connect();
  Beginning beginningOf(const Start::Request& request, TopicChoice choice) const;
  Beginning memoryOf(const Start::Request& request) const;
  void finish(std::chrono::milliseconds under_way);
  void waitUntilWritten();
  void requireIdle() const;
  void setFileModeMask() const;
  void watch(TopicChoice choice);
  std::vector<std::string> ownPrefixes() const;

  void addProblem(const std::string& problem);
  void setPhase(std::uint8_t phase);
  void publishStates();
  void tellSilence();
  RecorderState state() const;
  void followMaster();
  void lookAtMaster();
  void followPublishers(const Publishers& publishers);

  ros::NodeHandle node_{"~"};
  const std::string name_;
  const std::string folder_;
  const AllowedFolders allowed_folders_;
  const std::string configuration_;
  const double connection_timeout_;

  std::mutex command_mutex_;  ///< one command at a time
  std::mutex naming_mutex_;   ///< from the choice of a file's name until there is the file
  Turns turns_;
  Intake intake_;
  RecentAnswers recent_answers_{intake_};
  bool has_master_ = true;  ///< for the thread that looks at it

  ros::Publisher state_publisher_, mark_publisher_;
  ros::CallbackQueue copy_queue_;  // the services need it to the end
  std::vector<ros::ServiceServer> services_;
  ros::AsyncSpinner copy_spinner_{1, &copy_queue_};  ///< so that no command waits for a copy
  Subscriptions subscriptions_;
  std::thread state_thread_, master_thread_;
};

}  // namespace process_visualizer::recorder
