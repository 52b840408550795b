// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/PlayerState.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <rviz/display.h>
#include <std_msgs/Bool.h>
#include <std_msgs/String.h>

#include <QTimer>
#include <memory>
#include <optional>
#include <string>

#include "replay_mark.hpp"
#include "replay_text.hpp"
#include "replay_window.hpp"

namespace rviz {
class BoolProperty;
class RosTopicProperty;
}  // namespace rviz

namespace process_visualizer::displays {

/// RViz display for a second RViz that stands in front of the live one and shows what was a moment
/// ago. It draws nothing in the scene. A band across the window and a frame around the scene say
/// that this is not live, and how long ago it was: the player's state says it.
///
/// The window appears and disappears as `~shown` of the RViz node (std_msgs/Bool) says; hidden,
/// RViz does nothing. When the window appears, it has the camera of the live one (`~camera` there);
/// from then on the operator may look from elsewhere.
class ReplayBand : public rviz::Display {
 public:
  ReplayBand();
  ~ReplayBand() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void subscribeState();
  void subscribeCamera();
  void takeState(const PlayerState& state);
  void takeCamera(const std_msgs::String& camera);
  void takeShown(const std_msgs::Bool& shown);
  /// Takes messages and brings the text up to date, also while RViz itself does nothing.
  void work();
  void mark();
  void adoptCamera();

  rviz::RosTopicProperty* state_topic_;
  rviz::RosTopicProperty* camera_topic_;
  rviz::BoolProperty* shown_at_start_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber state_subscriber_;
  ros::Subscriber camera_subscriber_;
  ros::Subscriber shown_subscriber_;
  std::optional<PlayedState> state_;
  std::string camera_;
  ReplayText text_;
  std::unique_ptr<ReplayWindow> window_;
  std::unique_ptr<ReplayMark> mark_;
  QTimer timer_;
};

}  // namespace process_visualizer::displays
