// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/Mark.h>
#include <process_visualizer/RecorderState.h>
#include <process_visualizer/StartRecording.h>
#include <process_visualizer/StopRecording.h>
#include <ros/node_handle.h>

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/recorder/recording.hpp"
#include "process_visualizer/recorder/subscriptions.hpp"
#include "process_visualizer/recorder/topic_board.hpp"
#include "process_visualizer/recorder/topic_choice.hpp"

namespace process_visualizer::recorder {

/// The node bag_recorder: services `~start ~save_recent ~stop ~mark`, topic `~state`.
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
  bool stop(StopRecording::Request&, StopRecording::Response& response);
  bool mark(Mark::Request& request, Mark::Response& response);

  bool answer(Start::Response& response, const std::function<std::string()>& command);
  std::string begin(const Start::Request& request);
  std::string save(const Start::Request& request);
  void connect();
  Past past(const ros::Time& now, double recent_s, const TopicChoice& choice) const;
  void open(const RecordingOptions& options, const Start::Request& request, const Past& past);
  void finish(std::chrono::milliseconds under_way, ros::Time end = {});
  void requireIdle() const;
  void watch(TopicChoice choice);
  void subscribe();
  std::vector<std::string> ownPrefixes() const;

  void receive(Message message);
  bool takeIn(const Message& message);
  void addProblem(const std::string& problem);
  void setPhase(std::uint8_t phase);

  void publishStates();
  void tellSilence();
  RecorderState state() const;
  void followMaster();
  void lookAtMaster();
  void followPublishers(const Publishers& publishers);
  bool waitFor(std::chrono::milliseconds period);

  ros::NodeHandle node_{"~"};
  const std::string name_;
  const std::string folder_;
  const std::string configuration_;
  const double connection_timeout_;
  const ConnectionPtr mark_connection_, account_connection_, configuration_connection_;

  std::mutex command_mutex_;  ///< one command at a time; before mutex_

  mutable std::mutex mutex_;  ///< for what follows
  std::uint8_t phase_ = RecorderState::IDLE;
  std::shared_ptr<Recording> recording_;  ///< the one that takes messages
  std::shared_ptr<Recording> last_;       ///< the one whose figures are shown
  ros::SteadyTime begin_, end_;           ///< of that one
  TopicBoard board_;
  RecentMessages recent_;
  std::map<ConnectionPtr, ConnectionPtr> calibrations_;
  TopicChoice choice_;  ///< changed by commands only, under both mutexes
  std::vector<std::string> problems_;
  std::uint32_t problem_count_ = 0;  ///< since the node runs
  bool has_master_ = true;
  bool shutting_down_ = false;
  std::condition_variable wake_;

  ros::Publisher state_publisher_, mark_publisher_;
  std::vector<ros::ServiceServer> services_;
  Subscriptions subscriptions_;
  std::thread state_thread_, master_thread_;
};

}  // namespace process_visualizer::recorder
